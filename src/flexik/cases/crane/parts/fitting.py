"""Study `fitting`: under- and overfitting of networks of several sizes on a thinned grid.

The vertical deflection along one line of the grid that no network was trained on, as the flexible
model and each network have it.
"""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.cases.crane.parts.crane import flexible
from flexik.cases.crane.parts.fields import on_line
from flexik.cases.crane.section import Fitting, Section
from flexik.datasets.parts import Part, Work, Writer, stacked, table
from flexik.datasets.tables import Field, read_table
from flexik.errors import ParameterError, TrainingError
from flexik.kinematics.crane import forward
from flexik.learning.perceptron import Network, quantities
from flexik.learning.training import Architecture, Lesson, train
from flexik.machines.planar import PlanarMachine
from flexik.multibody.planar import tips
from flexik.planar.constants import model_inputs
from flexik.planar.fields import deflection, inputs, kept, sample_fields
from flexik.planar.learning import kind_of

FIELDS = (
    Field("n_hidden", "1", "neurons in the hidden layer", "int64"),
    Field("lift_stroke", "m", "stroke of the lift cylinder"),
    Field("model_y", "m", "deflection, upwards, of the flexible model"),
    Field("network_y", "m", "deflection, upwards, as the network has it"),
)
N_POINTS = 101


def part(section: Section) -> Part:
    """A row for every size and point of the line."""
    study = section.studies.fitting
    settings = {
        "machine": section.machine,
        "study": study,
        "trainer": section.trainers[study.trainer],
    }
    inputs = {**model_inputs(section), "grid": section.data / "samples/grid.parquet"}
    return Part("fitting", prepare, settings, inputs)


def prepare(
    *,
    machine: PlanarMachine,
    study: Fitting,
    trainer: Any,
    constants: Path,
    sections: dict[str, Path],
    grid: Path,
) -> Work:
    """Train a network of each size."""
    samples = kept(read_table(grid, sample_fields(machine)))
    left_out = on_line(samples, study.jib, study.extension, study.payload)
    if left_out.sum() < 2:
        raise ParameterError(
            "crane.studies.fitting: jib, extension and payload leave no line of poses of the grid"
        )
    others, line = samples[~on_line(samples, study.jib, study.extension)], samples[left_out]
    if len(others) < study.n_samples:
        raise ParameterError(
            f"crane.studies.fitting.n_samples: the grid has {len(others)} to choose from"
        )
    rows = np.random.default_rng(study.seed).choice(len(others), study.n_samples, False)
    crane = flexible(machine, constants)
    lift = np.linspace(line["lift_stroke"].min(), line["lift_stroke"].max(), N_POINTS)
    strokes = np.column_stack([lift, np.full((N_POINTS, 2), [study.jib, study.extension])])
    payload = np.full(N_POINTS, study.payload)
    truth = (tips(crane, strokes, payload) - forward(crane.geometry, strokes))[:, 1]
    queries = np.column_stack([strokes, payload]), line[inputs(machine)].to_numpy()
    learn = functools.partial(_curve, machine, others.iloc[rows], trainer, study.seed, queries)

    def finish(results: list[Mapping[str, NDArray]]) -> Mapping[str, Writer]:
        found = []
        for n_hidden, result in zip(study.n_hidden, results, strict=True):
            missed = 1e3 * np.abs(result["line"] - deflection(line)[:, 1]).max()
            print(f"{n_hidden} hidden neurons: at most {missed:.1f} mm off on the line left out")
            columns = np.full(N_POINTS, n_hidden), lift, truth, result["curve"]
            found.append({f.name: c for f, c in zip(FIELDS, columns, strict=True)})
        return {".parquet": table(stacked(found, FIELDS), FIELDS)}

    return Work(learn, study.n_hidden, finish)


def _curve(
    machine: PlanarMachine,
    samples: pd.DataFrame,
    trainer: Any,
    seed: int,
    queries: tuple[NDArray, NDArray],
    n_hidden: int,
) -> dict[str, NDArray]:
    """Vertical deflection at the points of the curve, and at the poses left out."""
    network = _trained(machine, samples, trainer, seed, n_hidden)
    curve, line = (network.predict(query)[:, 1] for query in queries)
    return {"curve": curve, "line": line}


def _trained(
    machine: PlanarMachine, samples: pd.DataFrame, trainer: Any, seed: int, n_hidden: int
) -> Network:
    """Deflection network of `n_hidden` neurons that learnt from `samples`."""
    kind = kind_of(machine, "deflection")
    try:
        network, _ = train(
            Lesson(
                samples[inputs(machine)].to_numpy(),
                deflection(samples),
                quantities(kind.inputs),
                quantities(kind.outputs),
                Architecture(n_hidden),
                trainer,
                seed,
            )
        )
    except TrainingError as error:
        raise TrainingError(f"n_hidden {n_hidden}: {error}") from None
    return network
