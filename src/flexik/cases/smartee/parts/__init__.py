"""What the stages compute for the SmartEE."""
