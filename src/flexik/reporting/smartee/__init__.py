"""Report of the SmartEE parallel manipulator."""
