"""What the report says of the measured crane."""
