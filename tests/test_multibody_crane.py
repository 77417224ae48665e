"""The flexible crane against calculation without Exudyn."""

from dataclasses import replace

import crane_case
import numpy as np
import pytest
import virtual_work

from flexik.errors import ParameterError, SolverError
from flexik.kinematics.crane import forward
from flexik.multibody.joint_forces import pins_of
from flexik.multibody.model import PlanarModel
from flexik.multibody.planar import shapes, solve, tips
from flexik.planar.samples import random_samples

SPRING = 8e6  # N m/rad


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane(SPRING)


@pytest.fixture(scope="module")
def samples():
    return random_samples(crane_case.MACHINE, 50, (30.0, 500.0), 0.0, seed=20)


def with_constants(crane, **changes):
    return replace(crane, machine=crane.machine.with_constants(changes))


def calculated(samples, solve):
    structure = virtual_work.nominal_structure(SPRING)
    rows = zip(samples.values, samples.payload, strict=True)
    return [solve(structure, *row) for row in rows]


@pytest.fixture(scope="module")
def nonlinear(samples):
    return calculated(samples, virtual_work.solve_nonlinear)


def test_tip_deflection_is_that_of_virtual_work_and_of_statics(crane, samples, nonlinear):
    found = tips(crane, samples.values, samples.payload) - forward(crane.geometry, samples.values)
    # first-order theory about the undeformed crane, and statics on the deformed one
    linear = calculated(samples, virtual_work.solve)
    for results, largest in ((linear, 0.02), (nonlinear, 0.01)):
        expected = np.array([result.tip_deflection for result in results])
        error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert np.median(error) < 0.01 and error.max() < largest


def test_ten_times_the_payload_is_borne_as_statics_says(crane):
    # there Newton's method needs the exact Jacobian
    strokes = np.array([[0.521, 0.393, 1.206], [0.057, 0.012, 1.545], [0.39, 0.041, 1.5]])
    payload = np.full(3, 5000.0)
    found = tips(crane, strokes, payload) - forward(crane.geometry, strokes)
    structure = virtual_work.nominal_structure(SPRING)
    for row, deflection in zip(strokes, found, strict=True):
        expected = virtual_work.solve_nonlinear(structure, row, 5000.0).tip_deflection
        assert deflection == pytest.approx(expected, abs=5e-3)


def pin_forces(crane, strokes, payload):
    model = PlanarModel.placed(crane, np.asarray(strokes))
    model.solve(payload)
    return model.pin_forces(pins_of(crane.machine))


def test_forces_are_those_of_statics(crane, samples, nonlinear):
    for strokes, payload, expected in zip(samples.values, samples.payload, nonlinear, strict=True):
        found = pin_forces(crane, strokes, payload)
        largest = max(abs(force) for force in expected.forces.values())
        for name in ("lift", "jib"):
            tension = expected.forces[f"{name}_cylinder"]
            assert found[f"drives.{name}"][0] == pytest.approx(tension, abs=5e-3 * largest)
        # rocker and coupler weigh, so that they pull a little more at one end
        for pin, rod in (("rocker_pivot", "rocker"), ("coupler_pin", "coupler")):
            pull = np.linalg.norm(found[f"joints.{pin}"])
            assert pull == pytest.approx(abs(expected.forces[rod]), abs=5e-3 * largest + 120.0)


def test_full_reach_at_full_payload_needs_the_published_cylinder_force(crane):
    # about 129 kN, 164 bar in a 100 mm cylinder
    (force,) = pin_forces(crane, [0.1287, 0.0, 1.6], 500.0)["drives.lift"]
    assert force == pytest.approx(-129e3, rel=0.01)


def test_both_elements_agree(crane, samples):
    rigid = forward(crane.geometry, samples.values)
    exact, ancf = (
        tips(crane_case.upright(crane, element), samples.values, samples.payload)
        for element in ("geometrically_exact", "ancf")
    )
    difference = np.linalg.norm(exact - ancf, axis=1)
    assert (difference / np.linalg.norm(exact - rigid, axis=1)).max() < 5e-3


def test_elements_that_must_be_straight_are_refused_in_words(crane):
    with pytest.raises(ParameterError, match=r"bodies\.pillar\.axis: elements ancf are straight"):
        with_constants(crane, element="ancf")


