"""Methods `none` and `combined` on a flexible model whose deflection is known exactly."""

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from flexik.errors import ParameterError
from flexik.evaluation.conditions import all_conditions
from flexik.kinematics.crane import forward, inverse, smallest_extension
from flexik.kinematics.status import REACHED
from flexik.positioning.combined import Combined
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane.genetic import GeneticSettings, genetic
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.methods import METHODS, build_method
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import Command, PositioningError
from flexik.positioning.none import Uncompensated


class Sag:
    """Smooth deflection, about `size` m at 470 kg; stands for the network and for the model."""

    def __init__(self, geometry, size):
        self.geometry, self.size = geometry, size

    def predict(self, values):
        """Deflection, as a network gives it."""
        strokes, payload = values[:, :3], values[:, 3]
        x, y = forward(self.geometry, strokes).T
        shape = np.column_stack([np.sin(y / 3) + 0.1 * strokes[:, 2], -0.3 * x - np.cos(x - y) / 4])
        return self.size * (payload / 470)[:, None] * shape

    def tip(self, strokes, payload):
        """Tip of the flexible model."""
        deflection = self.predict(np.column_stack([strokes, payload]))
        return forward(self.geometry, strokes) + deflection


@pytest.fixture(scope="module")
def conditions(points, payloads):
    return all_conditions(points, payloads)


@pytest.fixture(scope="module")
def initial(geometry, conditions):
    return initial_positions(geometry, conditions.targets)


def errors(method, conditions, initial, sag):
    command = method(conditions.targets, conditions.payload, initial)
    assert (command.status == REACHED).all()
    return conditions.targets - sag.tip(command.strokes, conditions.payload)


def test_error_of_none_is_the_deflection(geometry, conditions, initial):
    sag = Sag(geometry, 0.03)
    command = Uncompensated(closed_form(geometry))(conditions.targets, conditions.payload, initial)
    deflection = sag.predict(np.column_stack([command.strokes, conditions.payload]))
    error = conditions.targets - sag.tip(command.strokes, conditions.payload)
    assert error == pytest.approx(-deflection, abs=1e-9)
    assert np.abs(error).max() > 0.02


def test_each_correction_gains_an_order(geometry, conditions, initial):
    # halving the deflection: error of order k falls by 2^k
    for n_corrections, order in ((1, 2), (2, 3)):
        largest = []
        for size in (0.005, 0.0025):
            sag = Sag(geometry, size)
            method = Combined(closed_form(geometry), sag, n_corrections)
            largest.append(np.abs(errors(method, conditions, initial, sag)).max())
        assert np.log2(largest[0] / largest[1]) == pytest.approx(order, abs=0.3)


def test_corrections_shrink_the_error(geometry, conditions, initial):
    sag, rigid = Sag(geometry, 0.02), closed_form(geometry)
    methods = [Uncompensated(rigid), *(Combined(rigid, sag, n) for n in (1, 2, 3))]
    mean = [np.abs(errors(method, conditions, initial, sag)).mean() for method in methods]
    assert all(later < 0.2 * earlier for earlier, later in pairwise(mean))


def test_combined_keeps_the_extension_where_it_still_reaches(geometry, conditions, initial):
    sag = Sag(geometry, 0.02)
    command = Combined(closed_form(geometry), sag)(conditions.targets, conditions.payload, initial)
    kept = smallest_extension(geometry, conditions.targets)
    deflection = np.column_stack([command.diagnostics[f"deflection_{axis}"] for axis in "xy"])
    corrected = conditions.targets - deflection
    still = inverse(geometry, corrected, kept).reached
    shorter = smallest_extension(geometry, corrected) < kept - 1e-6
    assert (still & shorter).any()  # rows that a rule without memory would change
    assert np.array_equal(command.strokes[still, 2], kept[still])


def test_combined_with_the_genetic_inverse_ends_near_its_tolerance(geometry, points):
    targets, payload = points[6:12], np.full(6, 260.0)
    sag = Sag(geometry, 0.02)
    method = Combined(genetic(geometry, GeneticSettings()), sag)
    command = method(targets, payload, initial_positions(geometry, targets))
    assert (command.status == REACHED).all()
    error = np.linalg.norm(targets - sag.tip(command.strokes, payload), axis=1)
    assert (error < 6e-3).all()  # 5 mm and a second-order remainder
    assert {"first_n_generations", "corrected_n_generations"} <= command.diagnostics.keys()


class Constant:
    """Predicts one deflection everywhere."""

    def __init__(self, deflection):
        self.deflection = deflection

    def predict(self, values):
        """Repeat the deflection for all rows."""
        return np.tile(self.deflection, (len(values), 1))


def test_unreachable_corrected_target_is_flagged_and_keeps_the_uncorrected_strokes(geometry):
    targets = np.array([[2.0, -3.95], [4.0, 1.0]])
    start, payload = initial_positions(geometry, targets), np.full(2, 30.0)
    rigid = closed_form(geometry)
    # 0.1 m of lift at the lower border asks for a point below the working area
    command = Combined(rigid, Constant([0.0, 0.1]), 2)(targets, payload, start)
    assert (command.status == REACHED).tolist() == [False, True]
    assert np.array_equal(command.strokes[0], rigid(targets, start).strokes[0])
    assert forward(geometry, command.strokes)[1] == pytest.approx([4.0, 0.9], abs=1e-9)


def test_unreachable_target_stays_flagged_though_its_correction_would_reach(geometry):
    targets, start = np.array([[2.0, -4.1]]), np.array([[0.0, 0.3, 0.5]])
    command = Combined(closed_form(geometry), Constant([0.0, -0.5]))(targets, np.zeros(1), start)
    assert command.status[0] != REACHED
    assert np.array_equal(command.strokes, start)


def test_diagnostics_hold_the_predicted_deflection(geometry, points, payloads):
    start = initial_positions(geometry, points[:5])
    command = Combined(closed_form(geometry), Constant([0.01, -0.02]))(points[:5], payloads, start)
    assert (command.diagnostics["deflection_x"] == 0.01).all()
    assert (command.diagnostics["deflection_y"] == -0.02).all()


def test_methods_are_built_by_name(geometry):
    rigid, sag = closed_form(geometry), Sag(geometry, 0.02)
    ingredients = Ingredients(geometry, rigid, {"deflection": sag})
    assert build_method("none", ingredients) == METHODS["none"](ingredients)
    assert build_method("combined", ingredients, n_corrections=2) == Combined(rigid, sag, 2)


def test_wrong_names_are_told(geometry):
    ingredients = Ingredients(geometry, closed_form(geometry))
    with pytest.raises(
        ParameterError, match=r"'combine' is not known.*'combined', 'direct'.*'none'"
    ):
        build_method("combine", ingredients)
    with pytest.raises(PositioningError, match="expected a network 'deflection'"):
        build_method("combined", ingredients)
    with pytest.raises(ParameterError, match="n_corrections"):
        Combined(closed_form(geometry), Constant([0.0, 0.0]), 0)


def test_bad_arrays_are_told(geometry, points):
    start = initial_positions(geometry, points)
    method = Combined(closed_form(geometry), Constant([0.0, np.nan]))
    with pytest.raises(PositioningError, match="predicted deflection: sample 0 is not finite"):
        method(points, np.zeros(25), start)
    with pytest.raises(PositioningError, match="payload: expected shape"):
        method(points, np.zeros(24), start)
    with pytest.raises(PositioningError, match="status"):
        Command(start, np.zeros(3, dtype=np.int64))


def test_the_room_loads_no_heavy_library():
    code = "import sys, flexik.positioning; print({'torch', 'exudyn', 'pymoo'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
