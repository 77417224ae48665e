"""Tables and a figure of planar.learning_curves, and the table of planar.physics."""

import numpy as np
import pandas as pd

from flexik.reporting import chart as charts
from flexik.reporting import style
from flexik.reporting.chart import Axis, Layer
from flexik.reporting.report import Drawing, draw
from flexik.reporting.style import MM
from flexik.reporting.tables import Table, mm
from flexik.reporting.tables import table as table_of

KEYS = ["network", "design", "n_samples", "n_levels"]
TITLES = {"random": "random samples", "levels": "poses of the grid, fewer payloads"}


def table(curves: pd.DataFrame) -> Table:
    """A row for each network and set that it learnt from; errors in mm."""
    inside = curves[curves["payload"].isna()].set_index(KEYS)
    names = {"mean_error": "mean (mm)", "p99_error": "99 % (mm)", "max_error": "max (mm)"}
    found = MM * inside[list(names)].rename(columns=names)
    for payload, rows in curves[curves["payload"].notna()].groupby("payload"):
        found[f"mean at {payload:g} kg (mm)"] = MM * rows.set_index(KEYS)["mean_error"]
    frame = found.reset_index().rename(
        columns={"design": "learnt from", "n_samples": "samples", "n_levels": "payloads"}
    )
    frame["learnt from"] = frame["learnt from"].map(TITLES)
    frame["payloads"] = [str(n) if n else "random" for n in frame["payloads"]]
    return Table(frame, dict.fromkeys(found.columns, 4))


PHYSICS = {
    "variant": "variant",
    "constants": "constants",
    "what": "what",
    "mean (mm)": mm("mean_error", 3),
    "99 % (mm)": mm("p99_error", 3),
    "max (mm)": mm("max_error", 3),
    "failed": "n_failed",
}
COMMANDS = {"nominal": "{} commands the variant", "variant": "{}, theory of the variant"}


def physics_table(physics: pd.DataFrame) -> Table:
    """A row for what each variant moves, and for each method's errors with it; in mm."""
    what = [
        subject if subject == "tip" else COMMANDS[theory].format(subject)
        for subject, theory in zip(physics["subject"], physics["theory"], strict=True)
    ]
    return table_of(physics.assign(what=what), PHYSICS)


def figure(curves: pd.DataFrame) -> Drawing:
    """Mean error against the number of samples, a panel a design."""
    inside = curves[curves["payload"].isna() & np.isfinite(curves["mean_error"])]
    return draw(
        charts.chart,
        Layer(inside, "n_samples", "mean_error", "o-", "network"),
        x=Axis("samples (1)", log=True),
        y=Axis("mean error of the predicted tip (mm)", MM, log=True),
        panel="design",
        titles=TITLES,
        looks=style.looks(curves["network"].unique()),
        height=5.0,
    )
