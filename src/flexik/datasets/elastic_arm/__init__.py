"""Tables of the elastic arm."""
