"""Errors of every method under every set of conditions, a long table each.

A part CONDITIONS/METHOD; `.spread.parquet` beside those of given points: the errors of the method
with the networks of the best restarts, of which the very best by selection error is its own.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import Field
from flexik.evaluation.conditions import Conditions
from flexik.evaluation.errors import Judge, evaluate, fields_of, statistics, tip_judge
from flexik.kinematics.machine_file import manipulator_of
from flexik.learning.storage import TrainingRecord, load_networks
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.parameters.conditions import Points
from flexik.planar.conditions import at_points, at_targets
from flexik.planar.constants import model_inputs
from flexik.planar.machine import columns_of, flexible
from flexik.planar.methods import method_inputs, method_settings, trained_method
from flexik.planar.section import PlanarSection
from flexik.positioning.method import Columns, Method, Network, Settings
from flexik.positioning.registry import Build

# Many rows at once pay for searches, of which a few take most steps
ROWS = 2500
# Networks that might have been chosen
N_SPREAD = 10
SPREAD_FIELDS = (
    Field("restart", "1", "start of the network's training, from 0", "int64"),
    Field("selection_error", "1", "of that network: the least is the method's own"),
    Field("mean_error", "m", "over all conditions"),
    Field("max_error", "m", "over all conditions"),
    Field("n_failed", "1", "conditions whose search failed", "int64"),
)


def parts(section: PlanarSection) -> list[Part]:
    """Every method under all conditions."""
    return [
        _part(section, conditions, method)
        for conditions in section.conditions
        for method in section.methods
    ]


def _part(section: PlanarSection, conditions: str, name: str) -> Part:
    given, method = section.conditions[conditions], section.methods[name]
    settings = {
        "machine": section.machine,
        "name": f"{conditions}/{name}",
        **method_settings(section, name),
    }
    inputs = {**model_inputs(section), **method_inputs(section, name)}
    if isinstance(given, Points):
        settings["points"] = given
        # a genetic algorithm takes too long to be asked again with every network
        if (
            method.network is not None
            and getattr(method, "genetic", None) is None
            and section.has_restarts(method.network)
        ):
            inputs["restarts"] = section.data / "networks" / f"{method.network}.restarts.json"
    else:
        settings["n_targets"] = method.n_targets
        inputs["targets"] = section.data / "samples" / f"{conditions}.parquet"
    return Part(f"{conditions}/{name}", prepare, settings, inputs)


def prepare(
    *,
    machine: PlanarMachine,
    name: str,
    method: Settings,
    build: Build,
    sections: dict[str, Path],
    samples: Mapping[str, Path],
    network: Path | None = None,
    restarts: Path | None = None,
    constants: Path | None = None,
    points: Points | None = None,
    targets: Path | None = None,
    n_targets: int | None = None,
    load: Callable[[Path], Any] = load_networks,
) -> Work:
    """Ask the method in pieces, then with the network of every restart."""
    manipulator = manipulator_of(machine)
    if points is not None:
        conditions = at_points(points, manipulator)
    else:
        assert targets is not None
        conditions = at_targets(targets, machine, manipulator, n_targets)
    built = flexible(machine, constants)
    with_network = functools.partial(
        trained_method,
        method,
        build,
        manipulator,
        samples=samples,
        machine=built.machine,
        load=load,
    )
    asked = with_network(network)
    items: list[Any] = [(asked, piece) for piece in conditions.chunks(ROWS)]
    n_pieces, columns = len(items), columns_of(machine)
    starts = [] if restarts is None else _best(load(restarts))
    items += [(with_network(other), conditions) for other, _ in starts]

    def finish(results: list[Mapping[str, NDArray]]) -> Mapping[str, Writer]:
        fields = fields_of(results[0], columns)
        found = stacked(results[:n_pieces], fields)
        of_method = statistics(pd.DataFrame(found))
        print(
            f"{name}: mean error {1e3 * of_method['mean_error']:.3g} mm, "
            f"max {1e3 * of_method['max_error']:.3g} mm, "
            f"{of_method['n_failed']} of {of_method['n_conditions']} failed"
        )
        writers = {".parquet": table(found, fields)}
        if starts:
            records = [record for _, record in starts]
            writers[".spread.parquet"] = table(_spread(records, results[n_pieces:]), SPREAD_FIELDS)
        return writers

    judge = tip_judge(functools.partial(tips, built))
    return Work(functools.partial(_errors, judge, columns), items, finish)


def _errors(
    judge: Judge, columns: Columns, item: tuple[Method, Conditions]
) -> Mapping[str, NDArray]:
    method, conditions = item
    return evaluate(method, conditions, judge, columns)


def _best(starts: Sequence[tuple[Network, TrainingRecord]]) -> list[tuple[Network, TrainingRecord]]:
    """Those of the least selection errors, in the order of their restarts."""
    best = sorted(starts, key=lambda start: start[1].rank)[:N_SPREAD]
    return sorted(best, key=lambda start: start[1].restart)


def _spread(
    records: Sequence[TrainingRecord], results: Sequence[Mapping[str, NDArray]]
) -> dict[str, NDArray]:
    """Columns SPREAD_FIELDS."""
    found = pd.DataFrame([statistics(pd.DataFrame(result)) for result in results])
    return {
        "restart": np.array([record.restart for record in records]),
        "selection_error": np.array([record.selection_error for record in records], dtype=float),
        **{name: found[name].to_numpy() for name in ("mean_error", "max_error", "n_failed")},
    }
