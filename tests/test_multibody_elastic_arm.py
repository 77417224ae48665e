"""The flexible arm against beam theory, statics and its own kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from elastic_arm import GEOMETRY, MODEL

from flexik.cases.elastic_arm.parts.arm import FlexibleArm, equilibria, solve
from flexik.errors import SolverError
from flexik.kinematics.elastic_arm import flexible_forward
from flexik.multibody.planar import PlanarModel

PAYLOADS = np.arange(4.0)  # kg
A1, A2 = 0.57, 0.62
G = 9.81
EI = 68.9e9 * (0.040 * 0.020**3 - 0.037 * 0.017**3) / 12
PER_LENGTH = 2700 * (0.040 * 0.020 - 0.037 * 0.017)  # kg/m
JOINT_MASS = 0.5


def cantilever(length, shear, moment, x):
    """Deflection and slope at `x` of a clamped link (Timoshenko and Gere).

    `shear` N and `moment` N m at its end turn downwards, and so does its own weight.
    """
    w = PER_LENGTH * G
    deflection = (
        shear * x**2 * (3 * length - x) / 6
        + moment * x**2 / 2
        + w * x**2 * (6 * length**2 - 4 * length * x + x**2) / 24
    )
    slope = (
        shear * x * (2 * length - x) / 2
        + moment * x
        + w * x * (3 * length**2 - 3 * length * x + x**2) / 6
    )
    return -deflection / EI, -slope / EI


def horizontal(payload):
    """Closed form of the horizontal arm: deformation, station deflections, height of the tip."""
    weight_2 = PER_LENGTH * A2 * G
    end = payload * G
    dy_1, dphi_1 = cantilever(A1, JOINT_MASS * G + weight_2 + end, (weight_2 / 2 + end) * A2, A1)
    dy_2, dphi_2 = cantilever(A2, end, 0.0, A2)
    station_1, _ = cantilever(A1, JOINT_MASS * G + weight_2 + end, (weight_2 / 2 + end) * A2, 0.31)
    station_2, _ = cantilever(A2, end, 0.0, 0.36)
    # link 2 hangs on the turned end of link 1
    return np.array([dy_1, dphi_1, dy_2, dphi_2, station_1, station_2, dy_1 + A2 * dphi_1 + dy_2])


def test_horizontal_pose_is_that_of_beam_theory_within_two_percent():
    found = equilibria(MODEL, np.zeros((4, 2)), PAYLOADS)
    columns = np.column_stack(
        [found.deformation[:, [0, 2, 3, 5]], found.station_deflection, found.tip[:, 1]]
    )
    expected = np.array([horizontal(payload) for payload in PAYLOADS])
    assert columns == pytest.approx(expected, rel=0.02)
    # the scale of the gauges, mm, by the paper's assumed tube
    assert 1e3 * -found.deformation[:, 0] == pytest.approx([0.85, 2.9, 4.9, 6.9], abs=0.05)
    assert 1e3 * -found.deformation[:, 3] == pytest.approx([0.11, 1.1, 2.1, 3.1], abs=0.05)


def test_tip_is_that_of_the_flexible_forward_equations():
    """Equations 44 and 45 with the deformation read from the model are exact."""
    generator = np.random.default_rng(0)
    angles = generator.uniform(GEOMETRY.lower, GEOMETRY.upper, (40, 2))
    found = equilibria(MODEL, angles, generator.uniform(0.0, 3.0, 40))
    assert flexible_forward(GEOMETRY, angles, found.deformation) == pytest.approx(
        found.tip, abs=1e-14
    )
    sag = found.tip - GEOMETRY.forward(angles)
    assert (sag[:, 1] < 0.0).all() and np.abs(sag).max() < 0.03


def test_links_shorten_by_half_the_integral_of_the_squared_slope():
    found = equilibria(MODEL, np.zeros((1, 2)), np.array([3.0]))
    x = np.linspace(0.0, A1, 400)
    weight_2, end = PER_LENGTH * A2 * G, 3.0 * G
    _, slope = cantilever(A1, JOINT_MASS * G + weight_2 + end, (weight_2 / 2 + end) * A2, x)
    assert found.deformation[0, 1] == pytest.approx(-np.trapezoid(slope**2, x) / 2, rel=0.02)


def test_upright_arm_is_compressed_by_what_stands_above():
    upright = np.array([[np.pi / 2, 0.0]])
    found = equilibria(MODEL, upright, np.array([2.0]))
    area = PER_LENGTH / 2700
    above = 2.0 + PER_LENGTH * A2 + JOINT_MASS + PER_LENGTH * (A1 - 0.05)
    assert found.axial_strain[0, 0] == pytest.approx(-above * G / (68.9e9 * area), rel=0.02)
    assert found.deformation[0, [0, 2, 3, 5]] == pytest.approx(np.zeros(4), abs=1e-9)
    # the mean force of each link, exactly half of its own weight and all above it
    force_2 = 2.0 + PER_LENGTH * A2 / 2
    shortening = force_2 * G * A2 / (68.9e9 * area)
    assert found.deformation[0, 4] == pytest.approx(-shortening, rel=1e-3)


def test_twice_as_many_elements_move_the_tip_by_under_two_micrometres():
    angles, payload = np.radians([[0.0, 0.0], [20.0, -30.0]]), np.array([3.0, 1.5])
    fine = replace(MODEL, refinement=2)
    found = equilibria(MODEL, angles, payload).tip - equilibria(fine, angles, payload).tip
    assert np.abs(found).max() < 2e-6


def with_strain_stations(*abscissas):
    """The arm with its strain stations moved along the links."""
    data = MODEL.machine.model_dump()
    for link, x in zip(("link_1", "link_2"), abscissas, strict=True):
        data["bodies"][link]["points"]["strain_station"] = (x, 0.0)
    return FlexibleArm(type(MODEL.machine).model_validate(data))


def test_a_strain_station_at_the_end_takes_the_last_element():
    load = (np.radians([[10.0, 20.0]]), np.array([1.0]))
    at_end = equilibria(with_strain_stations(0.5699, 0.6199), *load).axial_strain
    before = equilibria(with_strain_stations(0.56, 0.61), *load).axial_strain
    assert at_end == pytest.approx(before, rel=0.05)


def test_rows_do_not_depend_on_each_other():
    angles = np.radians([[0.0, 0.0], [20.0, -30.0], [10.0, 50.0]])
    payload = np.array([3.0, 0.0, 1.0])
    together = equilibria(MODEL, angles, payload)
    for k in range(3):
        alone = equilibria(MODEL, angles[k], payload[k])
        for a, b in zip(together, alone, strict=True):
            assert a[k] == pytest.approx(b[0], abs=1e-8)


def test_tube():
    section = MODEL.machine.beams["link_1"].profile()
    assert section.second_moment == pytest.approx(1.15e-8, rel=0.005)
    assert 2700 * section.area == pytest.approx(0.46, abs=0.005)


def test_a_failed_equilibrium_is_a_row_or_an_error(monkeypatch):
    original = PlanarModel.solve

    def fails(self, payload):
        if payload == 2.0:
            raise SolverError("no static equilibrium with 2 kg")
        original(self, payload)

    monkeypatch.setattr(PlanarModel, "solve", fails)
    found, failures = solve(MODEL, np.zeros((3, 2)), np.array([1.0, 2.0, 3.0]))
    assert list(failures) == [1]
    assert np.isnan(found.tip).all(axis=1).tolist() == [False, True, False]
    with pytest.raises(SolverError, match="2 kg"):
        equilibria(MODEL, np.zeros((3, 2)), np.array([1.0, 2.0, 3.0]))


def test_a_load_without_equilibrium_names_pose_and_payload():
    with pytest.raises(SolverError, match=r"with 1e\+09 kg at theta_1 0, theta_2 0"):
        equilibria(MODEL, np.zeros((1, 2)), np.array([1e9]))
