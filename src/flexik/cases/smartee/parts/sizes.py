"""Networks of the SmartEE's elbows of many sizes: error against the number of hidden neurons."""

from pathlib import Path

from flexik.cases.smartee.parts.train import lesson
from flexik.cases.smartee.section import SizeStudy
from flexik.datasets.parts import Work
from flexik.learning.size_selection import select
from flexik.learning.training import Architecture
from flexik.parameters.trainers import Stopping


def prepare_sizes(*, study: SizeStudy, trainer: Stopping, rows: Path, selection: Path) -> Work:
    """Train networks of all sizes, from several starts each."""
    sizes = [(n_hidden,) for n_hidden in study.n_hidden.values()]
    task = lesson(Architecture(sizes[0]), trainer, study.seed, rows, selection)
    return select(task, sizes, study.n_restarts, tolerance=None)
