"""Positioning errors on disk: every condition of every method."""

from pathlib import Path

import pandas as pd

from flexik.datasets.tables import Field, read_table, stored_fields, write_table

CONDITION_FIELDS = (
    Field("point", "1", "number of the test point, from 0", "int64"),
    Field("target_x", "m", "target, forward of the slew axis"),
    Field("target_y", "m", "target, above ground"),
    Field("payload", "kg", "point mass at the tip"),
    Field("lift_stroke", "m", "commanded stroke of the lift cylinder"),
    Field("jib_stroke", "m", "commanded stroke of the jib cylinder"),
    Field("extension_stroke", "m", "commanded stroke of the extension cylinder"),
    Field("achieved_x", "m", "tip of the flexible model at the commanded strokes"),
    Field("achieved_y", "m", "tip of the flexible model at the commanded strokes"),
    Field("error_x", "m", "desired minus achieved"),
    Field("error_y", "m", "desired minus achieved"),
    Field("error", "m", "length of the error"),
    Field("status", "1", "0 reached, else see flexik.positioning.method", "int64"),
)
TARGET_FIELDS = CONDITION_FIELDS[1:4] + tuple(
    Field(name, "m", "puts the loaded tip on the target")
    for name in ("lift_stroke", "jib_stroke", "extension_stroke")
)
TOLERANCE_FIELDS = (
    Field("method", "1", "name of the method", "string"),
    Field("tolerance", "1", "half the sum of squared normalised errors at which a search ends"),
    Field("mean_error", "m", "over all test conditions"),
    Field("max_error", "m", "over all test conditions"),
    Field("mean_iterations", "1", "of the search"),
    Field("max_iterations", "1", "of the search", "int64"),
    Field("n_failed", "1", "searches that ended above their tolerance", "int64"),
)


def write_evaluation(path: Path | str, frame: pd.DataFrame, parameters_checksum: str) -> None:
    """Write `frame` of evaluation.errors.evaluate; a method's diagnostics follow the errors.

    Whole numbers among the diagnostics are counts, the others lengths in m.
    """
    known = {field.name for field in CONDITION_FIELDS}
    diagnostics = [
        Field(name, "1", f"{name} of the method", "int64")
        if frame[name].dtype.kind == "i"
        else Field(name, "m", f"{name} of the method")
        for name in frame.columns
        if name not in known
    ]
    fields = [*CONDITION_FIELDS, *diagnostics]
    columns = {field.name: frame[field.name].to_numpy() for field in fields}
    write_table(path, columns, fields, parameters_checksum)


def read_evaluation(path: Path | str, parameters_checksum: str) -> pd.DataFrame:
    """Read back what `write_evaluation` wrote; raises DataError as read_table does."""
    known = {field.name for field in CONDITION_FIELDS}
    diagnostics = [field for field in stored_fields(path) if field.name not in known]
    return read_table(path, [*CONDITION_FIELDS, *diagnostics], parameters_checksum)
