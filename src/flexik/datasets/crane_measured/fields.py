"""Columns of the tables of the measured crane."""

from flexik.datasets.crane.evaluations import CONDITION_FIELDS
from flexik.datasets.tables import Field

MEASURED_FIELDS = (
    Field("method", "1", "none or combined", "string"),
    *CONDITION_FIELDS[1:7],
    Field("measured_x", "m", "where the tip came to rest, forward of the slew axis"),
    Field("measured_y", "m", "where the tip came to rest, above ground"),
)
ADAPTATION_FIELDS = (
    Field("twin", "1", "number of the crane as built, from 0", "int64"),
    Field("n_measurements", "1", "measurements learnt from; 0: not adapted", "int64"),
    *CONDITION_FIELDS[1:4],
    Field("error", "m", "distance of the tip from the target"),
)