def test_default_mesh_is_near_one_four_times_finer(crane, samples):
    coarse = tips(crane, samples.values, samples.payload)
    fine = tips(replace(crane, refinement=4), samples.values, samples.payload)
    difference = np.linalg.norm(coarse - fine, axis=1)
    deflection = np.linalg.norm(fine - forward(crane.geometry, samples.values), axis=1)
    assert difference.mean() < 2e-5 and difference.max() < 1e-4
    assert (difference / deflection).max() < 1.5e-3


def test_the_tip_does_not_step_where_the_mesh_changes(crane):
    strokes = np.column_stack([np.full((1601, 2), [0.1287, 0.0]), np.linspace(0.0, 1.6, 1601)])
    moved = tips(crane, strokes, np.full(1601, 500.0)) - forward(crane.geometry, strokes)
    assert np.linalg.norm(np.diff(moved, 2, axis=0), axis=1).max() < 5e-6


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
def test_stiff_weightless_crane_stays_where_the_rigid_one_is(crane, geometry, element):
    crane = crane_case.upright(crane, element)
    light = replace(crane, machine=crane.machine.model_copy(update={"gravity": 1e-9}))
    strokes = np.array([[0.0, 0.0, 0.0], [0.3, 0.4, 0.8], [0.535, 0.78, 1.6]])
    assert tips(light, strokes, np.full(3, 100.0)) == pytest.approx(
        forward(geometry, strokes), abs=1e-8
    )


def test_unloaded_beams_lie_on_the_rigid_pose(crane, geometry):
    strokes = np.array([0.2, 0.3, 0.7])
    rigid, bent = shapes(crane, strokes, 200.0)
    assert rigid["extension"][-1] == pytest.approx(forward(geometry, strokes)[0], abs=1e-12)
    assert bent["extension"][-1] == pytest.approx(tips(crane, strokes[None], [200.0])[0], abs=1e-7)
    assert rigid["pillar"][[0, -1]] == pytest.approx(np.array([[0, -0.311], [-0.09, 1.115]]))


def test_order_of_payloads_and_starting_point_do_not_matter(crane):
    strokes = np.tile([0.2, 0.2, 0.9], (4, 1))
    up = tips(crane, strokes, np.array([50.0, 200.0, 350.0, 500.0]))
    down = tips(crane, strokes, np.array([500.0, 350.0, 200.0, 50.0]))
    assert up == pytest.approx(down[::-1], abs=2e-7)
    alone = [tips(crane, strokes[:1], np.array([mass]))[0] for mass in (50.0, 500.0)]
    assert up[[0, -1]] == pytest.approx(np.array(alone), abs=2e-7)


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
def test_rows_do_not_depend_on_the_extensions_before_them(crane, geometry, element):
    # neither on those that share a system nor on a failure; the last put the pad at a pin's node
    variant = crane_case.upright(crane, element)
    extension = [*np.linspace(0.0, 1.6, 24), *np.linspace(1.58, 0.02, 24), 0.3, 0.32, 0.39, 0.41]
    strokes = np.column_stack([np.full(52, 0.2), np.full(52, 0.3), extension])
    payload = np.linspace(30.0, 500.0, 52)
    payload[10] = 1e9
    together, failures = solve(variant, strokes, payload)
    assert list(failures) == [10]
    alone = [solve(variant, strokes[k], payload[k : k + 1])[0][0] for k in range(52)]
    assert together == pytest.approx(np.array(alone), abs=1e-7, nan_ok=True)


def test_a_failure_is_raised_with_its_strokes_and_payload(crane):
    strokes = np.tile([0.1, 0.1, 1.0], (3, 1))
    payload = np.array([100.0, 1e9, 200.0])
    with pytest.raises(SolverError, match=r"with 1e\+09 kg at lift 0\.1, jib 0\.1, extension 1"):
        tips(crane, strokes, payload)
    found, failures = solve(crane, strokes, payload)
    assert list(failures) == [1]
    assert np.isnan(found[1]).all()
    # the rows around it are not touched by it
    assert found[[0, 2]] == pytest.approx(tips(crane, strokes[:2], payload[[0, 2]]), abs=2e-7)


def test_strokes_that_do_not_assemble_fail_every_row_of_theirs(crane):
    strokes = np.array([[0.1, 3.0, 1.0], [0.1, 3.0, 1.0], [0.1, 0.1, 1.0]])
    found, failures = solve(crane, strokes, np.full(3, 100.0))
    assert list(failures) == [0, 1]
    assert "cannot be assembled" in str(failures[0])
    assert np.isfinite(found[2]).all()
