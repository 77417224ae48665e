"""A measured machine: its stand-in, the campaign, and what is learnt from measurements."""

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import Field, model_validator

from flexik.machines.deviations import Expected, Length, Magnitudes
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
from flexik.positioning import beam_model, beam_network
from flexik.positioning.combined import Settings as Combined
from flexik.positioning.method import Settings

# Methods that can be adapted: what they predict is a deflection of the nominal machine
ADAPTED = (Combined, beam_model.Settings, beam_network.Settings)


class Campaign(Points):
    """Every point with every payload, without and with compensation, on a machine as built.

    file : a CSV of one's own takes its place, see planar.measured.campaign_file
    method : compensates; of kind combined, of the nominal machine
    noise : standard deviation of a measured coordinate, m; that of the thesis, chapter 4.6
    deviations : how far machines as built may be off
    seed : of the machine that is measured
    """

    file: str | None = None
    method: Name = "combined"
    noise: Length = 0.5e-3
    deviations: Magnitudes = Magnitudes()
    seed: Seed = 1

    @model_validator(mode="after")
    def _with_reference(self) -> Self:
        if 0.0 not in self.payloads:
            raise ValueError("payloads: expected 0, the reference of the errors, among them")
        if not any(self.payloads):
            raise ValueError("payloads: expected a load beside 0")
        return self


class Budget(Model):
    """The campaign on machines with one kind of deviation, or more of it.

    n_twins : machines as built
    factor : how many times as large a deviation is
    """

    n_twins: Count
    factor: Annotated[float, Field(gt=1, le=10)]


class Misjudged(Model):
    """An adaptation to expectations that are too small.

    share : of the deviations that are expected
    n_measurements : how many are learnt from, of those of the adaptation
    """

    share: Annotated[float, Field(gt=0, le=1)]
    n_measurements: list[Count]


class Adaptation(Model):
    """Machines as built that are adapted, measurements for it, and targets to judge by.

    method : what is corrected, of kind combined
    others : methods that are judged too, as they are and with the most measurements; of kind
        combined, beam_model or beam_network
    n_twins : machines as built
    n_measurements : how many are learnt from, in increasing order
    n_targets : others, to judge by, on each machine
    x, y : area of measurements and targets, m
    payload : least and largest, kg
    n_corrections : of the adapted method; play changes sides with the coordinates, so more than
        one pays
    expected : deviations that are expected before measuring
    misjudged : again by one who expects too little; not given: nobody does
    seed : of the first machine
    """

    method: Name
    others: list[Name] = []  # noqa: RUF012
    n_twins: Count
    n_measurements: Annotated[list[Annotated[int, Field(ge=3)]], Field(min_length=1)]
    n_targets: Count
    x: Interval
    y: Interval
    payload: tuple[NotNegative, NotNegative]
    n_corrections: Count = 3
    expected: Expected = Expected()
    misjudged: Misjudged | None = None
    seed: Seed = 100

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_increase(self, "x", "y")
        if self.payload[0] > self.payload[1]:
            raise ValueError("payload: must not decrease")
        if self.n_measurements != sorted(set(self.n_measurements)):
            raise ValueError("n_measurements: must increase")
        for number in self.misjudged.n_measurements if self.misjudged else ():
            if number not in self.n_measurements:
                raise ValueError(f"misjudged.n_measurements: {number} is not in n_measurements")
        return self


class Measured(Model):
    """Studies of a measured machine (Rouvinen 1999, chapter 4.6).

    campaign : what is measured
    budget : what each deviation does; not given: nothing is told of it
    adaptation : correcting the compensator by a few measurements
    """

    campaign: Campaign
    budget: Budget | None = None
    adaptation: Adaptation

    @property
    def methods(self) -> dict[str, str]:
        """Methods of kind combined that it names, by key."""
        return {"campaign": self.campaign.method, "adaptation": self.adaptation.method}

    def check_methods(self, methods: Mapping[str, Settings]) -> None:
        """Raise ValueError unless those that it names are among `methods`, of kind combined."""
        known = [name for name, given in methods.items() if isinstance(given, Combined)]
        adapted = [name for name, given in methods.items() if isinstance(given, ADAPTED)]
        asked = [(f"{key}.method", name, known) for key, name in self.methods.items()]
        asked += [
            (f"adaptation.others.{number}", name, adapted)
            for number, name in enumerate(self.adaptation.others)
        ]
        for key, name, known in asked:
            if name not in known:
                raise ValueError(
                    f"studies.measured.{key}: {name!r} is none of the methods that serve, "
                    f"{', '.join(known) or 'of which there is none'}"
                )
