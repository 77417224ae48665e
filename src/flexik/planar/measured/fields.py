"""Columns of the tables of the measured machine."""

from flexik.datasets.tables import Field
from flexik.machines.planar import PlanarMachine
from flexik.planar.fields import PAYLOAD, QUERY, coordinates

METHODS = ("none", "combined")  # without and with compensation
# Methods adapted by measurements, to right and to wrong expectations
ADAPTED, MISJUDGED = "adapted", "misjudged"

TARGET = ["target_x", "target_y"]
CONDITION = QUERY
MEASURED = ["measured_x", "measured_y"]
_LINE = Field("line", "1", "of the file; of this table, from 1, where there is none", "int64")
_TIP = (
    Field("measured_x", "m", "where the tip came to rest, forward"),
    Field("measured_y", "m", "where the tip came to rest, up"),
)


def values_of(machine: PlanarMachine) -> list[str]:
    """Names of the columns of coordinates."""
    return [field.name for field in coordinates(machine)]


def campaign_fields(machine: PlanarMachine) -> tuple[Field, ...]:
    """A measurement; that of a file may lack targets and methods, or coordinates: NaN, no text."""
    method = Field("method", "1", "none or combined", "string")
    return (_LINE, method, *CONDITION, *coordinates(machine), *_TIP)


def command_fields(machine: PlanarMachine) -> tuple[Field, ...]:
    """A condition, and the coordinates that each method commands."""
    methods = ("none", "nominal", "adapted")
    values = [
        Field(f"{method}_{field.name}", field.unit, f"{field.description}, method {method}")
        for method in methods
        for field in coordinates(machine)
    ]
    status = "of the adapted command, see flexik.kinematics.status"
    return (*CONDITION, *values, Field("status", "1", status, "int64"))


_TWIN = Field("twin", "1", "number of the machine as built, from 0", "int64")
BUDGET = (
    Field("deviation", "1", "the one that differs; all: as given", "string"),
    Field("factor", "1", "of that deviation; 0: it stands alone, as given"),
    _TWIN,
    Field("method", "1", "none or combined", "string"),
    *CONDITION,
    Field("error", "m", "from the target"),
    Field("reference_error", "m", "from the point reached with 0 kg and compensation"),
)
ADAPTATION = (
    _TWIN,
    Field("method", "1", "a method of the nominal machine, adapted or misjudged", "string"),
    Field("n_measurements", "1", "measurements learnt from; 0: not adapted", "int64"),
    *CONDITION,
    Field("error", "m", "distance of the tip from the target"),
)
OFFSETS = (
    Field("offset", "1", "name, see offsets.py", "string"),
    Field("unit", "1", "of the next four", "string"),
    Field("expected", "1", "before measuring, in its unit"),
    Field("expected_deviation", "1", "standard deviation before measuring, in its unit"),
    Field("identified", "1", "after measuring, in its unit"),
    Field("deviation", "1", "standard deviation after measuring, in its unit"),
)
PREDICTIONS = (
    _LINE,
    PAYLOAD,
    *_TIP,
    Field("nominal_error", "m", "distance from the prediction of the nominal machine"),
    Field(
        "adapted_error", "m", "from that of a machine adapted to the other targets; NaN: too few"
    ),
    Field("surprise", "1", "distance from what was expected, in standard deviations"),
    Field("left_out_surprise", "1", "from the adapted machine, in its own standard deviations"),
    Field("used", "1", "1; 0: it stands out and identifies nothing", "int64"),
)
