"""Tables of the elastic arm and the notes below them."""

from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.elastic_arm.gauges import FREE_OF_NOISE
from flexik.evaluation.errors import workspace_statistics
from flexik.learning.size_selection import layer_columns
from flexik.mechanisms.elastic_arm import DEFORMATION
from flexik.reporting import tables
from flexik.reporting.elastic_arm.results import NEAR, Results
from flexik.reporting.style import MM

KNOWS = {
    "gauges": "target, and gauges in the pose to be found",
    "inverse": "target, payload",
    "combined": "target, payload",
}


def layers_name(layers: tuple[int, ...]) -> str:
    """As the paper writes them, 12-40."""
    return "-".join(str(n) for n in layers)


def fit_table(results: Results) -> pd.DataFrame:
    """Networks given gauges: R and tip errors (mm) on training and held-out readings."""
    rows = []
    for name, (training, held_out) in results.fits.items():
        network, published = results.arm.all_networks[name], results.published_r(name)
        rows.append(
            {
                "network": name,
                "hidden": layers_name(results.layers[name]),
                "trainer": network.trainer,
                "gauges": (network.readings or "").replace("_", "-"),
                "R theta_1, training": training.r[0],
                "R theta_2, training": training.r[1],
                "R theta_1, held out": held_out.r[0],
                "R theta_2, held out": held_out.r[1],
                "R theta_1, published": published[0],
                "R theta_2, published": published[1],
                "mean tip error (mm)": MM * held_out.mean_error,
                "max tip error (mm)": MM * held_out.max_error,
            }
        )
    return pd.DataFrame(rows)


def fit_notes(results: Results) -> list[str]:
    """How the published fit and what the paper says of one hidden layer compare."""
    fits, notes = results.fits, []
    for name in results.published["network"]:
        if name not in fits:
            continue
        found, published = fits[name][1].r, results.published_r(name)
        reached = "reached" if (found >= published).all() else "missed"
        notes.append(
            f"Published R {reached} on held-out readings by `{name}`: {found[0]:.6f} and "
            f"{found[1]:.6f} beside {published[0]:.6f} and {published[1]:.6f}, which the paper "
            "gives for the readings it trained with."
        )
    by_depth: dict[bool, list[tuple[float, str]]] = {True: [], False: []}
    for name, (_, held_out) in fits.items():
        network = results.arm.all_networks[name]
        if network.readings == FREE_OF_NOISE and network.trainer == "back_propagation":
            by_depth[len(results.layers[name]) > 1].append((float(held_out.r.min()), name))
    if all(by_depth.values()):
        (deep_r, deep), (flat_r, flat) = max(by_depth[True]), max(by_depth[False])
        notes.append(
            "The paper found one hidden layer far from the target however wide. Here the best of "
            f"one layer by back-propagation, `{flat}`, has R {flat_r:.6f} at least, the best of "
            f"several, `{deep}`, {deep_r:.6f}: "
            + ("more layers are better." if deep_r > flat_r else "more layers are no better.")
        )
    return notes


def positioning_table(results: Results) -> pd.DataFrame:
    """Errors of the methods at the random targets, mm."""
    rows = []
    for label, frame in results.errors.items():
        values = workspace_statistics(frame)
        method = results.arm.methods.get(label)
        rows.append(
            {
                "method": label,
                "knows": KNOWS[method.method] if method else "target",
                "mean (mm)": MM * values["mean_error"],
                "median (mm)": MM * values["median_error"],
                "95 % (mm)": MM * values["p95_error"],
                "max (mm)": MM * values["max_error"],
                "failed": int(values["n_failed"]),
            }
        )
    return pd.DataFrame(rows)


