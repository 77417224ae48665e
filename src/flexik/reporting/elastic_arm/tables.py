"""Tables of the elastic arm and the notes below them."""

import itertools
from pathlib import Path

import numpy as np
import pandas as pd

from flexik import parameters
from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.gauges import FREE_OF_NOISE
from flexik.datasets.elastic_arm.learning import KINDS
from flexik.datasets.elastic_arm.readings import TRAINING, gauges_of
from flexik.evaluation.errors import workspace_statistics
from flexik.learning.size_selection import layer_columns
from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.reporting import tables
from flexik.reporting.elastic_arm.results import NEAR, Results
from flexik.reporting.elastic_arm.sensitivity import sensitivity_table
from flexik.reporting.style import MM

IN_THE_POSE = " in the pose to be found"
# What a method knows, by the kind of its network
KNOWS = {
    "gauges": f"target, gauges{IN_THE_POSE}",
    "gauges_without_dx": f"target, gauges but dx{IN_THE_POSE}",
    "gauges_elbow": f"target, elbow, gauges{IN_THE_POSE}",
    "inverse": "target, payload, elbow",
    "deflection": "target, payload",
}


def layers_name(layers: tuple[int, ...]) -> str:
    """As the paper writes them, 12-40."""
    return "-".join(str(n) for n in layers)


