"""Closed-form rigid kinematics, one file a mechanism (NumPy only)."""
