"""Method `payload_quadratic`: the deflection quadratic in the payload, see payload_polynomial."""

from typing import ClassVar, Literal

from flexik.positioning.payload_polynomial import PolynomialSettings, build

__all__ = ["Settings", "build"]


class Settings(PolynomialSettings):
    """See PolynomialSettings."""

    method: Literal["payload_quadratic"] = "payload_quadratic"
    needs: ClassVar[str | None] = "payload_quadratic"
