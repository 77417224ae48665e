"""Grids, campaigns and errors of the crane, and what its networks learn from."""
