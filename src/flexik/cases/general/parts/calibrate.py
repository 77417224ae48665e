"""Constants that are free, fitted or as they are known."""

from flexik.planar.calibrate import parts

__all__ = ["parts"]
