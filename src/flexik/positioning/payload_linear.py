"""Method `payload_linear`: the deflection linear in the payload, see payload_polynomial."""

from typing import ClassVar, Literal

from flexik.positioning.payload_polynomial import PolynomialSettings, build

__all__ = ["Settings", "build"]


class Settings(PolynomialSettings):
    """See PolynomialSettings."""

    method: Literal["payload_linear"] = "payload_linear"
    needs: ClassVar[str | None] = "payload_linear"
