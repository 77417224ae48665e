"""The report of the elastic arm: tables, metrics, and what the sentences of its page hold."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.gauges import FREE_OF_NOISE, NOISY
from flexik.cases.elastic_arm.parts.kinds import KINDS
from flexik.cases.elastic_arm.parts.readings import ANGLES, TRAINING
from flexik.cases.elastic_arm.report_figures import figures, shown_networks
from flexik.cases.elastic_arm.report_results import DATA, NEAR, PUBLISHED, R, Results, read
from flexik.cases.elastic_arm.section import Section
from flexik.evaluation.errors import workspace_statistics
from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.reporting.report import Content, made_from, write_report
from flexik.reporting.style import MICRO, MM
from flexik.reporting.tables import Column, Table, mm, table

REPORT = Path("reports/elastic_arm")
# Statistics of random targets that are metrics
STATISTICS = ("mean_error", "median_error", "p95_error", "max_error")
NOTHING = "nothing"
EXTRA = {"gauges_without_dx": ", without dx", "gauges_elbow": ", and elbow"}


def report(section: Section) -> None:
    """Write reports/elastic_arm from data/elastic_arm."""
    results = read(section)
    write_report(
        REPORT,
        Path(__file__).with_name("page.md.j2"),
        Content(
            tables=tables(results),
            figures=figures(results),
            metrics=metrics(results),
            values=values(results),
        ),
        sources=made_from(section, [PUBLISHED]),
        record=DATA / "report.json",
    )


def metrics(results: Results) -> dict[str, float | None]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    found: dict[str, float | None] = {}
    for name, fit in results.fits.iterrows():
        for k, (r, at_targets) in enumerate(zip(R, results.target_r(str(name)), strict=True), 1):
            found[f"{name}.r_theta{k}"] = round(fit[r], 6)
            found[f"{name}.training_r_theta{k}"] = round(fit[f"training_{r}"], 6)
            if np.isfinite(at_targets):
                found[f"{name}.targets_r_theta{k}"] = round(at_targets, 6)
        for which in ("mean", "max"):
            found[f"{name}.held_out_{which}_error_mm"] = round(MM * fit[f"{which}_error"], 4)
    for label, frame in results.errors.items():
        statistics = workspace_statistics(frame)
        found |= {f"{label}.{s}_mm": round(MM * statistics[s], 4) for s in STATISTICS}
        found[f"{label}.n_failed"] = int(statistics["n_failed"])
    for label, restarts in results.restarts.items():
        for which in ("mean_error", "max_error"):
            found[f"{label}.worst_restart_{which}_mm"] = round(MM * restarts[which].max(), 4)
    for _, told in chosen(results.payload_error).iterrows():
        found[f"{told['method']}.payload_off_mean_error_mm"] = round(MM * told["mean_error"], 4)
    off = sensitivity_of(results, results.main)
    for changed, error in off.drop(NOTHING).items():
        found[f"{results.main}.{changed}_off_mean_error_mm"] = round(MM * error, 4)
    splits = results.all_splits()
    for k, r in enumerate(R, start=1):
        found[f"splits.median_r_theta{k}"] = round(splits[r].median(), 6)
        found[f"splits.least_r_theta{k}"] = round(splits[r].min(), 6)
    for name, study in results.studies.items():
        found |= {f"select.{name}.n_hidden_{k}": n for k, n in enumerate(study.chosen, start=1)}
    parts = results.readings["part"].value_counts().sort_index()
    return found | {f"readings.n_{part}": int(n) for part, n in parts.items()}


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    training = results.training.copy()
    training.insert(1, "hidden", [results.hidden(name) for name in training["network"]])
    return {
        "sensitivity": sensitivity_table(results),
        "positioning_errors": positioning_table(results),
        "fit": fit_table(results),
        "splits": splits_table(results),
        "gauges": gauges_table(results),
        "training": Table(training, {"training_error": 6, "selection_error": 6}),
        **{f"size_selection/{name}": size_table(results, name) for name in results.studies},
    }


def chosen(frame: pd.DataFrame) -> pd.DataFrame:
    """Rows of the restarts that were chosen."""
    return frame[frame["chosen"] == 1]


def by_restart(values: pd.Series, decimals: int) -> str:
    """Millimetres of the restarts of a network, in their order."""
    return ", ".join(f"{MM * value:.{decimals}f}" for value in values)


def fit_table(results: Results) -> Table:
    """Networks given gauges: R and tip errors (mm) on training and held-out readings."""
    rows = []
    for name, fit in results.fits.iterrows():
        network = results.section.networks[str(name)]
        restarts = results.fit_restarts[results.fit_restarts["network"] == name]
        row = {
            "network": name,
            "hidden": results.hidden(str(name)),
            "trainer": network.trainer,
            "gauges": network.readings.replace("_", "-") + EXTRA.get(str(network.learns), ""),
        }
        for of, r in (
            ("training", fit[[f"training_{r}" for r in R]].to_numpy()),
            ("held out", fit[R].to_numpy()),
            ("targets", results.target_r(str(name))),
            ("published", results.published_r(str(name))),
        ):
            row |= {f"R {a}, {of}": value for a, value in zip(ANGLES, r, strict=True)}
        row["mean tip error (mm)"] = MM * fit["mean_error"]
        row["max tip error (mm)"] = MM * fit["max_error"]
        row["mean tip error by restart (mm)"] = by_restart(restarts["mean_error"], 2)
        rows.append(row)
    frame = pd.DataFrame(rows)
    r_columns = [name for name in frame if name.startswith("R ")]
    return Table(frame, {name: 6 if "published" in name else 8 for name in r_columns})


def splits_table(results: Results) -> Table:
    """R of one network on the held-out readings of every division."""
    frame = results.all_splits()
    rows = [
        ("main" if k == 0 else "other", str(int(row["seed"])), *(row[r] for r in R))
        for k, row in enumerate(frame.to_dict("records"))
    ]
    of_all = frame[R]
    rows += [
        (name, "", *found)
        for name, found in (
            ("median", of_all.median()),
            ("largest - least", of_all.max() - of_all.min()),
            ("published", results.published_r(results.main)),
        )
    ]
    return Table(pd.DataFrame(rows, columns=["division", "seed", "R theta_1", "R theta_2"]), 6)


def sensitivity_of(results: Results, name: str) -> pd.Series:
    """Mean tip error in m of a network by the input that is off."""
    rows = chosen(results.sensitivity)
    return rows[rows["network"] == name].set_index("input")["mean_error"]


def sensitivity_table(results: Results) -> Table:
    """Mean tip errors in mm by input and network, and by how much the input is off."""
    rows = chosen(results.sensitivity)
    off = rows.groupby("input", sort=False)["change"].first()
    frame = pd.DataFrame({"off by (um, urad)": MICRO * off})
    for name in dict.fromkeys(rows["network"]):
        frame[name] = MM * sensitivity_of(results, name)
    return Table(frame.rename_axis("input that is off").reset_index(), 3)


def knows(learns: str) -> str:
    """What a method knows, by what its network learnt."""
    pose = " in the pose to be found"
    return {
        "gauges": f"target, gauges{pose}",
        "gauges_without_dx": f"target, gauges but dx{pose}",
        "gauges_elbow": f"target, elbow, gauges{pose}",
        "coordinates": "target, payload, elbow",
    }.get(learns, "target, payload")


def positioning_table(results: Results) -> Table:
    """Errors of the methods at the random targets, mm."""
    rows = []
    for label, frame in results.errors.items():
        method = results.section.methods[label]
        network = results.section.networks[method.network] if method.network else None
        told = network.readings.replace("_", "-") if network and network.has_gauges else ""
        row = {
            "method": label,
            "knows": knows(str(network.learns)) if network else "target",
            "gauges": told,
            "hidden": results.hidden(method.network) if method.network else "",
            "trainer": network.trainer if network else "",
            **workspace_statistics(frame),
            "clipped": int((frame["n_clipped"] > 0).sum()),
        }
        for which in ("mean_error", "max_error"):
            spread = results.restarts.get(label)
            row[f"{which}s"] = "" if spread is None else by_restart(spread[which], 3)
        rows.append(row)
    texts = ("method", "knows", "gauges", "hidden", "trainer")
    return table(
        rows,
        {
            **{name: name for name in texts},
            "mean (mm)": mm("mean_error", 3),
            "median (mm)": mm("median_error", 3),
            "95 % (mm)": mm("p95_error", 3),
            "max (mm)": mm("max_error", 3),
            "failed": Column("n_failed"),
            "clipped": Column("clipped"),
            "mean by restart (mm)": "mean_errors",
            "max by restart (mm)": "max_errors",
        },
    )


def gauges_table(results: Results) -> Table:
    """Deformation by the gauges minus that of the model, over all readings, mm and mrad."""
    uncertain = gauges.uncertainty(gauges.gauges_of(results.section.machine))
    rows = []
    for name, spread in zip(DEFORMATION, uncertain, strict=True):
        model = MM * results.readings[name].to_numpy()
        row: dict[str, Any] = {
            "variable": name,
            "unit": "mrad" if name.startswith("dphi") else "mm",
            "largest, model": np.abs(model).max(),
            "largest, gauges": np.abs(MM * results.shown[FREE_OF_NOISE][name]).max(),
            "standard uncertainty, noisy": MM * spread,
        }
        for shown in (FREE_OF_NOISE, NOISY):
            difference = np.abs(MM * results.shown[shown][name].to_numpy() - model)
            row[f"mean difference, {shown.replace('_', '-')}"] = difference.mean()
            row[f"max difference, {shown.replace('_', '-')}"] = difference.max()
        rows.append(row)
    frame = pd.DataFrame(rows)
    return Table(frame, dict.fromkeys(frame.columns[2:], 5))


def size_table(results: Results, name: str) -> Table:
    """Errors of every size of a study."""
    sizes = results.studies[name].sizes
    counts = [c for c in sizes if str(c).startswith(("n_", "best_"))]
    errors = [c for c in sizes if str(c).endswith("_error")]
    return Table(sizes.astype(dict.fromkeys(counts, int)), dict.fromkeys(errors, 6))


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page hold."""
    section, exact = results.section, results.shown[FREE_OF_NOISE]
    voltages = exact[[f.name for f in gauges.FIELDS if f.name.startswith("voltage")]].to_numpy()
    return {
        "section": section,
        "given": section.machine.gauges,
        "counts": results.counts,
        "conditions": next(iter(section.conditions.values())),
        "n_of_part": results.readings["part"].value_counts().to_dict(),
        "border": results.on_border(),
        "main": results.main,
        "largest_dx": [exact[f"dx_{link}"].abs().max() for link in (1, 2)],
        "largest_strain": [exact[f"strain_{link}"].abs().max() for link in (1, 2)],
        "largest_dy": results.readings[["dy_1", "dy_2"]].abs().to_numpy().max(),
        "voltages": [voltages.min(), voltages.max()],
        "n_clipped": gauges.n_clipped(gauges.gauges_of(section.machine), voltages),
        "gauge_tip": {
            shown.replace("_", "-"): results.gauge_difference(shown)
            for shown in (FREE_OF_NOISE, NOISY)
        },
        "fits": results.fits.to_dict("index"),
        "hidden": {name: results.hidden(name) for name in section.networks},
        "like": alike(results, ("trainer",)),
        "near": NEAR,
        "shown_networks": shown_networks(results),
        "trainers": {
            name: trainer
            for name, trainer in section.trainers.items()
            if any(network.trainer == name for network in section.networks.values())
        },
        "sizes": {name: size_values(results, name) for name in results.studies},
        **sensitivity_values(results),
        **published_values(results),
        **positioning_values(results),
    }


