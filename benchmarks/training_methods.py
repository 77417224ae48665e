"""Error against time of the training methods of the thesis: Levenberg-Marquardt, back-propagation.

The deflection network in its published size, all trainers from the same starts; one core a run.
Rouvinen 1999, chapter 4.1: Levenberg-Marquardt was used "but back-propagation was also tried".

    python benchmarks/training_methods.py

Needs `make repro` for data/crane. Writes reports/benchmarks/training_methods.csv (the curves from
the first start) and .md (all runs).
"""

from machine import pinned_pool, remark

# isort: split
import itertools
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from training_data import ACTIVATION, SEED, case, crane_lesson

from flexik import stage
from flexik.errors import DataError
from flexik.files import write_text
from flexik.learning.problem import problem
from flexik.learning.stopping import Monitor, StopReason
from flexik.learning.training import TRAINERS
from flexik.learning.weights import Weights
from flexik.parameters.trainers import (
    BackPropagation,
    LevenbergMarquardt,
    LevenbergMarquardtAccelerated,
    Stopping,
)
from flexik.reporting.tables import Table

Array = NDArray[np.float64]

OUTPUT = Path("reports/benchmarks/training_methods")
NETWORK, N_HIDDEN = "deflection", 14
N_PROCESSES = 2
N_ROWS = 200  # of a curve, at most

STARTS = (0, 1)
LIMIT = 60.0  # s, back-propagation
# its learning rates are chosen from another start, in this time each
RATES_START, RATES_LIMIT = 2, 5.0
RATES = {
    "back-propagation, batch": (0.05, 0.2, 0.8, 3.2),
    "back-propagation, pattern": (0.001, 0.003, 0.01, 0.03),
}
TIMES = (1.0, 10.0, 60.0)  # s, columns of the table

# the published schedule and the accelerated one end by their own rules, back-propagation by time
LONG = BackPropagation(n_iterations=10**7, minimum_gradient=0.0)
METHODS: dict[str, Stopping] = {
    "Levenberg-Marquardt": LevenbergMarquardt(minimum_progress=1e-4),
    "Levenberg-Marquardt, accelerated": LevenbergMarquardtAccelerated(),
    "back-propagation, batch": LONG,
    "back-propagation, pattern": LONG.but(mode="pattern"),
}
DECIMALS = {"ended after (s)": 2, "to best back-propagation (s)": 3}
DECIMALS |= {f"after {seconds:g} s": 4 for seconds in TIMES}


@dataclass(frozen=True, eq=False)
class Curve:
    """A run: the least error (n,) so far at seconds (n,), one for every iteration.

    Errors are root mean squares of the normalised outputs; the first is that of the start, at 0 s.
    """

    label: str
    start: int
    seconds: Array
    errors: Array
    stop_reason: str

    def at(self, seconds: float) -> float:
        """Error after `seconds`; the last one where the run ended before."""
        return float(self.errors[np.searchsorted(self.seconds, seconds, side="right") - 1])

    def seconds_to(self, error: float) -> float | None:
        """Seconds until the error is `error` or less, if ever."""
        reached = self.errors <= error
        return float(self.seconds[np.argmax(reached)]) if reached.any() else None

    def thinned(self, n_rows: int) -> pd.DataFrame:
        """At most `n_rows` rows: first and last, and the state at times in equal ratios between.

        Columns trainer, start, seconds, error.
        """
        rows = np.arange(len(self.seconds))
        if len(rows) > n_rows:
            times = np.geomspace(self.seconds[1], self.seconds[-1], n_rows - 1)[:-1]
            states = np.searchsorted(self.seconds, times, side="right") - 1
            rows = np.unique([rows[0], *states, rows[-1]])
        columns = {"seconds": self.seconds[rows], "error": self.errors[rows]}
        return pd.DataFrame({"trainer": self.label, "start": self.start} | columns)


def run(label: str, start: int, options: dict[str, Any]) -> Curve:
    """Train by `label` of METHODS, changed by `options`; for one process with one core."""
    with threadpool_limits(1):
        _timed(label, start, options | {"n_iterations": 2})  # loads what loads late
        curve = _timed(label, start, options)
    print(f"{label}, start {start}, {options}: {curve.errors[-1]:.4f}", flush=True)
    return curve


def _timed(label: str, start: int, options: dict[str, Any]) -> Curve:
    settings = METHODS[label].but(**options)
    minimise, ends = TRAINERS[settings.kind], list[float]()

    class Timed(Monitor):
        """Notes when each iteration ends, for the record has the time of the whole run only."""

        def add(self, weights: Weights, error: float) -> StopReason | None:
            ends.append(time.perf_counter())
            return super().add(weights, error)

    given = case(NETWORK, N_HIDDEN, start)
    # one of its own, for a problem remembers the last pass
    own = problem(ACTIVATION, given.inputs, given.targets)
    generator = np.random.default_rng((SEED, start))
    with patch.object(sys.modules[minimise.__module__], "Monitor", Timed):
        found = minimise(given.start, own, settings, generator)
    errors = np.minimum.accumulate(np.sqrt(found.errors))
    # an error that is not finite is noted and not kept
    seconds = np.array(ends[: len(errors)]) - ends[0]
    return Curve(label, start, seconds, errors, str(found.stop_reason))


