"""Any planar machine of a file in static equilibrium, at many coordinates at once."""

from collections.abc import Callable
from typing import Any

import numpy as np

from flexik.errors import SolverError
from flexik.machines.sections import Array
from flexik.multibody.beams import Elements
from flexik.multibody.elements import neighbours
from flexik.multibody.flexible import FlexibleMachine, failed
from flexik.multibody.model import PlanarModel

# Pads this close touch the same place, m
SAME_PLACE = 1e-9

Read = Callable[[PlanarModel], Array]
Settle = Callable[[PlanarModel, float, int], None]


def solve(
    machine: FlexibleMachine,
    values: Array,
    payload: Array,
    read: Read | None = None,
    size: int = 2,
    settle: Settle | None = None,
) -> tuple[Array, dict[int, SolverError]]:
    """Tip (n, 2) in m at coordinates (n, k) with `payload` (n,) in kg, and the rows that failed.

    Rows whose meshes have the same layout share one system, each starting from a neighbour. Which
    one that is, and so which other rows are asked for, changes a tip by less than 1e-7 m (7e-5 mm
    on the crane), as Newton's method stops at a tolerance. A row without equilibrium holds NaN and
    is in the second result, with an error that names its coordinates and payload. `read` takes
    something else than the tip, `size` numbers, from the model of every row; `settle` finds the
    equilibrium in place of `PlanarModel.solve`, told the number of the row.
    """
    read = read or PlanarModel.tip
    values, payload = np.atleast_2d(values), np.atleast_1d(payload)
    poses = machine.linkage.poses(values)
    closed = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    failures = {
        int(k): failed(machine, values[k], "cannot be assembled") for k in np.flatnonzero(~closed)
    }
    order = neighbours(values, payload)
    order = order[closed[order]]
    touched, sliding = machine.touched(poses), machine.sliding
    # where pads have moved along; poses of equal strokes differ by round-off
    steps = np.abs(np.diff(touched[order], axis=0, prepend=np.inf))
    changed = order[steps.max(axis=(1, 2, 3), initial=0.0) > SAME_PLACE]
    meshes = dict(zip(changed.tolist(), machine.meshes(touched[changed], sliding), strict=True))
    models: dict[Any, PlanarModel] = {}
    found: dict[int, Array] = {}
    new: dict[str, Elements] = {}
    for k in order.tolist():
        new = meshes.get(k, new)
        layout = tuple((len(mesh.stations), *mesh.pins) for mesh in new.values())
        if layout not in models:
            models[layout] = PlanarModel(machine, touched[k])
        model = models[layout]
        try:
            if not np.array_equal(values[k], model.values):
                model.slide(new, touched[k])
                model.place(values[k], poses[k])
            if settle is None:
                model.solve(float(payload[k]))
            else:
                settle(model, float(payload[k]), k)
            found[k] = read(model)
        except SolverError as error:
            failures[k] = error
    result = np.full((len(values), size), np.nan)
    for k, of_row in found.items():
        result[k] = of_row
    return result, dict(sorted(failures.items()))


def tips(machine: FlexibleMachine, values: Array, payload: Array) -> Array:
    """Tip (n, 2) in m as by `solve`; raises the SolverError of the first row that fails."""
    result, failures = solve(machine, values, payload)
    if failures:
        raise next(iter(failures.values()))
    return result


def shapes(
    machine: FlexibleMachine, values: Array, payload: float
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Node positions (m, 2) in m by beam at coordinates (k,): rigid, and with `payload` in kg.

    Raises SolverError as `tips` does.
    """
    model = PlanarModel.placed(machine, values)
    rigid = model.shapes()
    model.solve(payload)
    return rigid, model.shapes()
