"""Data of the SmartEE parallel manipulator."""
