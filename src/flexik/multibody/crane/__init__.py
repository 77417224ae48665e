"""The flexible crane, nominal and as built."""
