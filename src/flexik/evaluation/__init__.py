"""Positioning errors of a method on test conditions."""
