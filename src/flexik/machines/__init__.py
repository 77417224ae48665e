"""Machines as their files in data/machines describe them, checked."""
