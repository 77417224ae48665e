"""The section of any planar flexible machine in params.yaml."""

from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from flexik.errors import DataError, ParameterError
from flexik.parameters.conditions import ConditionSet
from flexik.parameters.model import Model, Name, NotNegative
from flexik.planar import section as planar
from flexik.planar.measured.section import Measured
from flexik.planar.own_samples import read_own
from flexik.planar.section import AnySamples, OwnSamples, PlanarSection
from flexik.planar.study_section import LearningCurves, PhysicsStudy, check_curves, check_physics
from flexik.positioning.registry import Methods


class Picture(Model):
    """Sample drawn in the picture.

    values : coordinates in the order of the drives, m or rad.
    payload : kg.
    """

    values: list[float]
    payload: NotNegative


class Studies(Model):
    """What is looked at beside the errors.

    picture : sample that is drawn; not given: all drives in the middle of their limits, the largest
        payload of the grid.
    learning_curves : errors by number of samples; not given: none.
    physics : what is left open about the machine; not given: nothing.
    measured : campaign on machines as built, and adaptation to it; not given: there is none.
    """

    picture: Picture | None = None
    learning_curves: LearningCurves | None = None
    physics: PhysicsStudy | None = None
    measured: Measured | None = None


class Section(PlanarSection):
    """A machine of a file and nothing else.

    calibration : constants that are `fit` in the machine file, known or fitted; null where none is.
    samples : equilibria of the model, or a file of samples of one's own.
    networks : what learns, by name; at least one.
    conditions : sets of targets and payloads by name; none where samples are of a file, which comes
        with no model to judge methods by.
    methods : what is compared, by name, `none` among them; one that is called like a
        method is this method; left out where samples are of a file.
    studies : what is looked at beside the errors.
    """

    samples: AnySamples  # type: ignore[assignment]
    conditions: dict[Name, ConditionSet] = Field(default_factory=dict)
    methods: Methods = Field(default_factory=dict)
    studies: Studies = Studies()

    @property
    def measured(self) -> Measured | None:
        """Studies of a machine as built."""
        return self.studies.measured

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if isinstance(self.samples, OwnSamples):
            self._check_own()
        elif not self.conditions:
            raise ValueError("conditions: expected a set, on which methods are judged")
        for name, network in self.networks.items():
            if network.learns == "coordinates" and len(self.machine.drives) != 2:
                raise ValueError(
                    f"networks.{name}.learns: coordinates need a machine of two drives"
                )
        check_curves(self, self.studies.learning_curves)
        check_physics(self, self.studies.physics)
        shown = self.studies.picture
        if shown is not None and len(shown.values) != len(self.machine.drives):
            raise ValueError(f"studies.picture.values: expected {len(self.machine.drives)} of them")
        return self

    def _check_own(self) -> None:
        if self.machine.free and self.calibration.campaign is None and self.calibration.ranges:
            raise ValueError("calibration: expected known, or campaign; there are no conditions")
        if self.studies.measured is not None:
            raise ValueError("studies.measured: samples of a file come with no model to measure")
        if self.conditions or set(self.methods) - {"none"}:
            raise ValueError(
                f"{'conditions' if self.conditions else 'methods'}: expected none; samples of a "
                "file come with no model to judge methods by, and networks are judged by those "
                "held out"
            )
        for name, network in self.networks.items():
            if network.learns == "coordinates":
                raise ValueError(f"networks.{name}.learns: expected deflection, tip or rigid_tip")


def check(section: Section) -> None:
    """See planar.section.check; samples of a file are read too."""
    planar.check(section)
    if isinstance(section.samples, OwnSamples):
        try:
            read_own(Path(section.samples.file), section.machine, section.samples.columns)
        except DataError as error:
            key = f"params.yaml: {section.name}.samples.file"
            raise ParameterError(f"{key}: {error}") from None
