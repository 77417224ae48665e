"""Method `direct`: inverse of a network that learnt the tip of the flexible manipulator.

Source: Rouvinen 1999, section 4.2 and figure 4.9.
"""

from typing import ClassVar, Literal

from flexik.positioning.inverted_network import InvertedSettings, build

__all__ = ["Settings", "build"]


class Settings(InvertedSettings):
    """See InvertedSettings."""

    method: Literal["direct"] = "direct"
    needs: ClassVar[str | None] = "tip"
