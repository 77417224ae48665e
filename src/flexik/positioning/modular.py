"""Method `modular`: inverse of two networks that add up, rigid tip and what it lacks.

Source: Rouvinen 1999, section 4.3 and figure 4.11. The two are one network by
`flexik.learning.modular.combine`.
"""

from typing import ClassVar, Literal

from flexik.positioning.inverted_network import InvertedSettings, build

__all__ = ["Settings", "build"]


class Settings(InvertedSettings):
    """See InvertedSettings."""

    method: Literal["modular"] = "modular"
    needs: ClassVar[str | None] = "correction"
