"""How much the peaks of the SmartEE's networks hang on which poses are drawn."""

import numpy as np
import pandas as pd

from flexik.parameters.smartee import BEST, PUBLISHED, RANDOM, VALIDATION
from flexik.reporting.smartee.results import QUANTITIES, Results

# The better network is to be this many times below the published peaks
MARGIN = 10.0
GOALS = {PUBLISHED: 1.0, BEST: MARGIN}


def drawn_peaks(results: Results, name: str) -> dict[str, np.ndarray]:
    """Peaks (n_draws,) of network `name`, in published units, by quantity."""
    draws = results.smartee.draws
    n_poses = results.smartee.poses[VALIDATION].n_poses
    table = results.of(name, 0, RANDOM)
    generator = np.random.default_rng(draws.seed)
    rows = generator.integers(0, len(table), (draws.n_draws, n_poses))
    return {
        quantity: results.factor(quantity) * table[column].to_numpy()[rows].max(axis=1)
        for quantity, column in QUANTITIES.items()
    }


def draws(results: Results) -> pd.DataFrame:
    """A row for every network with a goal and quantity, and one for all three at once."""
    rows: list[dict[str, object]] = []
    for name, margin in GOALS.items():
        met = []
        for quantity, peaks in drawn_peaks(results, name).items():
            unit, factor = results.shown(quantity)
            goal = results.published_peak(quantity) / margin
            met.append(peaks <= goal)
            low, middle, high = factor * np.quantile(peaks, (0.05, 0.5, 0.95))
            row = {"network": name, "error": f"{quantity} ({unit})", "goal": factor * goal}
            row |= {"5 %": low, "median": middle, "95 %": high}
            rows.append(row | {"meets (%)": 100.0 * met[-1].mean()})
        blank = dict.fromkeys(("goal", "5 %", "median", "95 %"), np.nan)
        share = 100.0 * np.all(met, axis=0).mean()
        rows.append({"network": name, "error": "all three", **blank, "meets (%)": share})
    return pd.DataFrame(rows)


def draw_notes(results: Results) -> list[str]:
    """What the one draw of the validation is worth."""
    table = draws(results)
    shares = table[table["error"] == "all three"].set_index("network")["meets (%)"]
    listed = ", ".join(f"`{name}` in {share:.0f} %" for name, share in shares.items())
    return [
        f"Whether all three goals are met hangs on the draw: {listed} of the draws. The validation "
        "is one of them.",
        "How the paper chose its validation poses is not published: uniform random ones are "
        "assumed, which rarely come near the corners of the box, where the errors are largest.",
    ]
