"""A regressor of scikit-learn in place of a network, fitted to what the network would learn."""

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from flexik.datasets.parts import Columns, Part, Work, Writer, text_file
from flexik.datasets.tables import read_table
from flexik.learning import regressor as regressors
from flexik.learning.examples import Examples
from flexik.machines.planar import PlanarMachine
from flexik.parameters.networks import Regressor
from flexik.planar.fields import kept, sample_fields
from flexik.planar.learning import Predictor, pair
from flexik.planar.section import PlanarSection
from flexik.planar.train import based_on, data_inputs, described


def part(section: PlanarSection, name: str) -> Part:
    """Regressor `name`: .skops, and a row as those of networks (.restarts.csv)."""
    given = section.networks[name]
    assert isinstance(given, Regressor)
    settings = described(section, name) | {"regressor": given.regressor, "trainer": given.trainer}
    return Part(name, prepare, settings, data_inputs(section, name))


def prepare(
    *,
    machine: PlanarMachine,
    kind: str,
    regressor: Mapping[str, Any],
    trainer: str,
    seed: int,
    grid: Path,
    selection: Path,
    **model: Any,
) -> Work:
    """One fit; `model` is what `based_on` takes."""
    taught = examples(kind, machine, grid, selection, based_on(machine, **model))

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        (found,) = results
        row = {
            "restart": 0,
            "n_hidden": None,
            "trainer": trainer,
            "n_iterations": None,
            "training_error": found["errors"][0],
            "selection_error": found["errors"][1],
            "stop_reason": "fitted",
        }

        def write(path: Path) -> None:
            path.write_bytes(found["stored"].tobytes())

        return {
            ".skops": write,
            ".restarts.csv": text_file(pd.DataFrame([row]).to_csv(index=False)),
        }

    return Work(functools.partial(_fit, taught, regressor), [seed], finish)


def examples(
    kind: str,
    machine: PlanarMachine,
    grid: Path,
    selection: Path,
    base: Predictor | None,
) -> Examples:
    """What a network of `kind` learns from the table `grid`, and is chosen by."""
    tables = (kept(read_table(path, sample_fields(machine))) for path in (grid, selection))
    learnt, chosen_by = (pair(table, kind, machine, base) for table in tables)
    return Examples(*learnt, chosen_by)


def _fit(taught: Examples, regressor: Mapping[str, Any], seed: int) -> dict[str, NDArray]:
    found = regressors.fit(regressor, seed, taught)
    stored = np.frombuffer(regressors.stored(found), dtype=np.uint8)
    return {"stored": stored, "errors": np.array(taught.errors(found.predict))}
