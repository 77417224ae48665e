"""Errors of a measuring campaign, from its targets and from the points reached without load.

Rouvinen (1999), chapter 4.6: every point is approached with every payload, without compensation and
with it; table 4.2 has the errors from the targets, table 4.3 those from the points reached with
0 kg and compensation, which leave out what the rigid model has wrong.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from flexik.datasets.crane_measured.campaign import (
    METHODS,
    REFERENCE_METHOD,
    REFERENCE_PAYLOAD,
    TARGET,
)
from flexik.errors import DataError
from flexik.evaluation.errors import STATISTICS
from flexik.positioning.method import checked

KEYS = [*TARGET, "payload"]
ALL = "all"


def column(method: str, payload: float | None) -> str:
    """Name of a column of `campaign_table`: `none_86_kg`; `none_all` where `payload` is None."""
    return f"{method}_{ALL}" if payload is None else f"{method}_{payload:g}_kg"


def campaign_errors(
    targets: ArrayLike, payload: ArrayLike, reached: ArrayLike, reference: ArrayLike | None = None
) -> pd.DataFrame:
    """Errors of the points reached, one row a measurement.

    Parameters
    ----------
    targets
        Theoretical targets (m, 2) in m.
    payload
        Payload (m,) in kg.
    reached
        Measured points (m, 2) in m.
    reference
        Points (m, 2) in m to count the errors from; the targets themselves if None.

    Returns
    -------
    DataFrame
        Columns point (0, 1, ... in the order in which the targets first come), target_x, target_y,
        payload, reached_x, reached_y, error_x, error_y (reference minus reached) and error (its
        length). SI units.

    Raises
    ------
    PositioningError
        If an array has another shape or is not finite.
    """
    targets = checked("targets", targets, None, 2)
    reached = checked("reached points", reached, len(targets), 2)
    payload = checked("payload", payload, len(targets))
    start = targets if reference is None else checked("reference", reference, len(targets), 2)
    error = start - reached
    return pd.DataFrame(
        {
            "point": pd.factorize(pd.Series(list(map(tuple, targets))))[0].astype(np.int64),
            "target_x": targets[:, 0],
            "target_y": targets[:, 1],
            "payload": payload,
            "reached_x": reached[:, 0],
            "reached_y": reached[:, 1],
            "error_x": error[:, 0],
            "error_y": error[:, 1],
            "error": np.hypot(error[:, 0], error[:, 1]),
        }
    )


def split_campaign(campaign: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Frames of `campaign_errors` from the targets, by method, of a measured campaign.

    Parameters
    ----------
    campaign
        Frame of datasets.crane_measured.campaign.read_campaign with its columns method, target_x
        and target_y.

    Returns
    -------
    dict
        A frame for each of METHODS; points numbered as they first come in the campaign, rows by
        point and payload, so that the frames agree row by row.

    Raises
    ------
    DataError
        If the campaign has strokes alone, or the conditions of the methods differ or repeat.
    """
    if missing := [name for name in ("method", *TARGET) if name not in campaign]:
        raise DataError(f"campaign: expected the columns {missing} too, to tell the errors")
    order = pd.factorize(pd.Series(list(map(tuple, campaign[TARGET].to_numpy()))))[0]
    ordered = campaign.assign(order=order).sort_values(["order", "payload"], kind="stable")
    frames = {}
    for method in METHODS:
        rows = ordered[ordered["method"] == method]
        frames[method] = campaign_errors(
            rows[TARGET], rows["payload"], rows[["measured_x", "measured_y"]]
        )
    _check_frames(frames)
    return frames


def reference_errors(frames: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Errors from the point that `combined` reached with 0 kg at the same target (table 4.3).

    Parameters
    ----------
    frames
        Frames of `campaign_errors` for each of METHODS, of the same conditions.

    Returns
    -------
    dict
        Frames like `frames`, their errors counted from the reference points.

    Raises
    ------
    DataError
        If a frame is missing, the conditions differ or repeat, or a target lacks its reference.
    """
    _check_frames(frames)
    basis = frames[REFERENCE_METHOD]
    basis = basis[basis["payload"] == REFERENCE_PAYLOAD].set_index(TARGET)
    found = {}
    for method, frame in frames.items():
        targets = pd.MultiIndex.from_frame(frame[TARGET])
        if not (known := targets.isin(basis.index)).all():
            x, y = frame[TARGET].to_numpy()[~known][0]
            raise DataError(
                f"campaign: expected the point reached at the target ({x:g}, {y:g}) m with "
                f"{REFERENCE_PAYLOAD:g} kg by {REFERENCE_METHOD!r}, found none"
            )
        reference = basis.loc[targets, ["reached_x", "reached_y"]].to_numpy()
        reached = frame[["reached_x", "reached_y"]]
        found[method] = campaign_errors(frame[TARGET], frame["payload"], reached, reference)
    return found


def campaign_table(frames: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """STATISTICS in mm by payload and over all, as in tables 4.2 and 4.3.

    Parameters
    ----------
    frames
        Frames of `campaign_errors` or `reference_errors` for each of METHODS.

    Returns
    -------
    DataFrame
        Indexed by `statistic` (names of evaluation.errors.STATISTICS); a column for every method,
        without compensation first, of every payload, lightest first, then those over all; named
        by `column`.

    Raises
    ------
    DataError
        If a frame is missing, or the conditions differ or repeat.
    """
    _check_frames(frames)
    columns = {}
    for payload in [*sorted(set(frames[METHODS[0]]["payload"])), None]:
        for method in METHODS:
            frame = frames[method]
            rows = frame if payload is None else frame[frame["payload"] == payload]
            columns[column(method, payload)] = [
                1e3 * float(statistic(rows)) for statistic in STATISTICS.values()
            ]
    return pd.DataFrame(columns, index=pd.Index(list(STATISTICS), name="statistic"))


def _check_frames(frames: Mapping[str, pd.DataFrame]) -> None:
    """Raise DataError unless METHODS met the same conditions, each once."""
    if set(frames) != set(METHODS):
        raise DataError(f"campaign: expected frames of {list(METHODS)}, found {sorted(frames)}")
    conditions = {}
    for method, frame in frames.items():
        if frame.empty:
            raise DataError(f"campaign: no measurement with method {method!r}")
        rows = list(frame[KEYS].itertuples(index=False, name=None))
        conditions[method] = set(rows)
        if len(conditions[method]) < len(rows):
            raise DataError(f"campaign: a target and payload stand twice under {method!r}")
    first, second = (conditions[method] for method in METHODS)
    if different := sorted(first ^ second):
        x, y, payload = different[0]
        raise DataError(
            f"campaign: expected every target and payload under both of {list(METHODS)}, but "
            f"({x:g}, {y:g}) m with {payload:g} kg stands under one"
        )
