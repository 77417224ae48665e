"""The report of the elastic arm: tables, metrics, and what the sentences of its page hold."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.elastic_arm.parts import gauges
from flexik.cases.elastic_arm.parts.gauges import FREE_OF_NOISE, NOISY
from flexik.cases.elastic_arm.parts.kinds import KINDS
from flexik.cases.elastic_arm.parts.readings import ANGLES, TRAINING
from flexik.cases.elastic_arm.report_figures import figures, shown_networks
from flexik.cases.elastic_arm.report_results import NEAR, PUBLISHED, R, Results, hyphened
from flexik.cases.elastic_arm.section import Section
from flexik.files import read_json
from flexik.kinematics.elastic_arm import DEFORMATION
from flexik.learning.size_selection import by_size
from flexik.reporting.report import Content, write_section
from flexik.reporting.style import MICRO, MM
from flexik.reporting.tables import Column, Table, mm, table

NOTHING = "nothing"
POSITIONING = {
    **{name: name for name in ("method", "knows", "gauges", "hidden", "trainer")},
    "mean (mm)": mm("mean_error", 3),
    "median (mm)": mm("median_error", 3),
    "95 % (mm)": mm("p95_error", 3),
    "max (mm)": mm("max_error", 3),
    "failed": "n_failed",
    "clipped": "clipped",
    "mean by restart (mm)": "mean_errors",
    "max by restart (mm)": "max_errors",
}
# Fits of networks by the prefix of their columns
FITS = {"training_": "training", "": "held out", "targets_": "targets", "published_": "published"}


def report(section: Section) -> None:
    """Write reports/NAME from data/NAME."""
    results = Results(section)
    content = Content(tables(results), figures(results), metrics(results), values(results))
    write_section(section, Path(__file__).with_name("page.md.j2"), content, [PUBLISHED])


def metrics(results: Results) -> dict[str, float | None]:
    """Flat; lengths in mm, rounded to what machines agree on."""
    r_columns = {
        f"{which}r_theta{k}": (which + r, 1.0, 6)
        for k, r in enumerate(R, start=1)
        for which in ("", "training_", "targets_")
    }
    held_out = {f"held_out_{e}_mm": (e, MM, 4) for e in ("mean_error", "max_error")}
    errors = {f"{e}_error": f"{e}_error" for e in ("mean", "median", "p95", "max")}
    errors |= {f"restarts.max_{e}_error": f"worst_{e}_error" for e in ("mean", "max")}
    errors["payload_off_mean_error"] = "told"
    shown = {f"{title}_mm": (column, MM, 4) for title, column in errors.items()}
    found = _rounded(results.fits, r_columns | held_out)
    found |= _rounded(results.positioning, shown | {"n_failed": ("n_failed", 1, None)})
    for changed, error in sensitivity(results)[results.main].drop(NOTHING).items():
        found[f"{results.main}.{changed}_off_mean_error_mm"] = round(MM * error, 4)
    for k, r in enumerate(R, start=1):
        found[f"splits.median_r_theta{k}"] = round(results.splits[r].median(), 6)
        found[f"splits.least_r_theta{k}"] = round(results.splits[r].min(), 6)
    for name in selected(results):
        for k, n in enumerate(results.layers(name), start=1):
            found[f"select.{name}.n_hidden_{k}"] = n
    parts = results.readings["part"].value_counts().sort_index()
    return found | {f"readings.n_{part}": int(n) for part, n in parts.items()}


def _rounded(
    frame: pd.DataFrame, columns: Mapping[str, tuple[str, float, int | None]]
) -> dict[str, float | None]:
    """Finite values of some columns of all rows: column, factor and digits by title."""
    return {
        f"{name}.{title}": round(factor * row[column], digits)
        for name, row in frame.iterrows()
        for title, (column, factor, digits) in columns.items()
        if np.isfinite(row[column])
    }


def tables(results: Results) -> dict[str, Table]:
    """All tables by name."""
    r_columns = {
        f"R {angle}, {title}": Column(f"{which}{r}", 6 if title == "published" else 8)
        for which, title in FITS.items()
        for angle, r in zip(ANGLES, R, strict=True)
    }
    fit_columns = {
        **{name: name for name in ("network", "hidden", "trainer", "gauges")},
        **r_columns,
        "mean tip error (mm)": mm("mean_error"),
        "max tip error (mm)": mm("max_error"),
        "mean tip error by restart (mm)": "mean_errors",
    }
    folder, networks = results.section.data / "networks", results.section.networks
    runs = {(n, results.hidden(n)): pd.read_csv(folder / f"{n}.restarts.csv") for n in networks}
    training = pd.concat(runs, names=["network", "hidden"]).reset_index(["network", "hidden"])
    off, changes = MM * sensitivity(results), results.of("studies/sensitivity").groupby("input")
    off.insert(0, "off by (um, urad)", MICRO * changes["change"].first())
    return {
        "sensitivity": Table(off.rename_axis("input that is off").reset_index(), 3),
        "positioning_errors": table(results.positioning.reset_index(), POSITIONING),
        "fit": table(results.fits.reset_index(), fit_columns),
        "splits": splits_table(results),
        "gauges": gauges_table(results),
        "training": Table(training, {"training_error": 6, "selection_error": 6}),
        **{
            f"size_selection/{name}": Table(by_size(results.of(f"sizes/{name}")), 6)
            for name in selected(results)
        },
    }


def splits_table(results: Results) -> Table:
    """R of one network on the held-out readings of every division."""
    splits, r = results.splits, results.splits[R]
    rows = splits.assign(seed=splits["seed"].astype(str), division="other")
    rows.loc[0, "division"] = "main"
    published = results.fits.loc[results.main, [f"published_{name}" for name in R]]
    below = pd.DataFrame({"median": r.median(), "largest - least": r.max() - r.min()})
    below["published"] = published.set_axis(R)
    rows = pd.concat([rows, below.T.rename_axis("division").reset_index()])
    titles = {f"R {angle}": Column(name, 6) for angle, name in zip(ANGLES, R, strict=True)}
    return table(rows.fillna({"seed": ""}), {"division": "division", "seed": "seed", **titles})


def sensitivity(results: Results) -> pd.DataFrame:
    """Mean tip errors in m by the input that is off, a column a network."""
    rows = results.of("studies/sensitivity").query("chosen == 1")
    frame = rows.pivot_table(index="input", columns="network", values="mean_error")
    return frame.loc[rows["input"].unique(), rows["network"].unique()]


def gauges_table(results: Results) -> Table:
    """Deformation by the gauges minus that of the model, over all readings, mm and mrad."""
    names = list(DEFORMATION)
    model = results.readings[names]
    units = {name: "mrad" if name.startswith("dphi") else "mm" for name in names}
    frame = pd.DataFrame({"variable": names, "unit": units}, index=names)
    frame["largest, model"] = MM * model.abs().max()
    frame["largest, gauges"] = MM * results.shown(FREE_OF_NOISE)[names].abs().max()
    frame["standard uncertainty, noisy"] = MM * gauges.uncertainty(results.section.machine)
    for noise in (FREE_OF_NOISE, NOISY):
        difference = MM * (results.shown(noise)[names] - model).abs()
        for statistic in ("mean", "max"):
            frame[f"{statistic} difference, {hyphened(noise)}"] = difference.agg(statistic)
    return Table(frame, 5)


def selected(results: Results) -> list[str]:
    """Networks whose size was chosen."""
    return [name for name, network in results.section.networks.items() if network.is_selected]


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page hold."""
    section, exact, readings = results.section, results.shown(FREE_OF_NOISE), results.readings
    voltages = exact.filter(like="voltage").to_numpy()
    tip = readings[["tip_x", "tip_y"]].to_numpy()
    return {
        "results": results,
        "section": section,
        "given": section.machine.gauges,
        "counts": read_json(section.data / f"samples/{results.conditions}.json"),
        "n_of_part": readings["part"].value_counts().to_dict(),
        "largest": exact.abs().max(),
        "voltages": [voltages.min(), voltages.max()],
        "n_clipped": gauges.n_clipped(section.machine, voltages),
        "gauge_tip": {
            hyphened(noise): np.hypot(*(results.shown(noise)[["p_x", "p_y"]].to_numpy() - tip).T)
            for noise in (FREE_OF_NOISE, NOISY)
        },
        "fits": results.fits.to_dict("index"),
        "positioning": results.positioning.to_dict("index"),
        "near": NEAR,
        "published_networks": shown_networks(results),
        "sizes": {name: size_values(results, name) for name in selected(results)},
        "depths": depths(results),
        **sensitivity_values(results),
    }


