"""The report of a planar machine of a file: tables, figures, metrics and page."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from flexik.cases.general.section import Section
from flexik.datasets.tables import read_table
from flexik.evaluation.errors import workspace_statistics
from flexik.files import read_json
from flexik.kinematics.status import REACHED
from flexik.machines.bodies import Beam
from flexik.parameters.conditions import RandomTargets
from flexik.planar import held_out, learning_curves, physics
from flexik.planar.fields import deflection
from flexik.planar.measured.errors import campaign_errors
from flexik.planar.measured.fields import TARGET
from flexik.planar.measured.report import (
    adaptation_figure,
    adaptation_table,
    by_twin,
    offset_table,
    prediction_table,
)
from flexik.planar.picture import moved, picture
from flexik.planar.samples import counts
from flexik.planar.section import OwnSamples
from flexik.positioning.registry import about
from flexik.reporting import curves, kinds, plane, style
from flexik.reporting.chart import Axis
from flexik.reporting.report import Content, Drawing, draw, write_case
from flexik.reporting.style import MM
from flexik.reporting.tables import Column, Table, mm, table

# Cells of a map along the longer side of its area
CELLS = 40
# What stands for rigid kinematics among the networks of held-out samples
RIGID = "rigid kinematics"
# Parts of the payloads that a table tells apart
THIRDS = ("lower third", "middle third", "upper third")


@dataclass(frozen=True)
class Results:
    """What the stages made; SI units."""

    section: Section

    @cached_property
    def errors(self) -> dict[str, dict[str, pd.DataFrame]]:
        """Tables of errors by conditions and method."""
        folder, section = self.section.data / "errors", self.section
        return {
            name: {m: read_table(folder / name / f"{m}.parquet") for m in section.methods}
            for name in section.conditions
        }

    @cached_property
    def statistics(self) -> dict[str, pd.DataFrame]:
        """Statistics by conditions, a row a method."""
        return {
            name: pd.DataFrame([{"method": m, **workspace_statistics(f)} for m, f in of.items()])
            for name, of in self.errors.items()
        }

    @cached_property
    def networks(self) -> pd.DataFrame:
        """A row a network: the restarts that were compared, and the kept one."""
        rows = []
        for name, network in self.section.networks.items():
            folder = self.section.data / "networks"
            restarts = pd.read_csv(folder / f"{name}.restarts.csv")
            found = restarts["selection_error"]
            rows.append(
                {
                    "network": name,
                    "learns": network.learns or f"what {network.corrects} lacks",
                    "hidden": restarts["n_hidden"].iloc[0],
                    "restarts": len(restarts),
                    "trainer": network.trainer,
                    "least": found.min(),
                    "median": found.median(),
                    "largest": found.max(),
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def held_out(self) -> dict[str, pd.DataFrame]:
        """Errors of rigid kinematics and of networks on samples held out; none of a model's own."""
        folder = self.section.data / "errors/held_out"
        if not isinstance(self.section.samples, OwnSamples):
            return {}
        samples = read_table(self.section.data / "samples/held_out.parquet")
        sag = np.hypot(*deflection(samples).T)
        rigid = pd.DataFrame({"payload": samples["payload"], "error": sag})
        names = [part.name.partition("/")[2] for part in held_out.parts(self.section)]
        return {RIGID: rigid} | {n: read_table(folder / f"{n}.parquet") for n in names}

    @cached_property
    def samples(self) -> dict[str, pd.DataFrame]:
        """`grid` and `selection`, and what was held out."""
        folder = self.section.data / "samples"
        names = ["grid", "selection", *(["held_out"] if self.held_out else [])]
        return {name: read_table(folder / f"{name}.parquet") for name in names}

    @cached_property
    def curves(self) -> pd.DataFrame:
        """Errors by number of samples, of planar.learning_curves."""
        return learning_curves.read(self.section, self.section.studies.learning_curves)

    @cached_property
    def physics(self) -> pd.DataFrame:
        """What is left open about the machine, of planar.physics."""
        return physics.read(self.section, self.section.studies.physics)

    @cached_property
    def campaign(self) -> pd.DataFrame:
        """Errors of the measured points; none where nothing is measured or no targets are known."""
        found = self.measured("campaign")
        known = len(found) and found[TARGET].notna().all(axis=None)
        return campaign_errors(found) if known else pd.DataFrame()

    @cached_property
    def adapted(self) -> pd.DataFrame:
        """Errors of each machine as built before and after adaptation."""
        found = self.measured("adaptation")
        return by_twin(found) if len(found) else found

    @cached_property
    def offsets(self) -> pd.DataFrame:
        """What the campaign identifies."""
        return self.measured("identified")

    def measured(self, name: str) -> pd.DataFrame:
        """A table of planar.measured; empty where nothing is measured."""
        path = self.section.data / f"studies/measured/{name}.parquet"
        return read_table(path) if self.section.measured else pd.DataFrame()

    @cached_property
    def shape(self) -> dict[str, Any]:
        """The sample that the picture shows."""
        found: dict[str, Any] = read_json(self.section.data / "studies/shape.json")
        return found