def alike(results: Results, keys: tuple[str, ...]) -> list[str]:
    """Networks given gauges of the layers and the settings `keys` of the published one."""
    like = results.section.networks[results.main]
    return [
        name
        for name, network in results.section.gauge_networks.items()
        if results.layers[name] == results.layers[results.main]
        and all(getattr(network, key) == getattr(like, key) for key in keys)
    ]


def sensitivity_values(results: Results) -> dict[str, Any]:
    """The input that the published network depends on most, and which noise costs it more."""
    off = sensitivity_of(results, results.main)
    worst = str(off.drop(NOTHING).idxmax())
    rows = results.sensitivity
    rows = rows[(rows["network"] == results.main) & (rows["input"] == worst)]
    by_noise = {
        results.section.networks[name].readings: results.fits.loc[name, "mean_error"]
        for name in reversed(alike(results, ("trainer", "learns")))
    }
    costs = None
    if set(by_noise) == set(gauges.SHOWN):
        free, noisy, voltages = (by_noise[shown] for shown in gauges.SHOWN)
        costs = {"voltages": voltages - free, "strains": noisy - voltages}
    return {
        "worst_input": worst,
        "worst_change": rows["change"].iloc[0],
        "worst_errors": rows["mean_error"].tolist(),
        "off": off.to_dict(),
        "noise_costs": costs,
    }


