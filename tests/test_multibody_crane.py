"""The flexible crane against calculation without Exudyn."""

from dataclasses import replace

import crane_case
import numpy as np
import pytest
import virtual_work

from flexik.cases.crane.parts.samples import random_samples
from flexik.errors import SolverError
from flexik.kinematics.crane import forward
from flexik.multibody.crane.model import CraneModel, equilibrium, reference_shapes, solve, tips

SPRING = 8e6  # N m/rad
RODS = ("lift_cylinder", "jib_cylinder", "rocker", "coupler", "front_pad")


@pytest.fixture(scope="module")
def crane():
    return crane_case.crane(SPRING)


@pytest.fixture(scope="module")
def samples(geometry):
    return random_samples(geometry, 50, (30.0, 500.0), 0.0, seed=20)


def calculated(samples, solve):
    structure = virtual_work.nominal_structure(SPRING)
    rows = zip(samples.strokes, samples.payload, strict=True)
    return [solve(structure, *row) for row in rows]


@pytest.fixture(scope="module")
def nonlinear(samples):
    return calculated(samples, virtual_work.solve_nonlinear)


def test_tip_deflection_is_that_of_virtual_work_and_of_statics(crane, samples, nonlinear):
    found = tips(crane, samples.strokes, samples.payload) - forward(crane.geometry, samples.strokes)
    # first-order theory about the undeformed crane, and statics on the deformed one
    linear = calculated(samples, virtual_work.solve)
    for results, largest in ((linear, 0.02), (nonlinear, 0.01)):
        expected = np.array([result.tip_deflection for result in results])
        error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
        assert np.median(error) < 0.01 and error.max() < largest


def test_forces_and_reactions_are_those_of_statics(crane, samples, nonlinear):
    for strokes, payload, expected in zip(samples.strokes, samples.payload, nonlinear, strict=True):
        found = equilibrium(crane, strokes, payload)
        largest = max(abs(force) for force in expected.forces.values())
        for name in RODS:
            assert found.forces[name] == pytest.approx(
                expected.forces[name], rel=5e-3, abs=5e-3 * largest
            )
        assert found.reaction[:2] == pytest.approx(expected.reaction[:2], rel=1e-9, abs=1e-3)
        assert found.reaction[2] == pytest.approx(expected.reaction[2], rel=5e-3)


def test_full_reach_at_full_payload_needs_the_published_cylinder_force(crane):
    # about 129 kN, 164 bar in a 100 mm cylinder
    force = equilibrium(crane, [0.1287, 0.0, 1.6], 500.0).forces["lift_cylinder"]
    assert force == pytest.approx(-129e3, rel=0.01)


def test_both_elements_agree(crane, samples):
    rigid = forward(crane.geometry, samples.strokes)
    exact = tips(crane, samples.strokes, samples.payload)
    ancf = tips(replace(crane, element="ancf"), samples.strokes, samples.payload)
    difference = np.linalg.norm(exact - ancf, axis=1)
    assert (difference / np.linalg.norm(exact - rigid, axis=1)).max() < 5e-3


def test_default_mesh_is_within_a_percent_of_one_four_times_finer(crane, samples):
    rows = slice(0, 12)
    strokes, payload = samples.strokes[rows], samples.payload[rows]
    coarse = tips(crane, strokes, payload)
    fine = tips(replace(crane, refinement=4), strokes, payload)
    deflection = np.linalg.norm(fine - forward(crane.geometry, strokes), axis=1)
    assert (np.linalg.norm(coarse - fine, axis=1) / deflection).max() < 0.01


@pytest.mark.parametrize("element", ["geometrically_exact", "ancf"])
def test_stiff_weightless_crane_stays_where_the_rigid_one_is(crane, geometry, element):
    structure = replace(crane.structure, gravity=1e-9)
    light = replace(crane, structure=structure, element=element)
    strokes = np.array([[0.0, 0.0, 0.0], [0.3, 0.4, 0.8], [0.535, 0.78, 1.6]])
    assert tips(light, strokes, np.full(3, 100.0)) == pytest.approx(
        forward(geometry, strokes), abs=1e-8
    )


def test_unloaded_beams_lie_on_the_rigid_pose(crane, geometry):
    strokes = [0.2, 0.3, 0.7]
    shapes = reference_shapes(crane, strokes)
    assert shapes["extension"][-1] == pytest.approx(forward(geometry, [strokes])[0], abs=1e-12)
    assert shapes["pillar"][[0, -1]] == pytest.approx(np.array([[0, -0.311], [0, 1.115]]))


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
    variant = replace(crane, element=element)
    extension = [*np.linspace(0.0, 1.6, 24), *np.linspace(1.58, 0.02, 24), 0.3, 0.32, 0.39, 0.41]
    strokes = np.column_stack([np.full(52, 0.2), np.full(52, 0.3), extension])
    payload = np.linspace(30.0, 500.0, 52)
    payload[10] = 1e6
    together, failures = solve(variant, strokes, payload)
    assert list(failures) == [10]
    alone = [solve(variant, strokes[k], payload[k : k + 1])[0][0] for k in range(52)]
    assert together == pytest.approx(np.array(alone), abs=1e-7, nan_ok=True)


def test_a_failure_is_raised_with_its_strokes_and_payload(crane):
    strokes = np.tile([0.1, 0.1, 1.0], (3, 1))
    payload = np.array([100.0, 1e6, 200.0])
    with pytest.raises(SolverError, match=r"\(0\.1, 0\.1, 1\) m with 1e\+06 kg"):
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


def test_a_model_is_placed_anew_without_memory(crane):
    first = CraneModel(crane, 0.4)
    for strokes in ([0.1, 0.6, 0.4], [0.5, 0.1, 0.4]):
        first.place(np.array(strokes))
        first.solve(300.0)
    fresh = tips(crane, np.array([[0.5, 0.1, 0.4]]), np.array([300.0]))
    assert first.tip() == pytest.approx(fresh[0], abs=1e-7)