def report(section: Section) -> None:
    """Write reports/NAME from data/NAME."""
    results = Results(section)
    content = Content(tables(results), figures(results), metrics(results), values(results))
    write_case(section, Path(__file__).with_name("page.md.j2"), content, section.files)


def tables(results: Results) -> dict[str, Table]:
    """By name."""
    statistics = {
        **{name: name for name in ("method",)},
        "mean (mm)": mm("mean_error", 4),
        "median (mm)": mm("median_error", 3),
        "95 % (mm)": mm("p95_error", 3),
        "99 % (mm)": mm("p99_error", 3),
        "max (mm)": mm("max_error", 3),
        "failed": "n_failed",
    }
    found = {f"errors_{k}": table(rows, statistics) for k, rows in results.statistics.items()}
    for name, given in results.section.conditions.items():
        if isinstance(given, RandomTargets):
            found[f"payload_{name}"] = _by_payload(results.errors[name])
    if results.held_out:
        found["held_out"] = table(_distances(results), statistics | {"method": "method"})
    if len(results.campaign):
        rows = results.campaign.groupby("method", sort=False)["error"]
        means = rows.agg(measurements="size", mean="mean", max="max").reset_index()
        columns = {"method": "method", "measurements": "measurements", "mean (mm)": mm("mean", 1)}
        found["measured_errors"] = table(means, columns | {"max (mm)": mm("max", 1)})
    if len(results.adapted):
        found["adaptation"] = adaptation_table(results.adapted)
    if len(results.offsets):
        found["identified_offsets"] = offset_table(results.offsets)
        found["measured_predictions"] = prediction_table(results.measured("identified.predictions"))
    errors = {name: Column(name, 6) for name in ("least", "median", "largest")}
    told = ("network", "learns", "hidden", "restarts", "trainer")
    found["networks"] = table(results.networks, {name: name for name in told} | errors)
    if len(results.curves):
        found["learning_curves"] = curves.table(results.curves)
    if len(results.physics):
        found["physics"] = curves.physics_table(results.physics)
    return found | {"bodies": _bodies(results.section), "drives": _drives(results.section)}


def _distances(results: Results) -> pd.DataFrame:
    """Statistics of the distances on held-out samples, a row a predictor."""
    found = {name: f.assign(status=REACHED) for name, f in results.held_out.items()}
    return pd.DataFrame([{"method": n, **workspace_statistics(f)} for n, f in found.items()])


def _by_payload(errors: dict[str, pd.DataFrame]) -> Table:
    """Mean errors (mm) of every method by thirds of the payloads."""
    rows = []
    for method, frame in errors.items():
        third = pd.qcut(frame["payload"], 3, labels=list(THIRDS))
        means = MM * frame["error"].groupby(third, observed=True).mean()
        rows.append({"method": method, **{f"{t} (mm)": means.get(t, np.nan) for t in THIRDS}})
    return Table(pd.DataFrame(rows), 3)


def _bodies(section: Section) -> Table:
    masses = list(section.machine.masses().values())
    rows = []
    for name, body in section.machine.bodies.items():
        length = body.span[1] - body.span[0] if isinstance(body, Beam) else None
        mass = sum(kilograms for of, _, kilograms in masses if of == name)
        told = {"body": name, "bends": "no" if length is None else "yes"}
        rows.append(told | {"length (m)": length, "mass (kg)": mass})
    return Table(pd.DataFrame(rows), {"length (m)": 3, "mass (kg)": 1})


def _drives(section: Section) -> Table:
    rows = [
        {
            "drive": name,
            "kind": drive.kind,
            "least": drive.limits[0],
            "largest": drive.limits[1],
            "unit": "rad" if drive.kind == "revolute" else "m",
        }
        for name, drive in section.machine.drives.items()
    ]
    return Table(pd.DataFrame(rows), 3)


