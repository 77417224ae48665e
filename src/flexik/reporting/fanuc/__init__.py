"""The report of the six-joint arm."""
