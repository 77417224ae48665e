"""Speed of generating crane samples, beside Exudyn's processing.ParameterVariation."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import table_grid
from exudyn.processing import ParameterVariation
from joblib.externals.loky import get_reusable_executor
from numpy.typing import NDArray

from flexik.datasets.crane.grid import INPUTS, KEPT, GridParts
from flexik.errors import FlexikError, SolverError
from flexik.kinematics.crane import forward
from flexik.multibody.crane.model import CraneModel

Array = NDArray[np.float64]

N_PROCESSES = 2
TIP_TOLERANCE = 1e-6  # m


@dataclass(frozen=True)
class Timing:
    """One run: wall and CPU time in s; CPU time of the main process alone."""

    wall: float
    cpu: float


def one_model_per_vector(parameter_set: dict[str, Any]) -> tuple[float, float]:
    """Tip in m for ParameterVariation: builds a model, solves it once; NaN if it is left out."""
    strokes = np.array([parameter_set[name] for name in ("lift", "jib", "extension")])
    crane = table_grid.model()
    if forward(crane.geometry, strokes[None])[0, 0] < table_grid.parameters().grid.minimum_tip_x:
        return np.nan, np.nan
    system = CraneModel(crane, float(strokes[2]))
    try:
        system.place(strokes)
        system.solve(parameter_set["payload"])
    except SolverError:
        return np.nan, np.nan
    x, y = system.tip()
    return float(x), float(y)


def parameter_variation(parts: GridParts, n_processes: int) -> Array:
    """Tips (n, 2) in m by way (a), in the order of `parts`."""
    # extension slowest, payload fastest: the last parameter varies first
    order = ("extension", "lift", "jib", "payload")
    axes = {name: [float(v) for v in getattr(parts, name)] for name in order}
    _, values = ParameterVariation(
        one_model_per_vector,
        axes,
        useMultiProcessing=n_processes > 1,
        numberOfThreads=n_processes,
        showProgress=False,
    )
    return np.array(values)


def flexik_tips(parts: GridParts, n_processes: int) -> Array:
    """Tips (n, 2) in m by this package."""
    return table_grid.run(parts, n_processes)[["tip_x", "tip_y"]].to_numpy()


# By name in the .json: a name for people, the number of processes and the function. The order
# counts: flexik_cold starts the worker processes, which flexik_2 finds
WAYS: dict[str, tuple[str, int, Callable[[GridParts, int], Array]]] = {
    "flexik_1": ("flexik", 1, flexik_tips),
    "variation_1": ("(a) ParameterVariation", 1, parameter_variation),
    "flexik_cold": ("flexik, processes started anew", N_PROCESSES, flexik_tips),
    "flexik_2": ("flexik, processes there", N_PROCESSES, flexik_tips),
    "variation_2": ("(a) ParameterVariation", N_PROCESSES, parameter_variation),
}
COMPARED = {
    "flexik_1": "variation_1",
    "flexik_cold": "variation_2",
    "flexik_2": "variation_2",
}


def timed(function: Callable[[], Array]) -> tuple[Timing, Array]:
    """Run `function` once."""
    wall, cpu = time.perf_counter(), time.process_time()
    tips = function()
    return Timing(time.perf_counter() - wall, time.process_time() - cpu), tips


def measure_speed(parts: GridParts, n_repeats: int) -> dict[str, float]:
    """Medians over `n_repeats` of all ways, flat; raises FlexikError if their tips differ."""
    table = table_grid.run(parts, 1)
    kept = (table["status"] == KEPT).to_numpy()
    expected = table[["tip_x", "tip_y"]].to_numpy()
    n = int(kept.sum())
    worst = 0.0
    timings: dict[str, list[Timing]] = {name: [] for name in WAYS}
    for repeat in range(n_repeats):
        get_reusable_executor().shutdown(wait=True)  # the pool of flexik_cold must not be there
        for name, (_, n_processes, function) in WAYS.items():
            timing, tips = timed(partial(function, parts, n_processes))
            worst = max(worst, largest_difference(name, tips, expected))
            timings[name].append(timing)
            print(f"repeat {repeat + 1}: {name} {n / timing.wall:.0f} a second")
    figures: dict[str, float] = {
        "n_vectors": parts.n_samples,
        "n_kept": n,
        "n_repeats": n_repeats,
        "largest_tip_difference": worst,
    }
    for name, runs in timings.items():
        wall = np.array([run.wall for run in runs])
        figures[f"seconds_{name}"] = float(np.median(wall))
        figures[f"rate_{name}"] = float(np.median(n / wall))
        figures[f"rate_{name}_slowest"] = float(np.min(n / wall))
        figures[f"rate_{name}_fastest"] = float(np.max(n / wall))
        if WAYS[name][1] == 1:
            figures[f"rate_cpu_{name}"] = float(np.median([n / run.cpu for run in runs]))
        if name in COMPARED:
            other = np.array([run.wall for run in timings[COMPARED[name]]])
            figures[f"ratio_{name}"] = float(np.median(other / wall))
            figures[f"ratio_{name}_lowest"] = float(np.min(other / wall))
    return figures


def largest_difference(name: str, tips: Array, expected: Array) -> float:
    """Largest tip distance in m; raises FlexikError if it, or what is solved, is not the same."""
    if not np.array_equal(np.isnan(tips), np.isnan(expected)):
        raise FlexikError(f"{name}: other samples are solved or left out than by flexik")
    difference = float(np.nanmax(np.linalg.norm(tips - expected, axis=1)))
    if difference > TIP_TOLERANCE:
        raise FlexikError(f"{name}: tips differ by {difference:.3g} m, above {TIP_TOLERANCE} m")
    return difference


def measure_steps(parts: GridParts, n_vectors: int = 200) -> dict[str, float]:
    """Where (a) spends its time: median milliseconds to build, place and solve a model."""
    table = table_grid.run(parts, 1)
    rows = table.loc[table["status"] == KEPT, list(INPUTS)].sample(n_vectors, random_state=0)
    times = []
    for *strokes, payload in rows.to_numpy():
        start = time.perf_counter()
        system = CraneModel(table_grid.model(), float(strokes[2]))
        built = time.perf_counter()
        system.place(np.array(strokes))
        placed = time.perf_counter()
        system.solve(float(payload))
        times.append([built - start, placed - built, time.perf_counter() - placed])
    build, place, solve = 1e3 * np.median(times, axis=0)
    return {"build_ms": float(build), "place_ms": float(place), "solve_ms": float(solve)}
