"""The flexible two-link arm."""