def figures(results: Results) -> dict[str, Drawing]:
    """By name."""
    found = {"machine": picture(results.section.machine, results.shape)}
    looks = style.looks(results.section.methods)
    for name, given in results.section.conditions.items():
        frame = pd.concat([f.assign(method=m) for m, f in results.errors[name].items()])
        axis = Axis("error (mm)", MM, log=True)
        found[f"distribution_{name}"] = draw(
            kinds.distribution, frame, "error", "method", axis, looks=looks
        )
        if isinstance(given, RandomTargets):
            side = max(np.ptp(given.x), np.ptp(given.y)) / CELLS
            columns = "target_x", "target_y", "error", "method"
            found[f"map_{name}"] = draw(
                plane.maps,
                frame,
                *columns,
                label="error (mm)",
                scale=MM,
                cell=round(side, 2) or None,
            )
    if len(results.curves):
        found["learning_curves"] = curves.figure(results.curves)
    if len(results.adapted):
        found["adaptation"] = adaptation_figure(results.adapted)
    if results.held_out:
        frame = pd.concat([f.assign(method=m) for m, f in results.held_out.items()])
        axis = Axis("distance (mm)", MM, log=True)
        what = {"what": "samples", "looks": style.looks(results.held_out)}
        found["distribution_held_out"] = draw(
            kinds.distribution, frame, "error", "method", axis, **what
        )
    return found


def metrics(results: Results) -> dict[str, float | None]:
    """Flat; lengths in mm."""
    found: dict[str, float | None] = {}
    for name, rows in results.statistics.items():
        for row in rows.to_dict("records"):
            key = f"{name}.{row['method']}"
            lengths = {k: v for k, v in row.items() if str(k).endswith("_error")}
            found |= {f"{key}.{k}_mm": round(MM * v, 4) for k, v in lengths.items()}
            found[f"{key}.n_failed"] = row["n_failed"]
    for name, frame in results.held_out.items():
        errors = frame["error"]
        for which, value in (("mean", errors.mean()), ("max", errors.max())):
            found[f"held_out.{name}.{which}_error_mm"] = round(MM * value, 4)
    if len(results.adapted):
        means = results.adapted.groupby(["method", "n_measurements"], sort=False)["mean_error"]
        for row in means.mean().reset_index().to_dict("records"):
            key = f"measured.{row['method']}_{row['n_measurements']}.mean_error_mm"
            found[key] = round(MM * row["mean_error"], 4)
    for name, samples in results.samples.items():
        found |= {f"{name}.{key}": n for key, n in counts(samples).items()}
    for row in results.networks.to_dict("records"):
        for which in ("least", "median", "largest"):
            found[f"{row['network']}.{which}_selection_error"] = round(row[which], 9)
    return found


def values(results: Results) -> dict[str, Any]:
    """What the sentences of the page hold."""
    random = [n for n, g in results.section.conditions.items() if isinstance(g, RandomTargets)]
    judged = (random or [*results.section.conditions, "held_out"])[0]
    of_all = _distances(results) if results.held_out else results.statistics[judged]
    rows = of_all.set_index("method")
    best = rows["mean_error"].idxmin()
    asks = [name for name, given in results.section.methods.items() if given.network]
    return {
        "own": results.section.samples if results.held_out else None,
        "rigid": RIGID,
        "section": results.section,
        "about": {name: about(method) for name, method in results.section.methods.items()},
        "machine": results.section.machine,
        "judged": judged,
        "random": random,
        "best": best,
        "leads": {key: rows[f"{key}_error"].idxmin() for key in ("mean", "p99", "max")},
        "asks_network": asks,
        "best_network": rows.loc[asks, "mean_error"].idxmin() if asks else None,
        "rows": rows.to_dict("index"),
        "counted": {name: counts(frame) for name, frame in results.samples.items()},
        "mass": sum(mass for _, _, mass in results.section.machine.masses().values()),
        "moved": moved(results.shape),
        "shape": results.shape,
        "measured": results.section.measured,
        "adapted": _adapted_said(results.adapted),
        "has_targets": len(results.campaign) > 0,
        "has_offsets": len(results.offsets) > 0,
    }


def _adapted_said(adapted: pd.DataFrame) -> dict[str, Any] | None:
    """Mean errors (m) of the method that is adapted, of the nominal machine and at last."""
    if adapted.empty:
        return None
    means = adapted.groupby("n_measurements")["mean_error"].mean()
    return {"before": means.iloc[0], "after": means.iloc[-1], "n": means.index[-1]}
