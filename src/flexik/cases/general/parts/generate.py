"""Tables that networks learn from and are selected by, and random targets to judge by."""

from flexik.planar.generate import parts

__all__ = ["parts"]
