"""Time to equal error from equal starts: this package beside the peers, one core each."""

from machine import installed

# isort: split
import math
import statistics
from dataclasses import dataclass, field
from typing import Any

import training_data
from threadpoolctl import threadpool_limits
from training_data import Case, Finished, Watch, case, crane_lesson, endless, run_ours
from training_peers import PEERS, silent

from flexik.errors import FlexikError
from flexik.parameters.trainers import Stopping


@dataclass(frozen=True)
class Race:
    """Network, size, root mean square errors to reach, seconds a peer has, number of starts.

    The targets are what the published schedule reaches in 30 iterations and in `n_published`
    (median of three starts, rounded up).
    """

    network: str
    n_hidden: int
    loose: float
    tight: float
    n_published: int
    limit: float
    n_starts: int

    @property
    def name(self) -> str:
        """Of the figures in the .json."""
        return f"{self.network}_{self.n_hidden}"


# the longest come first, so that two processes end at about the same time
RACES = (
    Race("deflection", 30, 2.2e-2, 7.2e-3, 300, 25.0, 3),
    Race("direct", 30, 1.2e-2, 2.4e-3, 300, 25.0, 3),
    Race("deflection", 60, 1.8e-2, 6.6e-3, 100, 20.0, 1),
    Race("direct", 60, 5.8e-3, 2.8e-3, 100, 20.0, 1),
    Race("deflection", 14, 3.7e-2, 2.2e-2, 300, 8.0, 1),
    Race("direct", 14, 3.4e-2, 8.0e-3, 300, 8.0, 1),
)
QUICK_RACES = (
    Race("deflection", 30, 2.2e-2, 1.1e-2, 100, 8.0, 1),
    Race("direct", 30, 1.2e-2, 5.4e-3, 100, 8.0, 1),
)

OURS, PUBLISHED = "ours", "published"
TRAINERS: dict[str, type[Stopping]] = {OURS: training_data.OURS, PUBLISHED: training_data.PUBLISHED}
# iterations this package gets; its goals stop it before
AT_MOST = {OURS: 500, PUBLISHED: 600}
LABELS = {OURS: "flexik, accelerated", PUBLISHED: "flexik, published schedule"} | {
    name: peer.label for name, peer in PEERS.items()
}


@dataclass
class Runs:
    """All runs of one trainer in a race.

    Attributes
    ----------
    to_loose, to_tight : seconds, one a start; inf where it did not get there
    best : least errors, one a start
    remark : why there is no run, or how it ended
    """

    to_loose: list[float] = field(default_factory=list)
    to_tight: list[float] = field(default_factory=list)
    best: list[float] = field(default_factory=list)
    remark: str = ""


def run_race(race: Race) -> dict[str, Runs]:
    """All trainers from all starts, by name; for one process with one core.

    This package runs again before every peer: a machine that is busy is so for all. A peer that
    does not reach the tight target from the first start does not run from the others.
    """
    runs = {name: Runs() for name in LABELS}
    with threadpool_limits(1), silent():
        _own(race, OURS, 0)  # loads what loads late
        for start in range(race.n_starts):
            own: list[tuple[float, float, float]] = []
            for name, peer in PEERS.items():
                entry = runs[name]
                if installed(peer.package) is None:
                    entry.remark = "not installed"
                elif start == 0 or math.isfinite(entry.to_tight[0]):
                    own.append(_own(race, OURS, start))
                    _peer(race, name, case(race.network, race.n_hidden, start), entry)
                    print(_line(race, start, name, entry), flush=True)
            own.append(_own(race, OURS, start))
            _add(runs[OURS], [statistics.median(values) for values in zip(*own, strict=True)])
            _add(runs[PUBLISHED], _own(race, PUBLISHED, start))
            for name in (OURS, PUBLISHED):
                print(_line(race, start, name, runs[name]), flush=True)
    return runs


def _own(race: Race, trainer: str, start: int) -> tuple[float, float, float]:
    """Seconds to both targets, a run each, and the error of the longer."""
    seconds, error, data = [], math.inf, crane_lesson(race.network)
    for target in (race.loose, race.tight):
        limits = {"n_iterations": AT_MOST[trainer], "goal": target**2}
        settings = endless(TRAINERS[trainer], **limits)
        _, errors, used = run_ours(data.inputs, data.outputs, race.n_hidden, settings, start)
        error = math.sqrt(min(errors))
        seconds.append(used if error <= target else math.inf)
    return seconds[0], seconds[1], error


def _peer(race: Race, name: str, case: Case, entry: Runs) -> None:
    watch = Watch((race.loose, race.tight), race.limit)
    remark = "ended by itself"
    try:
        PEERS[name].run(case, watch)
    except Finished:
        remark = ""
    except Exception as error:
        # a peer that breaks must not take the benchmark along; the table says so
        remark = f"{type(error).__name__}: {str(error).partition(chr(10))[0][:60]}"
    if not (math.isnan(watch.first) or math.isclose(watch.first, case.start_error, rel_tol=1e-9)):
        raise FlexikError(
            f"{name} begins with the error {watch.first}, expected that of the start, "
            f"{case.start_error}"
        )
    seconds = [watch.reached.get(target, math.inf) for target in (race.loose, race.tight)]
    _add(entry, [*seconds, watch.best])
    entry.remark = entry.remark or remark


def _add(entry: Runs, found: Any) -> None:
    for values, value in zip((entry.to_loose, entry.to_tight, entry.best), found, strict=True):
        values.append(value)


def _line(race: Race, start: int, name: str, entry: Runs) -> str:
    seconds = f"{entry.to_loose[-1]:.3f} s, {entry.to_tight[-1]:.3f} s"
    return f"{race.name} start {start}: {LABELS[name]} {seconds}, best {entry.best[-1]:.2e}"


def speedups(race: Race, runs: dict[str, Runs], target: str = "to_tight") -> list[float]:
    """Seconds of the fastest peer over ours, one a start; a lower bound where none got there."""
    ratios = []
    for start, own in enumerate(getattr(runs[OURS], target)):
        times = [getattr(runs[name], target)[start : start + 1] for name in PEERS]
        fastest = min([race.limit, *(time for one in times for time in one)])
        ratios.append(fastest / own)
    return ratios
