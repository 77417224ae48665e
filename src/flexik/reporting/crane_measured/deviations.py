"""What the deviations of a crane as built do: tables, and what they say of the thesis."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from flexik.evaluation.crane_measured.statistics import budget_statistics, worse_shares
from flexik.kinematics.crane import inverse_with_smallest_extension, pose
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning.crane_measured.joint_play import joint_forces
from flexik.reporting.style import MM

# Points of figure 4.20 whose jib arm is beyond the vertical and where compensation made things
# worse (chapter 4.6)
THESIS_POINTS = (2, 3)
# Share of the cranes, %, from which on that holds here too
REPRODUCED = 80.0
COLUMNS = {
    "none": "without",
    "combined": "with",
    "none_reference": "without, from reference",
    "combined_reference": "with, from reference",
}
PERFECT = ", no deviations"
MOVED = "R with a load, from reference (mm)"
NAMES = {
    "pivot": "pins",
    "length": "lengths",
    "play": "joint play",
    "stroke_offset": "stroke offset",
    "repeatability": "repeatability",
    "section": "bending stiffness",
    "spring": "ground spring",
}


def budget_table(budget: pd.DataFrame) -> pd.DataFrame:
    """Mean R in mm over all cranes, points and payloads, by deviation.

    Columns deviation (`none`: measuring and the network alone; `all`, and each alone or so many
    times as large among all), then COLUMNS.
    """
    means = _means(budget)
    labels = []
    for deviation, factor in zip(means["deviation"], means["factor"], strict=True):
        if deviation not in NAMES:
            labels.append(deviation)
        elif factor == 0:
            labels.append(f"{NAMES[deviation]} alone")
        else:
            labels.append(f"all, {NAMES[deviation]} x {factor:g}")
    return pd.DataFrame(
        {"deviation": labels} | {f"{label} (mm)": means[name] for name, label in COLUMNS.items()}
    )


def spread_note(budget: pd.DataFrame) -> str:
    """How much the means of single cranes differ."""
    statistics = budget_statistics(budget)
    statistics = MM * statistics.loc[statistics["deviation"] == "all", list(COLUMNS)]
    parts = [
        f"{label} {statistics[name].mean():.1f} "
        f"({statistics[name].min():.1f} to {statistics[name].max():.1f})"
        for name, label in COLUMNS.items()
    ]
    return (
        f"Mean R of {len(statistics)} cranes whose deviations are drawn with these sizes, and the "
        f"least and largest mean of one of them, mm: {'; '.join(parts)}."
    )


def sensitivity_note(budget: pd.DataFrame, published: float) -> str:
    """Which deviation the mean from the reference with compensation hangs on.

    published : that mean in table 4.3, mm.
    """
    means = _means(budget)
    given = means.loc[means["deviation"] == "all", "combined_reference"].iloc[0]
    larger = means[means["factor"] > 1]
    worst = larger.sort_values("combined_reference").iloc[-1]
    note = (
        f"With compensation, the mean from the reference point is {given:.1f} mm over these cranes "
        f"and {published:.1f} mm in the thesis."
    )
    if worst["combined_reference"] <= 1.01 * given:
        return f"{note} No deviation matters for it."
    return (
        f"{note} Of all deviations {NAMES[worst['deviation']]} matters most for it: "
        f"{worst['factor']:g} times as large, it makes {worst['combined_reference']:.1f} mm."
    )


def point_table(budget: pd.DataFrame, crane: FlexibleCrane) -> pd.DataFrame:
    """What is particular at each point, for the nominal rigid `crane` and over all cranes.

    Columns point (from 1), x and y in m, angle of the jib arm from the vertical in degrees
    (negative: beyond it), force of the jib cylinder in kN by payload (positive: it pulls), mean R
    in mm without and with compensation, the same with compensation and a load from the point of
    reference, and the share of the cranes (%) on which compensation makes the point worse, from the
    target and from the point of reference.
    """
    shares, perfect = worse_shares(budget, "all"), worse_shares(budget, "none")
    points = shares[["target_x", "target_y"]].to_numpy()
    strokes = inverse_with_smallest_extension(crane.geometry, points).strokes
    angle = np.degrees(pose(crane.geometry, strokes).jib_angle) + 90.0
    table = pd.DataFrame(
        {
            "point": np.arange(1, len(points) + 1),
            "x (m)": points[:, 0],
            "y (m)": points[:, 1],
            "jib from vertical (deg)": angle,
        }
    )
    gravity = crane.structure.gravity
    for payload in sorted(budget["payload"].unique()):
        load = np.tile([0.0, -gravity * payload], (len(points), 1))
        force = joint_forces(crane, strokes, load, gravity).joints["jib_cylinder"][:, 0]
        table[f"jib force, {payload:g} kg (kN)"] = 1e-3 * force
    rows = budget[budget["deviation"] == "all"]
    for method in ("none", "combined"):
        of_method = rows[rows["method"] == method]
        error = of_method.groupby(["target_x", "target_y"], sort=False)["error"].mean()
        table[f"R {COLUMNS[method]} (mm)"] = MM * error.to_numpy()
    loaded = rows[(rows["method"] == "combined") & (rows["payload"] > rows["payload"].min())]
    moved = loaded.groupby(["target_x", "target_y"], sort=False)["reference_error"].mean()
    table[MOVED] = MM * moved.to_numpy()
    for name, found in (("", shares), (PERFECT, perfect)):
        table[f"worse with{name} (%)"] = 100 * found["error"]
        table[f"worse with, from reference{name} (%)"] = 100 * found["reference_error"]
    return table


def point_notes(table: pd.DataFrame) -> list[str]:
    """The thesis's remark on its points 2 and 3, checked in a `point_table`."""
    thesis = _points(THESIS_POINTS)
    beyond = _points(table.loc[table["jib from vertical (deg)"] < 0, "point"])
    forces = table.filter(like="jib force")
    pushing = [
        f"{row['point']:g} ({', '.join(label.split(', ')[1][:-5] for label in pushed)})"
        for (_, row), (_, values) in zip(table.iterrows(), forces.iterrows(), strict=True)
        if (pushed := values.index[values < 0].tolist())
    ]
    notes = [
        f"The jib arm is beyond the vertical in {beyond}, in the thesis in {thesis}, where its jib "
        "cylinder pushes instead of pulling. By statics of our nominal crane it pushes in "
        f"{_points(pushing)}; elsewhere the weight lies in front of the jib's pivot."
    ]
    turns = forces.lt(0).any(axis=1) & forces.gt(0).any(axis=1)
    if turns.any() and not turns.all():
        notes.append(
            f"Where the load turns that force, in {_points(table.loc[turns, 'point'])}, play "
            "changes sides: loaded, the compensated tip lies "
            f"{table.loc[turns, MOVED].mean():.1f} mm from the point of reference, elsewhere "
            f"{table.loc[~turns, MOVED].mean():.1f} mm."
        )
    return [*notes, *_worse_notes(table)]


