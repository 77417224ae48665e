"""Errors of the six-joint arm."""