def alike(results: Results, *keys: str) -> list[str]:
    """Networks given gauges whose settings `keys` are those of the published one."""
    like = results.section.networks[results.main]
    return [
        name
        for name, network in results.section.gauge_networks.items()
        if all(getattr(network, key) == getattr(like, key) for key in keys)
    ]


def sensitivity_values(results: Results) -> dict[str, Any]:
    """The input that the published network depends on most, and which noise costs it more."""
    off, rows = sensitivity(results)[results.main], results.of("studies/sensitivity")
    worst = str(off.drop(NOTHING).idxmax())
    rows = rows[(rows["network"] == results.main) & (rows["input"] == worst)]
    same = alike(results, "trainer", "n_hidden", "learns")
    errors = results.fits["mean_error"].to_dict()
    networks = results.section.networks
    by_noise = {str(networks[name].readings): errors[name] for name in reversed(same)}
    free, noisy, voltages = (by_noise.get(noise, np.nan) for noise in gauges.SHOWN)
    return {
        "off": off.to_dict(),
        "worst": worst,
        "worst_change": rows["change"].iloc[0],
        "worst_errors": rows["mean_error"].tolist(),
        "alike": alike(results, "trainer", "n_hidden"),
        "noise_costs": {"voltages": voltages - free, "strains": noisy - voltages},
    }


def depths(results: Results) -> dict[str, Any]:
    """Best networks of one and of several layers by the published trainer and inputs."""
    rows = results.fits.loc[alike(results, "learns", "readings", "trainer")]
    rows = rows.assign(lesser=rows[R].min(axis=1))
    deep = rows["hidden"].str.contains("-")
    return {
        title: {"by_r": of_depth["lesser"].idxmax(), "by_tip": of_depth["mean_error"].idxmin()}
        for title, of_depth in (("one layer", rows[~deep]), ("several", rows[deep]))
        if len(of_depth)
    }


def size_values(results: Results, name: str) -> dict[str, Any]:
    """Whether the choice is on the border, and how near to more weights than numbers."""
    runs, kind = results.of(f"sizes/{name}"), KINDS[results.section.networks[name].learns]
    sizes, tried = results.layers(name), runs.filter(like="n_hidden").max()
    pairs = itertools.pairwise((len(kind.inputs), *sizes, len(kind.outputs)))
    n_training = int((results.readings["part"] == TRAINING).sum())
    return {
        "select": results.section.networks[name].select,
        "n_goal": int((runs["stop_reason"] == "goal").sum()),
        "n_runs": len(runs),
        "largest": [k for k, (n, m) in enumerate(zip(sizes, tried, strict=True), 1) if n == m],
        "n_weights": sum((a + 1) * b for a, b in pairs),
        "n_numbers": n_training * len(kind.outputs),
    }
