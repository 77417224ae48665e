"""The ground spring, so that the uncompensated mean error is the published one."""

from flexik.planar.calibrate import parts

__all__ = ["parts"]
