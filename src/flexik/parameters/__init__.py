"""What sections of params.yaml and machine files are made of, and how they are read."""
