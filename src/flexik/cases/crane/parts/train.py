"""Networks from several starts; the selection set chooses among them."""

from flexik.planar.train import parts

__all__ = ["parts"]
