"""Predicted tips, what surprises in measurements, and predictions of targets left out."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from smoke_pipeline import ROOT

from flexik.datasets.crane.grid import STROKES
from flexik.evaluation.crane_measured.predictions import measurements, misfit, outliers, predictions
from flexik.kinematics.crane import forward, inverse_with_smallest_extension
from flexik.multibody.crane.assembly import flexible_crane
from flexik.parameters import load_parameters
from flexik.positioning.crane_measured.adapted import (
    OFFSETS,
    AdaptationSettings,
    CorrectedDeflection,
    Measurements,
    Offsets,
    identify,
    prior,
)
from flexik.positioning.crane_measured.prediction import predicted_tip, surprise

SETTINGS = AdaptationSettings(
    measurement=0.5e-3,
    repeatability=0.1e-3,
    pivot=0.5e-3,
    length=0.5e-3,
    stroke_offset=0.5e-3,
    play=0.1e-3,
    play_deviation=0.03e-3,
    section=0.03,
    spring=0.05,
)
TARGETS = np.array([[3.8, 1.75], [3.0, 0.95], [3.8, 0.15], [4.6, 2.5], [2.4, -1.0], [4.5, -0.5]])


class Sag:
    """Stands for the network."""

    def predict(self, values):
        """Deflection grows with the load."""
        return (0.005 + 0.005 * values[:, 3:] / 172) * [0.3, -1.0]


@pytest.fixture(scope="module")
def crane():
    return flexible_crane(load_parameters(ROOT / "params.yaml").crane, 8.45e6)


@pytest.fixture(scope="module")
def conditions(crane):
    """Strokes (12, 3) and payload (12,), two loads a target."""
    targets = np.repeat(TARGETS, 2, axis=0)
    strokes = inverse_with_smallest_extension(crane.geometry, targets).strokes
    return strokes, np.tile([0.0, 172.0], len(TARGETS))


def drawn(seed):
    """Offsets of a crane as the settings expect it."""
    expected, deviation = prior(SETTINGS)
    values = np.random.default_rng(seed).normal(expected, deviation)
    return Offsets(dict(zip(OFFSETS, values.tolist(), strict=True)))


def measured(crane, conditions, seed):
    """Measurements of a crane that differs as expected, its strokes never quite repeated."""
    strokes, payload = conditions
    generator = np.random.default_rng((seed, 1))
    actual = strokes + generator.normal(0.0, SETTINGS.repeatability, strokes.shape)
    tip = predicted_tip(crane, Sag(), drawn(seed), actual, payload)
    return Measurements(strokes, payload, tip + generator.normal(0.0, 0.5e-3, tip.shape))


def test_predicted_tips_are_rigid_tips_and_deflections(crane, conditions):
    strokes, payload = conditions
    inputs = np.column_stack([strokes, payload])
    nominal = predicted_tip(crane, Sag(), None, strokes, payload)
    np.testing.assert_allclose(nominal, forward(crane.geometry, strokes) + Sag().predict(inputs))
    zero = Offsets(dict.fromkeys(OFFSETS, 0.0))
    np.testing.assert_allclose(predicted_tip(crane, Sag(), zero, strokes, payload), nominal)
    offsets = drawn(3)
    found = predicted_tip(crane, Sag(), offsets, strokes, payload)
    rigid = forward(offsets.geometry(crane.geometry), strokes)
    moved = CorrectedDeflection(crane, Sag(), offsets).predict(inputs)
    np.testing.assert_allclose(found, rigid + moved)


def test_surprise_is_in_standard_deviations(crane, conditions):
    # squared distances of two normal coordinates have the mean 2; rows of a crane go together
    squares = [
        surprise(crane, Sag(), measured(crane, conditions, seed), SETTINGS) ** 2
        for seed in range(60)
    ]
    assert np.mean(squares) == pytest.approx(2.0, rel=0.2)


def test_surprise_after_identification_is_in_its_own_standard_deviations(crane, conditions):
    first, rest = slice(0, 4), slice(4, None)
    squares = []
    for seed in range(60):
        whole = measured(crane, conditions, seed)
        known, other = (
            Measurements(whole.strokes[rows], whole.payload[rows], whole.tip[rows])
            for rows in (rest, first)
        )
        offsets = identify(crane, Sag(), known, SETTINGS)
        squares.append(surprise(crane, Sag(), other, SETTINGS, offsets) ** 2)
    assert np.mean(squares) == pytest.approx(2.0, rel=0.3)


def test_what_stands_out_is_judged_by_the_median():
    generator = np.random.default_rng(1)
    distance = np.linalg.norm(generator.standard_normal((2000, 2)), axis=1)
    assert misfit(3.0 * distance) == pytest.approx(3.0, rel=0.05)
    assert misfit(0.1 * distance) == 1.0
    few = distance[:50]
    assert not outliers(few, few).any()
    assert outliers(np.append(few, 9.0), few).tolist() == [False] * 50 + [True]
    # where all fit badly, none of them stands out
    assert not outliers(10.0 * few, 10.0 * few).any()


def test_a_slip_of_the_pen_surprises(crane, conditions):
    whole = measured(crane, conditions, 1)
    before = surprise(crane, Sag(), whole, SETTINGS)
    tip = whole.tip.copy()
    tip[4] += [0.0, 0.1]
    after = surprise(crane, Sag(), dataclasses.replace(whole, tip=tip), SETTINGS)
    assert after[4] > 5.0 > before.max()
    np.testing.assert_array_equal(np.delete(after, 4), np.delete(before, 4))


def test_who_misjudges_expects_less():
    found = SETTINGS.misjudged(0.5)
    assert (found.play, found.pivot, found.spring) == (0.0, 0.25e-3, 0.025)
    assert (found.measurement, found.repeatability) == (0.5e-3, 0.1e-3)


@pytest.fixture
def campaign(crane, conditions):
    rows = measured(crane, conditions, 2)
    targets = np.repeat(TARGETS, 2, axis=0)
    columns = {
        "line": np.arange(1, 13),
        "target_x": targets[:, 0],
        "target_y": targets[:, 1],
        "payload": rows.payload,
    }
    columns |= dict(zip(STROKES, rows.strokes.T, strict=True))
    return pd.DataFrame(columns | {"measured_x": rows.tip[:, 0], "measured_y": rows.tip[:, 1]})


def test_a_target_is_predicted_from_the_others_alone(crane, campaign):
    table = predictions(crane, Sag(), campaign, SETTINGS)
    assert table["line"].tolist() == list(range(1, 13))
    assert (table["used"] == 1).all()
    strokes, payload = campaign[list(STROKES)].to_numpy(), campaign["payload"].to_numpy()
    nominal = predicted_tip(crane, Sag(), None, strokes, payload)
    away = np.linalg.norm(campaign[["measured_x", "measured_y"]] - nominal, axis=1)
    np.testing.assert_allclose(table["nominal_error"], away)
    assert table["adapted_error"].mean() < 0.6 * table["nominal_error"].mean()
    # 50 mm that one target's points were moved stand in their own errors only in full
    moved = campaign.copy()
    moved.loc[:1, "measured_y"] += 0.05
    after = predictions(crane, Sag(), moved, SETTINGS)["adapted_error"]
    change = (after - table["adapted_error"]).abs()
    assert change[:2].min() > 0.04
    assert (change[2:] > 1e-6).any()
    # strokes tell the groups where there are no targets
    assert predictions(crane, Sag(), moved, SETTINGS)["used"].tolist() == [0, 0, *[1] * 10]
    unknown = campaign.assign(target_x=np.nan, target_y=np.nan)
    pd.testing.assert_frame_equal(predictions(crane, Sag(), unknown, SETTINGS), table)


def test_too_few_others_predict_nothing(crane, campaign):
    table = predictions(crane, Sag(), campaign[:4], SETTINGS)
    assert table["adapted_error"].isna().all()
    assert table["nominal_error"].notna().all()
    assert len(measurements(campaign).tip) == 12
