"""The measured crane: its stand-in, the campaign, and what is learnt from measurements."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from flexik.machines.deviations import Clearance, Length, Magnitudes, Relative
from flexik.parameters.conditions import Points
from flexik.parameters.model import (
    Count,
    Interval,
    Model,
    Name,
    NotNegative,
    Seed,
    check_increase,
)

Known = Field(gt=0)  # an expectation of zero would leave nothing to identify


class Campaign(Points):
    """Every point with every payload, without and with compensation, on a crane as built.

    file : a CSV of one's own takes its place, see parts.measured.campaign_file; None: there is none
    method : compensates; of kind combined, of the nominal crane
    noise : standard deviation of a measured coordinate, m
    """

    file: str | None = None
    method: Name = "combined"
    noise: Length
    deviations: Magnitudes
    seed: Seed = 1

    @model_validator(mode="after")
    def _with_reference(self) -> Self:
        if 0.0 not in self.payloads:
            raise ValueError("payloads: expected 0, the reference of the errors, among them")
        if not any(self.payloads):
            raise ValueError("payloads: expected a load beside 0")
        return self


class Budget(Model):
    """The campaign on cranes with one kind of deviation, or `factor` times as much of it."""

    n_cranes: Count
    factor: Annotated[float, Field(gt=1, le=10)]


class Expected(Model):
    """What an adaptation expects before measuring, see parts.measured.adapted."""

    measurement: Annotated[Length, Known]
    repeatability: Clearance
    pivot: Annotated[Length, Known]
    length: Annotated[Length, Known]
    stroke_offset: Annotated[Length, Known]
    play: Clearance
    play_deviation: Annotated[Clearance, Known]
    section: Annotated[Relative, Known]
    spring: Annotated[Relative, Known]


class Misjudged(Model):
    """An adaptation to expectations that are too small."""

    share: Annotated[float, Field(gt=0, le=1)]
    n_measurements: list[Count]


class Adaptation(Model):
    """Cranes that are adapted, measurements for it, and targets to judge by."""

    method: Name
    n_cranes: Count
    n_measurements: Annotated[list[Annotated[int, Field(ge=3)]], Field(min_length=1)]
    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[NotNegative, NotNegative]
    n_corrections: Count
    expected: Expected
    misjudged: Misjudged
    seed: Seed = 100

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y")
        if self.payload[0] > self.payload[1]:
            raise ValueError("payload: must not decrease")
        if self.n_measurements != sorted(set(self.n_measurements)):
            raise ValueError("n_measurements: must increase")
        for number in self.misjudged.n_measurements:
            if number not in self.n_measurements:
                raise ValueError(f"misjudged.n_measurements: {number} is not in n_measurements")
        return self


class Measured(Model):
    """Studies of the measured crane (chapter 4.6)."""

    campaign: Campaign
    budget: Budget
    adaptation: Adaptation

    @property
    def methods(self) -> dict[str, str]:
        """Methods of kind combined that it names, by key."""
        return {"campaign": self.campaign.method, "adaptation": self.adaptation.method}
