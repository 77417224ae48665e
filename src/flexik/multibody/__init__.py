"""Flexible models in static equilibrium; the only room that imports exudyn."""
