"""A module of torch in place of a network, trained from several starts."""

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from flexik.datasets.parts import Columns, Part, Work, Writer, text_file
from flexik.learning.examples import Examples
from flexik.learning.fit import restarts_csv
from flexik.learning.torch_module import best, code_of, train
from flexik.learning.torch_storage import module_file, packed, unpacked
from flexik.machines.planar import PlanarMachine
from flexik.parameters.networks import TorchModule
from flexik.parameters.trainers import Adam, Lbfgs
from flexik.planar.section import PlanarSection
from flexik.planar.train import based_on, data_inputs, described
from flexik.planar.train_regressor import examples


def part(section: PlanarSection, name: str) -> Part:
    """Module `name`: files as those of a network."""
    given = section.networks[name]
    assert isinstance(given, TorchModule)
    settings = described(section, name) | {
        "module": given.module,
        "n_restarts": given.n_restarts,
        "trainers": [section.trainers[trainer] for trainer in given.trainers],
        "device": given.device,
    }
    code = {"code": code_of(given.module)}
    return Part(name, prepare, settings, data_inputs(section, name) | code)


def prepare(
    *,
    machine: PlanarMachine,
    kind: str,
    module: Mapping[str, Any],
    n_restarts: int,
    trainers: Sequence[Adam | Lbfgs],
    device: str,
    seed: int,
    grid: Path,
    selection: Path,
    code: Path,
    **model: Any,
) -> Work:
    """A start is an item; `model` is what `based_on` takes."""
    taught = examples(kind, machine, grid, selection, based_on(machine, **model))
    layers = tuple(module.get("n_hidden", ()))

    def finish(results: list[Columns]) -> Mapping[str, Writer]:
        runs = [unpacked(result) for result in results]
        usable = [(found, record) for found, record in runs if found is not None]
        return {
            ".json": module_file([best(runs)]),
            ".restarts.json": module_file(usable),
            ".restarts.csv": text_file(restarts_csv([record for _, record in runs], layers)),
        }

    learn = functools.partial(_learn, taught, module, trainers, seed, device)
    return Work(learn, range(n_restarts), finish)


def _learn(
    taught: Examples,
    module: Mapping[str, Any],
    trainers: Sequence[Adam | Lbfgs],
    seed: int,
    device: str,
    restart: int,
) -> Columns:
    return packed(*train(module, taught, trainers, seed, restart, device))
