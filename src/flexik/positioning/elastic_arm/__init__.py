"""Positioning of the elastic arm."""