def positioning_notes(results: Results) -> list[str]:
    """What the methods owe to, and lose by, the readings they learnt from."""
    notes = []
    for label, method in results.arm.methods.items():
        frame = results.errors[label]
        near = results.near_payloads(frame)
        if not isinstance(method, parameters.GaugeMethod) or near.all() or not near.any():
            continue
        error = MM * frame["error"].to_numpy()
        held_out = results.fits[method.network][1]
        notes.append(
            f"{label}: {MM * held_out.mean_error:.2f} mm on held-out readings, whose payloads it "
            f"learnt from, {error[near].mean():.2f} mm at the {near.sum()} targets with a payload "
            f"within {NEAR:g} kg of those, {error[~near].mean():.2f} mm at the others."
        )
    none = results.errors["none"]["error"]
    for label in results.arm.methods:
        worse = int((results.errors[label]["error"].to_numpy() > none.to_numpy()).sum())
        if worse:
            notes.append(f"{label}: worse than no compensation at {worse} of {len(none)} targets.")
    return notes


def gauges_table(results: Results) -> pd.DataFrame:
    """Deformation by the gauges minus that of the model, over all readings, mm and mrad."""
    rows = []
    for name in DEFORMATION:
        model = MM * results.readings[name].to_numpy()
        row: dict[str, object] = {
            "variable": name,
            "unit": "mrad" if name.startswith("dphi") else "mm",
            "largest, model": np.abs(model).max(),
        }
        for shown, table in results.shown.items():
            difference = np.abs(MM * table[name].to_numpy() - model)
            row[f"mean difference, {shown.replace('_', '-')}"] = difference.mean()
            row[f"max difference, {shown.replace('_', '-')}"] = difference.max()
        rows.append(row)
    return pd.DataFrame(rows)


def gauges_notes(results: Results) -> list[str]:
    """How far the tip by the equations is from the model's."""
    return [
        f"Tip by equations 44 and 45 from {shown.replace('_', '-')} gauges, from the model's: mean "
        f"{MM * apart.mean():.2f} mm, max {MM * apart.max():.2f} mm."
        for shown in results.shown
        for apart in [results.gauge_difference(shown)]
    ]


def write_tables(results: Results, folder: Path) -> None:
    """Write all tables into `folder`."""
    fit = fit_table(results)
    tables.write_table(
        folder / "fit",
        fit,
        {name: 6 for name in fit.columns if name.startswith("R ")},
        "Networks given gauges: correlation R of network and target, and how far the flexible "
        "model's tip at the network's angles is from its tip in the held-out reading.",
        fit_notes(results),
    )
    tables.write_table(
        folder / "positioning_errors",
        positioning_table(results),
        3,
        f"Positioning errors at {results.arm.workspace.n_targets} random targets and payloads.",
        positioning_notes(results),
    )
    gauges = gauges_table(results)
    tables.write_table(
        folder / "gauges",
        gauges,
        dict.fromkeys(gauges.columns[2:], 4),
        "Deformation by the strain gauges beside that of the model.",
        gauges_notes(results),
    )
    training = results.training.copy()
    training.insert(1, "hidden", [layers_name(results.layers[n]) for n in training["network"]])
    tables.write_table(
        folder / "training",
        training,
        {"training_error": 6, "selection_error": 6},
        "Restarts of every network; errors are root mean squares of normalised outputs.",
    )
    for name, (sizes, chosen) in results.studies.items():
        errors = [c for c in sizes.columns if c.endswith("_error")]
        trainer = results.arm.selected_networks[name].select.trainer
        tables.write_table(
            folder / "size_selection" / name,
            sizes.astype(dict.fromkeys([*layer_columns(sizes), "n_failed"], int)),
            dict.fromkeys(errors, 6),
            f"Search of `{name}`, trained by `{trainer}`; the selection error chooses "
            f"{layers_name(chosen)}.",
            size_notes(sizes, chosen),
        )


def size_notes(sizes: pd.DataFrame, chosen: tuple[int, ...]) -> list[str]:
    """Layers in which the choice lies on the border of the search."""
    largest = sizes[layer_columns(sizes)].max().tolist()
    notes = []
    for number, (n, most) in enumerate(zip(chosen, largest, strict=True), start=1):
        if n == most:
            notes.append(f"Layer {number}: the choice is the largest that was tried.")
    return notes
