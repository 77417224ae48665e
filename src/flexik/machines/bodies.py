"""Bodies of a planar machine: beams that bend and rigid ones, each in a frame of its own."""

import math
import re
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from flexik.machines.sections import Array, Section, SectionKind
from flexik.parameters.model import Model, Positive, plausible

# Abscissas this close are the same, m
TOLERANCE = 1e-6
# Below this distance two stations of a beam share a node: short elements are so stiff that the
# round-off floor of the solver rises above its tolerance, m
MERGE_DISTANCE = 0.03
# Elements of a beam
MOST_ELEMENTS = 500


def _named(pattern: str, words: str) -> AfterValidator:
    def check(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise PydanticCustomError("name", "{words}", {"words": words})
        return text

    return AfterValidator(check)


NAME = "[a-z][a-z0-9_]*"
Name = Annotated[str, _named(NAME, "a name is small letters, digits and _, the first a letter")]
Reference = Annotated[str, _named(rf"{NAME}\.{NAME}", "expected body.point")]
Coordinate = Annotated[float, plausible(0.0, 100.0, "m", mm=1e-3)]
Point = tuple[Coordinate, Coordinate]
Length = Annotated[float, Field(gt=0), plausible(1e-3, 100.0, "m", mm=1e-3)]
Angle = Annotated[float, plausible(0.0, 2 * math.pi, "rad", degrees=math.pi / 180)]
Mass = Annotated[float, Field(ge=0), plausible(1e-3, 1e6, "kg", g=1e-3)]
Modulus = Annotated[float, Field(gt=0), plausible(1e8, 2e12, "Pa", GPa=1e9, MPa=1e6)]
Density = Annotated[float, Field(gt=0), plausible(10.0, 25e3, "kg/m3", **{"g/cm3": 1e3})]
Free = Positive | Literal["fit"]


class Angled(Model):
    """A part of the file with angles, which may be given in degrees."""

    @model_validator(mode="before")
    @classmethod
    def _from_degrees(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        found: dict[Any, Any] = {}
        for key, value in data.items():
            plain = str(key).removesuffix("_degrees")
            if plain != key and plain in data:
                raise ValueError(f"{plain}: stands twice, in rad and in degrees")
            entries = value if isinstance(value, list) else [value]
            if plain != key and plain in cls.model_fields:
                if not all(isinstance(entry, int | float) for entry in entries):
                    raise ValueError(f"{key}: expected numbers, got {value!r}")
                key, value = plain, np.radians(value).tolist()
            found[key] = value
        return found


class _Body(Angled):
    """What all bodies have.

    points : by name, x and y in m in the frame of the body; a beam has a node near the
        foot of each, in this order of precedence, unless the foot lies beyond its ends.
    angle : of its frame from the ground's x with all drives in the middle of their limits; about
        right is enough, to tell which of two ways to put a linkage together is meant.
    masses : further masses by point, in kg.
    """

    points: Annotated[dict[Name, Point], Field(min_length=1)]
    angle: Angle = 0.0
    masses: Annotated[dict[Name, Mass], Field(default_factory=dict)]


class Rigid(_Body):
    """A body that does not bend.

    mass : kg, without further masses.
    centre : of mass, in its own frame.
    """

    kind: Literal["rigid"]
    mass: Mass
    centre: Point

    def weight(self) -> tuple[float, Point]:
        """Mass in kg without further masses, and its centre in the frame of the body."""
        return self.mass, self.centre


class Beam(_Body):
    """A body that bends.

    axis : line of the centroids of its sections in its own frame, straight between these points.
    start : abscissa of the first of them, to which section and mass_span refer; it grows along the
        axis.
    section : width, height and so on, or a table.
    youngs_modulus : Pa; of steel 210e9.
    poisson : for shear alone.
    shear_coefficient : share of the area that bears shear (Timoshenko); needed for shear.
    stiffness_factor : of its bending stiffness, or `fit`.
    mass : kg, with its centre; or else density.
    centre : of mass, in the body's frame.
    density : kg/m3 of the section, in place of mass and centre.
    mass_span : abscissas between which the mass lies, all of it if not given; the mass of a length
        follows the area times a linear factor that gives mass and centre.
    n_elements : finite elements, none longer than the beam over this; points add nodes, and where
        the section varies there are three or more between two.
    """

    kind: Literal["beam"]
    axis: tuple[Point, ...]
    start: Coordinate = 0.0
    section: SectionKind
    youngs_modulus: Modulus
    poisson: Annotated[float, Field(ge=0, lt=0.5)] = 0.3
    shear_coefficient: Annotated[float, Field(gt=0, le=1)] | None = None
    stiffness_factor: Free = 1.0
    mass: Mass | None = None
    centre: Point | None = None
    mass_span: tuple[Coordinate, Coordinate] | None = None
    density: Density | None = None
    n_elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)]

    @property
    def span(self) -> tuple[float, float]:
        """First and last abscissa, m."""
        return self.start, self.start + float(self._lengths.sum())

    @property
    def _lengths(self) -> Array:
        return np.hypot(*np.diff(self.axis, axis=0).T)

    def profile(self) -> Section:
        """Section along the axis; raises DataError if its table cannot be read."""
        return self.section.along(*self.span)

    def foot(self, point: Point) -> tuple[float, float]:
        """Abscissa of the place on the axis nearest to `point`, and how far left of it that lies.

        Both in m; beyond an end of the axis, that of its prolongation.
        """
        corners, lengths = np.array(self.axis), self._lengths
        along = np.diff(corners, axis=0) / lengths[:, None]
        from_corner = np.array(point) - corners[:-1]
        ahead = np.sum(along * from_corner, axis=1)
        left = along[:, 0] * from_corner[:, 1] - along[:, 1] * from_corner[:, 0]
        outside = np.maximum(ahead - lengths, 0.0) + np.maximum(-ahead, 0.0)
        k = int(np.hypot(left, outside).argmin())
        low = -np.inf if k == 0 else 0.0
        high = np.inf if k == len(lengths) - 1 else lengths[k]
        before = float(lengths[:k].sum())
        return self.start + before + float(np.clip(ahead[k], low, high)), float(left[k])

    def place(self, abscissa: float) -> tuple[Point, float]:
        """Point of the axis at `abscissa` in m, and the angle of the axis there, in its frame."""
        corners, lengths = np.array(self.axis), self._lengths
        ends = self.start + np.cumsum(lengths)
        k = min(int(np.searchsorted(ends, abscissa)), len(lengths) - 1)
        step = (corners[k + 1] - corners[k]) / lengths[k]
        x, y = corners[k] + (abscissa - (ends[k] - lengths[k])) * step
        return (float(x), float(y)), math.atan2(step[1], step[0])

    def weight(self) -> tuple[float, Point]:
        """Mass in kg without further masses, and its centre in the frame of the body."""
        if self.mass is not None and self.centre is not None:
            return self.mass, self.centre
        x, mass = self.slices()
        places = np.array([self.place(abscissa)[0] for abscissa in x])
        centre = mass @ places / mass.sum()
        return float(mass.sum()), (float(centre[0]), float(centre[1]))

    def slices(self, n: int = 1000) -> tuple[Array, Array]:
        """Middles (n,) in m of slices of the beam, and what they weigh by `density`, kg."""
        low, high = self.span
        x = low + (np.arange(n) + 0.5) / n * (high - low)
        section = self.profile()
        area = np.interp(x, section.abscissa, section.area)
        return x, area * (high - low) / n * (self.density or 1.0)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if len(self.axis) < 2 or not (self._lengths > 0).all():
            raise ValueError("axis: expected two points or more, neighbours apart")
        if len(self.axis) > 2 and self._lengths.min() < MERGE_DISTANCE:
            raise ValueError(f"axis: expected corners {MERGE_DISTANCE} m apart or more")
        if (self.density is None) == (self.mass is None or self.centre is None):
            raise ValueError("mass: expected mass and centre, or else density")
        if self.mass_span is not None:
            low, high = self.span
            first, last = self.mass_span
            if not low - TOLERANCE <= first < last <= high + TOLERANCE:
                raise ValueError(
                    f"mass_span: expected two increasing values within {low:g} and {high:g} m, got "
                    f"{first:g} and {last:g}"
                )
        if self.centre is not None:
            first, last = self.mass_span or self.span
            if not first < self.foot(self.centre)[0] < last:
                raise ValueError(f"centre: must lie between abscissas {first:g} and {last:g} m")
        return self
