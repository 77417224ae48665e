"""Networks of many sizes from several starts, of which the selection error chooses the size."""

from flexik.planar.select import parts

__all__ = ["parts"]
