"""Taught path, random poses and errors of the six-joint arm."""
