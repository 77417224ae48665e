"""The lookup table against functions that its interpolation gives exactly."""

import crane_case
import numpy as np
import pandas as pd
import pytest

from flexik.kinematics.status import REACHED
from flexik.positioning.lookup_table import DeflectionTable, Settings, build
from flexik.positioning.method import Ingredients, PositioningError

STROKES = ["lift_stroke", "jib_stroke", "extension_stroke"]
AXES = (
    np.linspace(0.0, 0.535, 5),
    np.linspace(0.0, 0.78, 6),
    np.linspace(0.0, 1.6, 4),
    np.linspace(50.0, 500.0, 4),
)


def sampled(deflection, axes=AXES):
    """Table of a full grid whose deflections (n, 2) are a function of strokes and payload."""
    points = np.column_stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")])
    rigid = np.column_stack([points[:, 0], -points[:, 1]])
    frame = pd.DataFrame(points, columns=[*STROKES, "payload"])
    frame[["rigid_x", "rigid_y"]] = rigid
    frame[["tip_x", "tip_y"]] = rigid + deflection(points)
    return frame.sample(frac=1.0, random_state=1)  # the order does not count


def between(n=50, beyond=0.0):
    low, high = (np.array([axis[k] for axis in AXES]) for k in (0, -1))
    share = np.random.default_rng(2).uniform(-beyond, 1.0 + beyond, (n, 4))
    return low + share * (high - low)


def multilinear(p):
    load = p[:, 3] / 500.0
    return 0.01 * np.column_stack([load * (p[:, 2] - 0.3), -load * (1.0 + p[:, 0] * p[:, 2])])


def cubic(p):
    load = p[:, 3] / 500.0
    return 0.01 * np.column_stack([load * p[:, 2] ** 3, -(p[:, 0] ** 3) - p[:, 1] ** 2 * load**2])


@pytest.mark.parametrize(
    ("interpolation", "function", "beyond"),
    [("linear", multilinear, 0.1), ("cubic", multilinear, 0.1), ("cubic", cubic, 0.0)],
)
def test_what_the_interpolation_holds_is_given_exactly(interpolation, function, beyond):
    table = DeflectionTable.of(sampled(function), interpolation)
    at = between(beyond=beyond)
    assert table.predict(at) == pytest.approx(function(at), abs=1e-12)


def test_what_was_not_solved_has_the_deflection_of_the_nearest():
    frame = sampled(multilinear)
    corner = (frame[STROKES] == 0.0).all(axis=1) & (frame["payload"] == 50.0)
    frame.loc[corner, ["tip_x", "tip_y"]] = np.nan
    found = DeflectionTable.of(frame, "linear").predict(np.array([[0.0, 0.0, 0.0, 50.0]]))
    steps = [np.array([[0.0, 0.0, 0.0, 50.0]]) + np.eye(4)[k] * AXES[k][1] for k in range(3)]
    steps.append(np.array([[0.0, 0.0, 0.0, AXES[3][1]]]))
    assert min(np.abs(found - multilinear(step)).max() for step in steps) < 1e-15


def test_what_is_no_full_grid_is_refused():
    frame = sampled(multilinear)
    for given in (frame[1:], pd.concat([frame[1:], frame[-1:]])):
        with pytest.raises(PositioningError, match="full grid"):
            DeflectionTable.of(given, "linear")
    few = sampled(multilinear, (*AXES[:3], np.array([50.0, 500.0])))
    with pytest.raises(PositioningError, match="cubic needs 4 values"):
        DeflectionTable.of(few, "cubic")


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_the_method_puts_a_tip_that_sags_by_the_table_on_its_target(interpolation):
    manipulator = crane_case.MANIPULATOR
    ingredients = Ingredients(manipulator, samples={"grid": sampled(multilinear)})
    settings = Settings(interpolation=interpolation, n_corrections=6)
    targets = np.array([[4.0, 1.0], [3.0, 2.0], [5.0, 0.0]])
    query = np.column_stack([targets, [100.0, 300.0, 450.0]])
    answer = build(settings, ingredients)(query, manipulator.initial_positions(targets))
    assert (answer.status == REACHED).all()
    tip = manipulator.forward(answer.values)
    tip = tip + multilinear(np.column_stack([answer.values, query[:, 2]]))
    assert tip == pytest.approx(targets, abs=1e-8)
