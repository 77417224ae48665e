"""The crane as it was built."""