def _worse_notes(table: pd.DataFrame) -> list[str]:
    """Where compensation makes a point worse, and whether deviations are to blame."""
    named = table[table["point"].isin(THESIS_POINTS)]
    thesis = _points(THESIS_POINTS)
    if named.empty:
        return []
    shares = {
        label: "; ".join(
            f"{number:g}: {own:.0f} % and {reference:.0f} %"
            for number, own, reference in zip(
                named["point"],
                named[f"worse with{name} (%)"],
                named[f"worse with, from reference{name} (%)"],
                strict=True,
            )
        )
        for label, name in (("as built", ""), ("perfect", PERFECT))
    }
    columns = ["worse with (%)", "worse with, from reference (%)"]
    reproduced = (named[columns] >= REPRODUCED).all(axis=None)
    note = (
        f"In the thesis compensation makes {thesis} worse, from the target and from the point of "
        "reference. Shares of the cranes on which it does so here, from either: "
        f"{shares['as built']}. The remark is {'' if reproduced else 'not '}reproduced."
    )
    return [
        note,
        "On cranes without deviations, where only measuring and the network's own error are left, "
        f"the shares are {shares['perfect']}.",
    ]


def _points(numbers: Iterable[object]) -> str:
    """`no point`, `point 3`, `points 2 and 3`."""
    texts = [
        f"{number:g}" if isinstance(number, float | int) else str(number) for number in numbers
    ]
    if not texts:
        return "no point"
    if len(texts) == 1:
        return f"point {texts[0]}"
    return f"points {', '.join(texts[:-1])} and {texts[-1]}"


def _means(budget: pd.DataFrame) -> pd.DataFrame:
    """Columns deviation and factor, in their order, then COLUMNS, mean R over the cranes in mm."""
    groups = budget_statistics(budget).groupby(["deviation", "factor"], sort=False)
    return (MM * groups[list(COLUMNS)].mean()).reset_index()
