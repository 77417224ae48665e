"""Report of the elastic arm."""
