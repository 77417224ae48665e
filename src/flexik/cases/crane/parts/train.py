"""Networks from several starts; the selection set chooses among them."""

from flexik.planar.learners import parts

__all__ = ["parts"]