def chosen_rates(pool: ProcessPoolExecutor) -> dict[str, float]:
    """The learning rate of RATES with the least error after RATES_LIMIT, by label."""
    futures = {
        (label, rate): pool.submit(run, label, RATES_START, _limited(rate, RATES_LIMIT))
        for label, rates in RATES.items()
        for rate in rates
    }
    errors = {key: future.result().errors[-1] for key, future in futures.items()}
    return {
        label: min(rates, key=lambda rate: float(errors[label, rate]))
        for label, rates in RATES.items()
    }


def _limited(rate: float, seconds: float) -> dict[str, float]:
    return {"learning_rate": rate, "maximum_seconds": seconds}


def table(curves: Sequence[Curve]) -> pd.DataFrame:
    """A row for every run."""
    rows: list[dict[str, Any]] = []
    for curve in curves:
        rivals = [one for one in curves if one.start == curve.start and one.label in RATES]
        row: dict[str, Any] = {"trainer": curve.label, "start": curve.start}
        row |= {f"after {seconds:g} s": curve.at(seconds) for seconds in TIMES}
        row |= {
            "iterations": len(curve.errors) - 1,
            "ended after (s)": float(curve.seconds[-1]),
            "ended by": curve.stop_reason,
            "to best back-propagation (s)": None
            if curve.label in RATES
            else curve.seconds_to(min(float(one.errors[-1]) for one in rivals)),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def notes(curves: Sequence[Curve], rates: dict[str, float]) -> list[str]:
    """What the table means."""
    batch, pattern = (
        next(curve for curve in curves if (curve.label, curve.start) == (label, STARTS[0]))
        for label in RATES
    )
    n_passes = min(len(batch.errors), len(pattern.errors)) - 1
    tried = "; ".join(
        f"{label} {rates[label]:g} of {', '.join(f'{rate:g}' for rate in known)}"
        for label, known in RATES.items()
    )
    return [
        "Errors: root mean square of the normalised outputs over the training data, the least so "
        "far, which is that of the network a run keeps; after a run has ended, its last.",
        "Default settings; Levenberg-Marquardt ends by its own rules, back-propagation after "
        f"{LIMIT:g} s alone. All begin with the same weights.",
        f"Learning rates, the best from start {RATES_START} after {RATES_LIMIT:g} s: {tried}. Both "
        "modes have momentum and the variable rate (up after a better pass, down and the pass "
        "undone after one that is much worse); in pattern mode this goes beyond equations 51 to "
        "54, whose rate is constant.",
        "An iteration is an accepted step or a kept pass over the data. A pass in pattern mode "
        "is a Python loop over the samples, and most of its time is not arithmetic: from start "
        f"{STARTS[0]}, {n_passes} passes bring it to {pattern.errors[n_passes]:.4f}, and batch "
        f"mode to {batch.errors[n_passes]:.4f}.",
        "Times are measured at the end of every iteration, from the error of the start on. 'to "
        "best back-propagation': until the error is that with which the better mode ended from "
        "the same start. The curves beside this table are those from start "
        f"{STARTS[0]}, thinned to {N_ROWS} rows each at most.",
        remark(N_PROCESSES, "numpy"),
    ]


def main() -> None:
    """Measure and report."""
    try:
        crane_lesson(NETWORK)
    except DataError as error:
        raise DataError(f"run `make repro` first: {error}") from error
    started = time.perf_counter()
    with pinned_pool(N_PROCESSES) as pool:
        rates = chosen_rates(pool)
        futures = []
        for label, start in itertools.product(METHODS, STARTS):
            options = _limited(rates[label], LIMIT) if label in RATES else {}
            futures.append(pool.submit(run, label, start, options))
        curves = [future.result() for future in futures]
    remarks = notes(curves, rates)
    caption = f"Training the {NETWORK} network with {N_HIDDEN} hidden neurons: error against time."
    text = Table(table(curves), DECIMALS).markdown(caption, remarks)
    # one line for each trainer: a figure that joins two starts would mean nothing
    thinned = pd.concat([curve.thinned(N_ROWS) for curve in curves if curve.start == STARTS[0]])
    rows = thinned.to_csv(index=False, float_format="%.6g", lineterminator="\n")
    write_text(OUTPUT.with_suffix(".csv"), rows)
    write_text(OUTPUT.with_suffix(".md"), text)
    print(text)
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    stage.run(main)
