"""Records of the restarts of a network as a table."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from flexik.learning.training import TrainingRecord


def restarts_csv(records: Sequence[TrainingRecord], n_hidden: int | tuple[int, ...]) -> str:
    """CSV, a row a restart; errors are root mean squares of normalised outputs."""
    rows = [
        {
            "restart": record.restart,
            "n_hidden": n_hidden,
            "trainer": record.trainer,
            "n_iterations": len(record.errors) - 1,
            "training_error": np.sqrt(record.errors[record.kept]) if record.errors else np.nan,
            "selection_error": record.selection_error,
            "stop_reason": record.stop_reason,
        }
        for record in records
    ]
    return pd.DataFrame(rows).to_csv(index=False)
