"""Correcting the compensator of the crane by measurements."""