def published_values(results: Results) -> dict[str, Any]:
    """Ours beside the published R: in the main division, all divisions, one and several layers."""
    published = {
        str(name): {
            "published": results.published_r(str(name)),
            "targets": results.target_r(str(name)),
            "restarts": results.fit_restarts.loc[results.fit_restarts["network"] == name, R],
        }
        for name in results.published.index.intersection(results.fits.index)
    }
    splits = results.all_splits()
    divisions = [
        {
            "angle": angle,
            "published": theirs,
            "main": splits[r].iloc[0],
            "median": splits[r].median(),
            "n_reached": int((splits[r] >= theirs).sum()),
            "n": len(splits),
        }
        for angle, r, theirs in zip(ANGLES, R, results.published_r(results.main), strict=True)
        if np.isfinite(theirs)
    ]
    like = results.section.networks[results.main]
    depths: dict[str, pd.DataFrame] = {}
    for name, network in results.section.gauge_networks.items():
        if all(getattr(network, k) == getattr(like, k) for k in ("learns", "readings", "trainer")):
            depth = "several" if len(results.layers[name]) > 1 else "one layer"
            depths[depth] = pd.concat([depths.get(depth), results.fits.loc[[name]]])
    return {
        "published": published,
        "divisions": divisions,
        "depths": {
            depth: {
                "by_r": (rows[R].min(axis=1).idxmax(), rows[R].min(axis=1).max()),
                "by_tip": (rows["mean_error"].idxmin(), rows["mean_error"].min()),
            }
            for depth, rows in sorted(depths.items())
        },
    }


