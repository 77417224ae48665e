"""Tables of training and size selection in the log crane's report."""

from pathlib import Path

import pandas as pd

from flexik.datasets.crane.grid import kept
from flexik.datasets.crane.learning import KINDS, learnt_rows
from flexik.learning.size_rules import haykin, haykin_samples, oja
from flexik.kinematics.crane import CraneGeometry
from flexik.reporting import tables
from flexik.reporting.crane.results import Results

SIZE_TABLE = [
    "n_hidden",
    "training_error",
    "selection_error",
    "median_selection_error",
    "worst_selection_error",
    "best_restart",
    "n_failed",
]
RACE_TIMES = (0.1, 1.0, 10.0, 60.0)  # s
# share of wrong answers permitted in equation 58
ERROR_FRACTION = 0.1


def write_tables(results: Results, folder: Path) -> None:
    """Write every table as CSV and Markdown."""
    _write_training(results, folder)
    _write_training_race(results, folder)
    for name in results.studies:
        _write_sizes(results, name, folder)
    _write_size_rules(results, folder)


def _write_training(results: Results, folder: Path) -> None:
    caption = (
        "Every restart of every network: root mean square errors of the normalised outputs on the "
        "training grid and on the selection set, which chooses. The selection error can be the "
        "smaller: the grid puts many samples at the ends of strokes and payload, where networks "
        "fit worst; the selection set is drawn uniformly. Of a modular network, the correction."
    )
    decimals = {"training error": 4, "selection error": 4}
    training = results.training.rename(columns=lambda name: name.replace("_", " "))
    tables.write_table(folder / "training", training, decimals, caption)


def _write_training_race(results: Results, folder: Path) -> None:
    """Error of each trainer after some times."""
    rows = []
    for trainer, curve in results.training_curves.groupby("trainer", sort=False):
        row: dict[str, object] = {"trainer": trainer}
        for seconds in RACE_TIMES:
            done = curve[curve["seconds"] <= seconds]
            row[f"after {seconds:g} s"] = None if done.empty else done["error"].iloc[-1]
        last = curve.iloc[-1]
        rows.append(row | {"at its end": last["error"], "ended after (s)": last["seconds"]})
    caption = (
        "Training the deflection network of published size from one start: root mean square error "
        "of the normalised outputs on the training grid."
    )
    notes = [
        "Measured apart from the pipeline (`make benchmark-positioning`) and thinned; more starts "
        "and how "
        "back-propagation got its rates: reports/benchmarks/training_methods.md."
    ]
    decimals = {f"after {seconds:g} s": 4 for seconds in RACE_TIMES} | {"at its end": 4}
    table = pd.DataFrame(rows)
    tables.write_table(folder / "training_race", table, decimals, caption, notes)


def _write_sizes(results: Results, name: str, folder: Path) -> None:
    sizes, chosen = results.studies[name]
    select = results.crane.studies[name].select
    caption = (
        f"{name}: root mean square errors of the normalised outputs by number of hidden neurons; "
        f"best restart of {select.n_restarts} by selection error."
    )
    n_hidden = list(sizes["n_hidden"])
    notes = [f"chosen: {chosen}, published: {results.published_size(name)}"]
    if chosen in (n_hidden[0], n_hidden[-1]):
        notes.append(
            "The choice lies at the end of the range: a wider range may have a better size."
        )
    table = sizes[SIZE_TABLE].rename(columns=lambda column: column.replace("_", " "))
    decimals = {str(column): 5 for column in table if "error" in str(column)}
    tables.write_table(folder / "size_selection" / name, table, decimals, caption, notes)


def _write_size_rules(results: Results, folder: Path) -> None:
    """What rules of thumb would have chosen."""
    geometry = CraneGeometry(**results.crane.geometry.model_dump())
    grid, rows = kept(results.grid), []
    for name, (_, chosen) in results.studies.items():
        kind = results.network(name).kind
        n_samples = len(learnt_rows(grid, kind, geometry))
        n_inputs, n_outputs = len(KINDS[kind].inputs), len(KINDS[kind].outputs)
        rows.append(
            {
                "network": name,
                "learns": kind,
                "samples": n_samples,
                "published": results.published_size(name),
                "chosen": chosen,
                "Oja (57)": round(oja(n_samples, n_inputs, n_outputs)),
                "Haykin (58)": haykin(n_samples, n_inputs, n_outputs, ERROR_FRACTION),
                "samples (58) asks for": round(
                    haykin_samples(n_inputs, chosen, n_outputs, ERROR_FRACTION)
                ),
            }
        )
    caption = "Hidden neurons: published, of least selection error, and by two rules of thumb."
    notes = [
        "Oja (57): samples over five times inputs and outputs. Haykin (58): the largest network "
        f"that so many samples allow, for a share of {ERROR_FRACTION:g} of wrong answers; it is "
        "made for classification, and here allows none. Last column: the samples that it asks for "
        "with the chosen size.",
    ]
    table = pd.DataFrame(rows)
    tables.write_table(folder / "size_rules", table, 0, caption, notes)
