"""Columns of the tables of the measured crane."""

from flexik.cases.crane.parts import fields
from flexik.datasets.tables import Field
from flexik.planar.fields import QUERY

METHODS = ("none", "combined")  # without and with compensation
# Methods adapted by measurements, to right and to wrong expectations
ADAPTED, MISJUDGED = "adapted", "misjudged"

TARGET = ["target_x", "target_y"]
STROKES = list(fields.STROKES)
CONDITION, STROKE = QUERY, fields.STROKE_FIELDS
MEASURED = ["measured_x", "measured_y"]

# A campaign of one's own may lack targets and methods, or strokes: NaN and no text
CAMPAIGN = (
    Field("line", "1", "of the file; of this table, from 1, where there is none", "int64"),
    Field("method", "1", "none or combined", "string"),
    *CONDITION,
    *STROKE,
    Field("measured_x", "m", "where the tip came to rest, forward of the slew axis"),
    Field("measured_y", "m", "where the tip came to rest, above ground"),
)
_TWIN = Field("twin", "1", "number of the crane as built, from 0", "int64")
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
    Field("method", "1", "a method of the nominal crane, adapted or misjudged", "string"),
    Field("n_measurements", "1", "measurements learnt from; 0: not adapted", "int64"),
    *CONDITION,
    Field("error", "m", "distance of the tip from the target"),
)
OFFSETS = (
    Field("offset", "1", "name, see adapted.py", "string"),
    Field("unit", "1", "of the next four", "string"),
    Field("expected", "1", "before measuring, in its unit"),
    Field("expected_deviation", "1", "standard deviation before measuring, in its unit"),
    Field("identified", "1", "after measuring, in its unit"),
    Field("deviation", "1", "standard deviation after measuring, in its unit"),
)
PREDICTIONS = (
    *(field for field in CAMPAIGN if field.name in ("line", "payload", *MEASURED)),
    Field("nominal_error", "m", "distance from the prediction of the nominal crane"),
    Field("adapted_error", "m", "from that of a crane adapted to the other targets; NaN: too few"),
    Field("surprise", "1", "distance from what was expected, in standard deviations"),
    Field("left_out_surprise", "1", "from the adapted crane, in its own standard deviations"),
    Field("used", "1", "1; 0: it stands out and identifies nothing", "int64"),
)
COMMANDS = (
    *CONDITION,
    *(
        Field(f"{method}_{stroke.name}", "m", f"{stroke.description}, method {method}")
        for method in ("none", "nominal", "adapted")
        for stroke in STROKE
    ),
    Field("status", "1", "of the adapted command, see flexik.kinematics.status", "int64"),
)
