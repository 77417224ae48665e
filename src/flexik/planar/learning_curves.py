"""Study `learning_curves`: the error of the predicted tip against the number of samples.

Each network learns from random samples, fewer and more, and from the poses of the grid with fewer
and more payloads; all are judged by the same random samples, and by the same poses with payloads
that none of them learnt.
"""

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Part, Work, rows
from flexik.datasets.tables import Field, read_table
from flexik.errors import TrainingError
from flexik.learning import regressor, torch_module
from flexik.learning.examples import Examples
from flexik.learning.perceptron import quantities
from flexik.learning.training import Architecture, Lesson, train_best
from flexik.machines.planar import PlanarMachine
from flexik.parameters.networks import Regressor, TorchModule
from flexik.planar import samples
from flexik.planar.fields import PAYLOAD, kept, sample_fields
from flexik.planar.learning import Predictor, kind_of, pair
from flexik.planar.section import PlanarSection, Selection
from flexik.planar.study_section import LearningCurves
from flexik.planar.train import based_on, data_inputs, described

Array = NDArray[np.float64]
# Inputs and outputs of a network
Pair = tuple[Array, Array]

FOLDER = "learning_curves"
RANDOM, LEVELS = "random", "levels"
FIELDS = (
    Field("design", "1", "random samples, or levels: the grid with fewer payloads", "string"),
    Field("n_samples", "1", "samples learnt from", "int64"),
    Field("n_levels", "1", "payloads of the grid learnt from; 0: random samples", "int64"),
    Field("payload", "kg", "of the samples that judge; NaN: random, between those learnt from"),
    Field("mean_error", "m", "distance of the predicted tip; NaN: nothing was learnt"),
    Field("p99_error", "m", "the same, 99th percentile"),
    Field("max_error", "m", "the same, largest"),
)


def parts(section: PlanarSection, study: LearningCurves | None) -> list[Part]:
    """The samples, and `learning_curves/NETWORK`, a table of FIELDS."""
    if study is None:
        return []
    payload = section.samples.grid["payload"]
    between = payload.minimum, payload.maximum
    drawn = {
        "samples": Selection(n_samples=max(study.n_samples), payload=between, seed=study.seed),
        # the same seed, so the same poses
        **{
            f"judged_{number}": Selection(
                n_samples=study.n_judged, payload=given, seed=study.seed + 1
            )
            for number, given in enumerate([between, *((p, p) for p in study.outside)])
        },
    }
    solved = [samples.part(section, f"{FOLDER}/{name}", given) for name, given in drawn.items()]
    return [*solved, *(_part(section, study, name) for name in study.networks)]


def read(section: PlanarSection, study: LearningCurves | None) -> pd.DataFrame:
    """The tables of all networks, one below the other, with a column `network`."""
    folder, names = section.data / "studies" / FOLDER, study.networks if study else ()
    found = [read_table(folder / f"{name}.parquet").assign(network=name) for name in names]
    return pd.concat(found, ignore_index=True) if found else pd.DataFrame()


def _part(section: PlanarSection, study: LearningCurves, name: str) -> Part:
    settings = {
        "machine": section.machine,
        "by": learning(section, name, study.n_restarts),
        "n_samples": study.n_samples,
        "n_levels": study.n_levels,
    }
    folder = section.data / "studies" / FOLDER
    judged = [folder / f"judged_{number}.parquet" for number in range(1 + len(study.outside))]
    solved = {"samples": folder / "samples.parquet", "judged": judged}
    return Part(f"{FOLDER}/{name}", prepare, settings, data_inputs(section, name) | solved)


def prepare(
    *,
    machine: PlanarMachine,
    by: Mapping[str, Any],
    n_samples: tuple[int, ...],
    n_levels: tuple[int, ...],
    grid: Path,
    selection: Path,
    samples: Path,
    judged: list[Path],
    constants: Path | None = None,
    sections: object = None,
) -> Work:
    """A set to learn from is an item; `by` is what `learning` tells."""
    fields = sample_fields(machine)
    drawn, whole, chosen_by, *judges = (
        kept(read_table(path, fields)) for path in (samples, grid, selection, *judged)
    )
    sets = [(RANDOM, 0, drawn[:n]) for n in n_samples]
    sets += [(LEVELS, n, with_levels(whole, n)) for n in n_levels]
    base = based_on(machine, by.get("theory"), by.get("n_passes", 0), constants)
    of = functools.partial(pair, kind=by["kind"], machine=machine, base=base)
    learn = functools.partial(learnt, by, machine, chosen=of(chosen_by))
    items = [(design, n_levels, len(table), of(table)) for design, n_levels, table in sets]
    asked = [
        (judge[PAYLOAD.name].iloc[0] if number else np.nan, *of(judge))
        for number, judge in enumerate(judges)
    ]
    return Work(functools.partial(_judged, learn, asked), items, rows(*FIELDS))


def with_levels(table: pd.DataFrame, n_levels: int) -> pd.DataFrame:
    """Rows of the grid `table` with `n_levels` of its payloads, or all that it has."""
    payloads = np.unique(table[PAYLOAD.name])
    places = np.linspace(0, len(payloads) - 1, min(n_levels, len(payloads)))
    return table[table[PAYLOAD.name].isin(payloads[places.round().astype(int)])]


def learning(section: PlanarSection, name: str, n_restarts: int) -> dict[str, Any]:
    """How network `name` learns, from `n_restarts` starts at most: what `learnt` takes."""
    network = section.networks[name]
    trainers = network.trainers if isinstance(network, TorchModule) else [network.trainer]
    found = described(section, name) | {
        "network": network,
        "n_restarts": min(n_restarts, network.n_restarts),
        "trainers": [section.trainers[t] for t in trainers if t in section.trainers],
    }
    del found["machine"]
    return found


def learnt(by: Mapping[str, Any], machine: PlanarMachine, grid: Pair, chosen: Pair) -> Predictor:
    """What is learnt from `grid` and chosen by `chosen`, as `learning` tells."""
    network, seed, n_restarts = by["network"], by["seed"], by["n_restarts"]
    if isinstance(network, Regressor):
        return regressor.fit(network.regressor, seed, Examples(*grid, chosen))
    if isinstance(network, TorchModule):
        examples = Examples(*grid, chosen)
        return torch_module.train_best(network.module, examples, by["trainers"], seed, n_restarts)
    columns = kind_of(machine, by["kind"])
    names = quantities(columns.inputs), quantities(columns.outputs)
    architecture = Architecture(network.sizes[0], network.activation)
    lesson = Lesson(*grid, *names, architecture, by["trainers"][0], seed, chosen)
    return train_best(lesson, n_restarts)[0]


def _judged(
    learn: Callable[[Pair], Predictor],
    asked: list[tuple[float, Array, Array]],
    given: tuple[str, int, int, Pair],
) -> Mapping[str, NDArray]:
    """A row a set of samples that judge: what is not predicted of their outputs moves the tip."""
    design, n_levels, n_samples, grid = given
    try:
        network = learn(grid)
    except TrainingError:  # too few samples for so many weights
        network = None
    found = []
    for payload, inputs, outputs in asked:
        error = np.full(len(inputs), np.nan)
        if network is not None:
            error = np.hypot(*(network.predict(inputs) - outputs).T)
        measures = error.mean(), np.quantile(error, 0.99), error.max()
        found.append((design, n_samples, n_levels, payload, *measures))
    columns = zip(*found, strict=True)
    return {field.name: np.array(c) for field, c in zip(FIELDS, columns, strict=True)}