def positioning_values(results: Results) -> dict[str, Any]:
    """What the methods owe to, and lose by, the readings they learnt from."""
    near = {}
    for label, method in results.section.methods.items():
        frame = results.errors[label]
        rows = results.near_payloads(frame)
        if method.method == "gauges" and rows.any() and not rows.all():
            error = frame["error"]
            near[label] = {
                "held_out": results.fits.loc[method.network, "mean_error"],
                "n": int(rows.sum()),
                "near": error[rows].mean(),
                "far": error[~rows].mean(),
            }
    (none,) = (label for label, m in results.section.methods.items() if m.method == "none")
    uncompensated = results.errors[none]["error"]
    told = chosen(results.payload_error).set_index("method")["mean_error"]
    return {
        "near_payloads": near,
        "told": {
            label: {"wrong": wrong, "right": results.errors[str(label)]["error"].mean()}
            for label, wrong in told.items()
        },
        "any_clipped": any((frame["n_clipped"] > 0).any() for frame in results.errors.values()),
        "n_worse": {
            label: int((frame["error"] > uncompensated).sum())
            for label, frame in results.errors.items()
        },
    }


def size_values(results: Results, name: str) -> dict[str, Any]:
    """Whether the choice is on the border, and how near to more weights than numbers."""
    study, kind = results.studies[name], KINDS[str(results.section.networks[name].learns)]
    layers = (len(kind.inputs), *study.chosen, len(kind.outputs))
    sizes = study.sizes.filter(like="n_hidden").max().tolist()
    return {
        "chosen": results.hidden(name),
        "select": results.section.networks[name].select,
        "n_goal": study.n_goal,
        "n_runs": study.n_runs,
        "largest": [
            k for k, (n, m) in enumerate(zip(study.chosen, sizes, strict=True), 1) if n == m
        ],
        "n_weights": sum((a + 1) * b for a, b in itertools.pairwise(layers)),
        "n_numbers": int((results.readings["part"] == TRAINING).sum()) * len(kind.outputs),
    }
