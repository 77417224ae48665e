"""Sections of beams: tables in files, or closed forms whose dimensions may taper."""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from flexik.errors import DataError
from flexik.parameters.model import Model, plausible

Array = NDArray[np.float64]

SECTION_COLUMNS = ("x_m", "Iz_m4", "A_m2")

# Rows of the table that a tapered closed form becomes
TAPER_ROWS = 65


@dataclass(frozen=True)
class Section:
    """Section along a beam, linear between rows and constant beyond: abscissa m, Iz m4, A m2."""

    abscissa: Array
    second_moment: Array
    area: Array


def read_section(path: Path | str) -> Section:
    """Read a section table: CSV with columns x_m, Iz_m4, A_m2, x strictly increasing.

    Raises DataError if the file is missing, lacks a column, or holds a value that is no section.
    """
    path = Path(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy only warns of an empty file
            table = np.genfromtxt(path, delimiter=",", names=True, dtype=float, encoding="utf-8")
    except OSError as error:  # NumPy's words name the file once more
        reason = error.strerror or "there is no such file"
        raise DataError(f"section table {path}: cannot be read ({reason})") from None
    except (ValueError, IndexError, UserWarning) as error:
        reason = " ".join(str(error).split())
        raise DataError(f"section table {path}: cannot be read ({reason})") from None
    if table.dtype.names != SECTION_COLUMNS:
        known, got = ", ".join(SECTION_COLUMNS), ", ".join(table.dtype.names or ("none",))
        raise DataError(f"section table {path}: expected columns {known}, got {got}")
    x, second_moment, area = (np.atleast_1d(table[name]) for name in SECTION_COLUMNS)
    if len(x) < 2 or not (np.diff(x) > 0).all():
        raise DataError(f"section table {path}: x_m must increase over at least two rows")
    if not ((second_moment > 0).all() and (area > 0).all()):
        raise DataError(f"section table {path}: Iz_m4 and A_m2 must be positive numbers")
    return Section(x, second_moment, area)


# Largest of a section's own dimensions, m
Dimension = Annotated[float, Field(gt=0), plausible(1e-4, 5.0, "m", mm=1e-3)]
# One dimension all along, or that of the first and of the last section, linear between
Taper = Dimension | tuple[Dimension, Dimension]


def _plain_path(path: str) -> str:
    if not re.fullmatch(r"[\w./-]+", path):
        raise PydanticCustomError("path", "expected a path of letters, digits and . _ - /")
    return path


class Table(Model):
    """A table of the section over the abscissa of the beam, linear between rows.

    file : CSV of columns x_m, Iz_m4, A_m2, found from the folder of the project.
    """

    kind: Literal["table"]
    file: Annotated[str, AfterValidator(_plain_path)]

    def along(self, start: float, end: float) -> Section:
        """Section from abscissa `start` to `end`; raises DataError as read_section does."""
        return read_section(self.file)


class _ClosedForm(Model):
    """A section whose dimensions are given; `along` is its table."""

    def along(self, start: float, end: float) -> Section:
        """Section from abscissa `start` to `end`, in m."""
        dimensions = [getattr(self, name) for name in type(self).model_fields if name != "kind"]
        tapered = any(isinstance(value, tuple) for value in dimensions)
        share = np.linspace(0.0, 1.0, TAPER_ROWS if tapered else 2)
        area, second_moment = self.properties(share)
        return Section(start + share * (end - start), second_moment, area)

    def properties(self, share: Array) -> tuple[Array, Array]:
        """Area (n,) in m2 and second moment (n,) in m4 at `share` (n,) of the length."""
        raise NotImplementedError


class Box(_ClosedForm):
    """Hollow rectangle; each dimension one number, or those of the first and last section.

    width, height, wall : outer, height in the plane of bending, m.
    """

    kind: Literal["box"]
    width: Taper
    height: Taper
    wall: Taper

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        _check_wall(self, "width", "height")
        return self

    def properties(self, share: Array) -> tuple[Array, Array]:
        """See _ClosedForm."""
        width, height, wall = (_linear(v, share) for v in (self.width, self.height, self.wall))
        inner_width, inner_height = width - 2 * wall, height - 2 * wall
        area = width * height - inner_width * inner_height
        return area, (width * height**3 - inner_width * inner_height**3) / 12


class Tube(_ClosedForm):
    """Hollow circle; each dimension one number, or those of the first and last section.

    diameter, wall : outer, m.
    """

    kind: Literal["tube"]
    diameter: Taper
    wall: Taper

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        _check_wall(self, "diameter")
        return self

    def properties(self, share: Array) -> tuple[Array, Array]:
        """See _ClosedForm."""
        outer = _linear(self.diameter, share)
        inner = outer - 2 * _linear(self.wall, share)
        return np.pi / 4 * (outer**2 - inner**2), np.pi / 64 * (outer**4 - inner**4)


class Solid(_ClosedForm):
    """Full rectangle; each dimension one number, or those of the first and last section.

    width, height : height in the plane of bending, m.
    """

    kind: Literal["solid"]
    width: Taper
    height: Taper

    def properties(self, share: Array) -> tuple[Array, Array]:
        """See _ClosedForm."""
        width, height = _linear(self.width, share), _linear(self.height, share)
        return width * height, width * height**3 / 12


SectionKind = Annotated[Table | Box | Tube | Solid, Field(discriminator="kind")]


def _linear(value: Any, share: Array) -> Array:
    first, last = value if isinstance(value, tuple) else (value, value)
    # equal ends must not differ by round-off
    return first + share * (last - first)


def _check_wall(section: Box | Tube, *outer: str) -> None:
    ends = np.array([0.0, 1.0])
    wall = _linear(section.wall, ends)
    for name in outer:
        if not (2 * wall < _linear(getattr(section, name), ends)).all():
            raise ValueError(f"wall: expected less than half the {name}")
