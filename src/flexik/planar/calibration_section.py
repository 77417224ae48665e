"""How the free constants of a planar machine are told, in params.yaml."""

from typing import Self

from pydantic import Field, model_validator

from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import Points
from flexik.parameters.model import Model, Name, Positive


class Calibration(Model):
    """Constants of the machine that are free, by their dotted key in its file, SI units.

    known : values of those that are known.
    ranges : least and largest value of those that are fitted: one to a mean error, or one and more
        to a campaign.
    mean_error : of the rigid inverse alone, m.
    conditions : those of the mean error, points with payloads or the name of a set that is.
    campaign : a CSV of measured tips at coordinates of the drives, in place of a mean error; see
        planar.measured.campaign_file.
    """

    known: dict[str, Positive] = Field(default_factory=dict)
    ranges: dict[str, tuple[Positive, Positive]] = Field(default_factory=dict)
    mean_error: Positive | None = None
    conditions: Points | Name | None = None
    campaign: str | None = None

    @model_validator(mode="after")
    def _fits_something(self) -> Self:
        for key, (low, high) in self.ranges.items():
            if not low < high:
                raise ValueError(f"ranges.{key}: must increase")
        to_error = self.mean_error is not None
        if self.ranges and to_error == (self.campaign is not None):
            raise ValueError("mean_error: expected it, with conditions, or else campaign")
        if self.ranges and to_error and (self.conditions is None or len(self.ranges) > 1):
            raise ValueError("mean_error: expected conditions for it, and one of ranges")
        return self

    def check_keys(self, machine: PlanarMachine) -> None:
        """Raise ValueError unless exactly what is free in `machine` is known or fitted."""
        for key in machine.free:
            if (key in self.known) == (key in self.ranges):
                raise ValueError(
                    f"machine.{key}: expected a value, or it once in calibration, known or ranges"
                )
        for key in (*self.known, *self.ranges):
            if key not in machine.free:
                raise ValueError(f"machine.{key}: expected fit, for calibration tells it")
