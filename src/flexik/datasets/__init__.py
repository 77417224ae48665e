"""Grids, Parquet tables with units, and the parallel map."""
