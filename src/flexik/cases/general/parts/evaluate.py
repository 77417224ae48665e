"""Errors of every method under every set of conditions."""

from flexik.planar.evaluate import parts

__all__ = ["parts"]