def fit_table(results: Results) -> pd.DataFrame:
    """Networks given gauges: R and tip errors (mm) on training and held-out readings."""
    rows = []
    for name, (training, held_out) in results.fits.items():
        network, published = results.arm.all_networks[name], results.published_r(name)
        at_targets = results.target_r(name)
        rows.append(
            {
                "network": name,
                "hidden": layers_name(results.layers[name]),
                "trainer": network.trainer,
                "gauges": shown_name(network),
                "R theta_1, training": training.r[0],
                "R theta_2, training": training.r[1],
                "R theta_1, held out": held_out.r[0],
                "R theta_2, held out": held_out.r[1],
                "R theta_1, targets": at_targets[0],
                "R theta_2, targets": at_targets[1],
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
        if np.isfinite(at_targets := results.target_r(name)).all():
            notes.append(
                f"R at the random targets by `{name}`: {at_targets[0]:.6f} and {at_targets[1]:.6f}."
            )
    return [*notes, *_depth_notes(results)]


def _depth_notes(results: Results) -> list[str]:
    """What one and several hidden layers reach by the published trainer and inputs."""
    like = results.arm.networks[results.arm.splits.network]
    by_depth: dict[bool, list[str]] = {True: [], False: []}
    for name in results.fits:
        network = results.arm.all_networks[name]
        if (network.kind, network.readings, network.trainer) == (
            *(like.kind, like.readings, like.trainer),
        ):
            by_depth[len(results.layers[name]) > 1].append(name)
    if not all(by_depth.values()):
        return []
    held_out = {name: fit for name, (_, fit) in results.fits.items()}
    texts = []
    for deep, text in ((False, "one layer"), (True, "several")):
        by_r = max(by_depth[deep], key=lambda name: float(held_out[name].r.min()))
        by_tip = min(by_depth[deep], key=lambda name: held_out[name].mean_error)
        texts.append(
            f"of {text} `{by_r}` has the highest lesser R, {held_out[by_r].r.min():.6f}, and "
            f"`{by_tip}` the least mean tip error, {MM * held_out[by_tip].mean_error:.2f} mm"
        )
    return [
        "The paper found one hidden layer far from the target however wide. Here, by "
        f"`{like.trainer}` on held-out readings, {'; '.join(texts)}."
    ]


def splits_table(results: Results) -> pd.DataFrame:
    """R of one network on the held-out readings of every division."""
    published = results.published_r(results.arm.splits.network)
    table = results.all_splits()
    median = table.drop(columns="seed").median()
    spread = table.drop(columns="seed").max() - table.drop(columns="seed").min()
    rows = [
        ("main" if k == 0 else "other", str(row["seed"]), row["r_theta_1"], row["r_theta_2"])
        for k, row in enumerate(table.to_dict("records"))
    ]
    rows += [
        (name, "", values[0], values[1])
        for name, values in (
            ("median", median.to_numpy()),
            ("largest - least", spread.to_numpy()),
            ("published", published),
        )
    ]
    return pd.DataFrame(rows, columns=["division", "seed", "R theta_1", "R theta_2"])


def splits_notes(results: Results) -> list[str]:
    """In how many divisions the published R is reached, and by the main one and the median."""
    name = results.arm.splits.network
    published, table = results.published_r(name), results.all_splits()
    if not np.isfinite(published).all():
        return []
    notes = []
    for k, angle in enumerate(("theta_1", "theta_2")):
        r = table[f"r_{angle}"].to_numpy()
        words = ["reached" if value >= published[k] else "missed" for value in (r[0], np.median(r))]
        notes.append(
            f"Published R of {angle}, {published[k]:.6f}: {words[0]} by the main division, which "
            f"counts ({r[0]:.6f}), {words[1]} by the median of all {len(r)} ({np.median(r):.6f}), "
            f"reached in {int((r >= published[k]).sum())} of {len(r)}."
        )
    return notes


def shown_name(network: parameters.ArmNetwork | parameters.SelectedArmNetwork) -> str:
    """Which gauges, and which of their inputs, a network is given."""
    extra = {"gauges_without_dx": ", without dx", "gauges_elbow": ", and elbow"}
    return (network.readings or "").replace("_", "-") + extra.get(network.kind, "")


def positioning_table(results: Results) -> pd.DataFrame:
    """Errors of the methods at the random targets, mm."""
    rows = []
    for label, frame in results.errors.items():
        values = workspace_statistics(frame)
        method = results.arm.methods.get(label)
        network = results.arm.all_networks[method.network] if method else None
        rows.append(
            {
                "method": label,
                "knows": KNOWS[network.kind] if network else "target",
                "gauges": (network.readings or "").replace("_", "-") if network else "",
                "hidden": layers_name(results.layers[method.network]) if method else "",
                "trainer": network.trainer if network else "",
                "mean (mm)": MM * values["mean_error"],
                "median (mm)": MM * values["median_error"],
                "95 % (mm)": MM * values["p95_error"],
                "max (mm)": MM * values["max_error"],
                "failed": int(values["n_failed"]),
                "clipped": int((frame["n_clipped"] > 0).sum()),
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
    told = MM * results.payload_error.groupby("method", sort=False)["error"].mean()
    for by, error_told in told.items():
        exact = MM * results.errors[str(by)]["error"].mean()
        notes.append(
            f"{by}: told {results.arm.workspace.payload_error:g} kg more than there is, mean "
            f"{error_told:.3f} mm in place of {exact:.3f} mm."
        )
    clipped = [label for label, f in results.errors.items() if (f["n_clipped"] > 0).any()]
    if clipped:
        notes.append("clipped: targets at which the network asked for an angle beyond its limits.")
    none = results.errors["none"]["error"]
    for label in results.arm.methods:
        worse = int((results.errors[label]["error"].to_numpy() > none.to_numpy()).sum())
        if worse:
            notes.append(f"{label}: worse than no compensation at {worse} of {len(none)} targets.")
    return notes


def gauges_table(results: Results) -> pd.DataFrame:
    """Deformation by the gauges minus that of the model, over all readings, mm and mrad."""
    rows = []
    spread = MM * gauges.uncertainty(gauges_of(results.arm))
    for name, uncertain in zip(DEFORMATION, spread, strict=True):
        model = MM * results.readings[name].to_numpy()
        row: dict[str, object] = {
            "variable": name,
            "unit": "mrad" if name.startswith("dphi") else "mm",
            "largest, model": np.abs(model).max(),
            "largest, gauges": np.abs(MM * results.shown[FREE_OF_NOISE][name].to_numpy()).max(),
            "standard uncertainty, noisy": uncertain,
        }
        for shown in (FREE_OF_NOISE, gauges.NOISY):
            table = results.shown[shown]
            difference = np.abs(MM * table[name].to_numpy() - model)
            row[f"mean difference, {shown.replace('_', '-')}"] = difference.mean()
            row[f"max difference, {shown.replace('_', '-')}"] = difference.max()
        rows.append(row)
    return pd.DataFrame(rows)


def gauges_notes(results: Results) -> list[str]:
    """How far the tip by the equations is from the model's, and what the range clips."""
    voltages = [f.name for f in gauges.FIELDS if f.name.startswith("voltage")]
    exact = results.shown[FREE_OF_NOISE][voltages].to_numpy()
    low, high = results.arm.gauges.voltage_range
    clipped = gauges.n_clipped(gauges_of(results.arm), exact)
    return [
        f"Voltages of the calibration lines lie between {exact.min():.2f} and {exact.max():.2f} V; "
        f"the range of {low:g} to {high:g} V clips {clipped} of {len(exact)} readings.",
        *_tip_notes(results),
    ]


def _tip_notes(results: Results) -> list[str]:
    return [
        f"Tip by equations 44 and 45 from {shown.replace('_', '-')} gauges, from the model's: mean "
        f"{MM * apart.mean():.2f} mm, max {MM * apart.max():.2f} mm."
        for shown in (FREE_OF_NOISE, gauges.NOISY)
        for apart in [results.gauge_difference(shown)]
    ]


def write_tables(results: Results, folder: Path) -> None:
    """Write all tables into `folder`."""
    fit = fit_table(results)
    tables.write_table(
        folder / "fit",
        fit,
        {name: 6 if "published" in name else 8 for name in fit.columns if name.startswith("R ")},
        "Networks given gauges: correlation R of network and target, and how far the flexible "
        "model's tip at the network's angles is from its tip in the held-out reading.",
        fit_notes(results),
    )
    tables.write_table(
        folder / "splits",
        splits_table(results),
        6,
        f"R of `{results.arm.splits.network}` on held-out readings by the seed of the division.",
        splits_notes(results),
    )
    tables.write_table(
        folder / "sensitivity",
        sensitivity_table(results),
        3,
        "Mean tip error (mm) in the held-out readings when one input is off by the standard "
        "uncertainty of the gauges with noise (micrometres, microradians).",
    )
    tables.write_table(
        folder / "positioning_errors",
        positioning_table(results),
        3,
        f"Positioning errors at {results.arm.workspace.n_targets} random targets and payloads.",
        positioning_notes(results),
    )
    by_gauges = gauges_table(results)
    tables.write_table(
        folder / "gauges",
        by_gauges,
        dict.fromkeys(by_gauges.columns[2:], 5),
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
    for name, study in results.studies.items():
        sizes, chosen = study.sizes, study.chosen
        errors = [c for c in sizes.columns if c.endswith("_error")]
        trainer = results.arm.selected_networks[name].select.trainer
        tables.write_table(
            folder / "size_selection" / name,
            sizes.astype(dict.fromkeys([*layer_columns(sizes), "n_failed"], int)),
            dict.fromkeys(errors, 6),
            f"Search of `{name}`, trained by `{trainer}`; of the sizes within "
            f"{100 * results.arm.selected_networks[name].select.tolerance:g} % of the least "
            f"selection error the smallest is chosen, {layers_name(chosen)}.",
            [*size_notes(sizes, chosen), *weights_notes(results, name)],
        )


def size_notes(sizes: pd.DataFrame, chosen: tuple[int, ...]) -> list[str]:
    """Layers in which the choice lies on the border of the search."""
    largest = sizes[layer_columns(sizes)].max().tolist()
    notes = []
    for number, (n, most) in enumerate(zip(chosen, largest, strict=True), start=1):
        if n == most:
            notes.append(f"Layer {number}: the choice is the largest that was tried.")
    return notes


def weights_notes(results: Results, name: str) -> list[str]:
    """How many runs the goal ended, and how near the choice is to more weights than numbers."""
    study, network = results.studies[name], results.arm.all_networks[name]
    kind = KINDS[network.kind]
    layers = (len(kind.inputs), *study.chosen, len(kind.outputs))
    n_weights = sum((a + 1) * b for a, b in itertools.pairwise(layers))
    n_numbers = int((results.readings["part"] == TRAINING).sum()) * len(kind.outputs)
    return [
        f"{study.n_goal} of {study.n_runs} runs stopped at the trainer's goal.",
        f"The choice has {n_weights} weights; training accepts {n_numbers} at most, as many as "
        "numbers to fit.",
    ]
