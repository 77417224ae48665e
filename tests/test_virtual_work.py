"""The independent crane calculation against closed forms, energy and equilibrium."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from virtual_work import (
    BEAMS,
    Array,
    Beam,
    Result,
    Structure,
    mesh,
    nominal_structure,
    place,
    section_cut,
    solve,
    solve_nonlinear,
)

from flexik.kinematics.crane import pose

SPRING = 8e6
MODULUS = 210e9
CASES = [
    (np.array((0.1, 0.02, 1.4)), 500.0),
    (np.array((0.3, 0.4, 0.5)), 120.0),
    (np.array((0.5, 0.7, 0.0)), 300.0),
    (np.array((0.0, 0.1, 1.6)), 0.0),
]
every_case = pytest.mark.parametrize(("strokes", "payload"), CASES)


def stiffened(structure: Structure, *kept: str) -> Structure:
    """Structure whose beams but `kept` do not bend or stretch; weights stay."""
    beams = {
        name: beam
        if name in kept
        else replace(beam, section=beam.section * np.array([1.0, 1e12, 1e12]))
        for name, beam in structure.beams.items()
    }
    return replace(structure, beams=beams)


def mass_points(structure: Structure, strokes: Array, payload: float) -> list[tuple[float, Array]]:
    """(mass, position) of every weight at the rigid pose, from kinematics and the mass data."""
    p = pose(structure.geometry, strokes)

    def in_frame(origin: Array, angle: Array, x: float, y: float) -> Array:
        c, s = np.cos(angle[0]), np.sin(angle[0])
        return origin[0] + np.array([c * x - s * y, s * x + c * y])

    rear = strokes[2] - 0.404
    rocker = p.rocker_pivot[0] + 0.257 / 0.45 * (p.rocker_head[0] - p.rocker_pivot[0])
    coupler = p.rocker_head[0] + 0.267 / 0.48 * (p.coupler_pin[0] - p.rocker_head[0])
    return [
        (93.26, np.array([-0.017, 0.577])),
        (124.6, in_frame(p.lift_pivot, p.lift_angle, 1.12, 0.03)),
        (76.6, in_frame(p.jib_pivot, p.jib_angle, 0.498, 0.2395)),
        (58.6, in_frame(p.jib_pivot, p.jib_angle, rear + 1.15, 0.248)),
        (11.52, rocker),
        (7.90, coupler),
        (payload, p.tip[0]),
    ]


def test_cantilever_has_closed_form_deflection() -> None:
    length, inertia, area, mass, force = 2.0, 4e-6, 2e-3, 60.0, -1500.0
    beam = Beam(
        0.0,
        length,
        0.0,
        np.array([[0.0, inertia, area], [length, inertia, area]]),
        mass,
        length / 2,
        (0.0, length),
        0.0,
        {"root": (0.0, 0.0), "tip": (length, 0.0)},
    )
    cells = mesh(beam, MODULUS)
    straight = (np.zeros_like(cells.widths), np.zeros_like(cells.widths))
    placed = place(beam, cells, straight, "root", np.zeros(2), 0.0)
    weight = mass * 9.81
    root = np.array([0.0, weight - force, weight * length / 2 - force * length])
    tip = np.array([0.0, force, force * length])
    moment, _ = section_cut(beam, cells, placed, 9.81, [("root", root), ("tip", tip)])
    shape = place(
        beam, cells, (moment / cells.bending_stiffness, straight[1]), "root", np.zeros(2), 0.0
    )
    stiffness = MODULUS * inertia
    unit_moment = placed.middles[:, 0] - length
    deflection = np.sum(-unit_moment * moment / cells.bending_stiffness * cells.widths)
    expected = force * length**3 / (3 * stiffness) - weight * length**3 / (8 * stiffness)
    assert deflection == pytest.approx(expected, rel=1e-6)
    # the bent shape rises by the same, but for the squared slope
    assert shape.pins["tip"][1] == pytest.approx(expected, rel=3e-4)


@pytest.mark.parametrize("name", BEAMS)
def test_cells_carry_the_mass_of_the_beam(name: str) -> None:
    beam = nominal_structure(SPRING).beams[name]
    cells = mesh(beam, MODULUS)
    middles = cells.edges[:-1] + cells.widths / 2
    assert cells.edges[[0, -1]] == pytest.approx([beam.start, beam.end])
    assert np.sum(cells.masses) == pytest.approx(beam.mass)
    assert cells.masses @ middles / beam.mass == pytest.approx(beam.mass_centre)
    assert np.all(cells.masses >= 0)
    assert np.all(cells.masses[middles < beam.mass_span[0]] == 0)


@every_case
def test_ground_carries_all_weights(strokes: Array, payload: float) -> None:
    structure = nominal_structure(SPRING)
    weights = mass_points(structure, strokes, payload)
    force = 9.81 * sum(mass for mass, _ in weights)
    moment = 9.81 * sum(mass * point[0] for mass, point in weights)
    reaction = solve(structure, strokes, payload).reaction
    assert reaction == pytest.approx([0.0, force, moment], abs=1e-6)


@every_case
def test_cylinder_forces_are_slopes_of_the_potential(strokes: Array, payload: float) -> None:
    structure, step = nominal_structure(SPRING), 1e-5
    forces = solve(structure, strokes, payload).forces

    def potential(stroke: Array) -> float:
        return 9.81 * sum(m * float(p[1]) for m, p in mass_points(structure, stroke, payload))

    for i, name in enumerate(("lift_cylinder", "jib_cylinder")):
        ahead = strokes + step * np.eye(3)[i]
        behind = strokes - step * np.eye(3)[i]
        push = (potential(ahead) - potential(behind)) / (2 * step)
        assert forces[name] == pytest.approx(-push, rel=1e-6)


@every_case
def test_front_pad_holds_the_extension(strokes: Array, payload: float) -> None:
    structure = nominal_structure(SPRING)
    angle = pose(structure.geometry, strokes).jib_angle[0]
    arm = 1.8 - (strokes[2] - 0.404)
    expected = 9.81 * np.cos(angle) * (58.6 * 1.15 + payload * 2.45) / arm
    assert solve(structure, strokes, payload).forces["front_pad"] == pytest.approx(expected)


@every_case
def test_rods_balance_the_weight_at_their_common_pin(strokes: Array, payload: float) -> None:
    structure = nominal_structure(SPRING)
    p = pose(structure.geometry, strokes)
    forces = solve(structure, strokes, payload).forces
    total = np.array([0.0, -9.81 * structure.pin_masses[1]])
    ends = (("jib_cylinder", p.jib_cylinder_base), ("rocker", p.rocker_pivot))
    for name, end in (*ends, ("coupler", p.coupler_pin)):
        away = end[0] - p.rocker_head[0]
        total += forces[name] * away / np.hypot(*away)
    assert sum(structure.pin_masses) == pytest.approx(11.52 + 7.9)
    assert total == pytest.approx([0.0, 0.0], abs=1e-6)


@every_case
def test_extension_alone_is_an_overhanging_beam(strokes: Array, payload: float) -> None:
    # uniform weight, so that the table of deflections holds
    structure = stiffened(nominal_structure(1e18), "extension")
    extension = replace(structure.beams["extension"], mass_centre=1.225)
    structure = replace(structure, beams=structure.beams | {"extension": extension})
    angle = pose(structure.geometry, strokes).jib_angle[0]
    span = 2.204 - strokes[2]
    over = 2.45 - span
    line, force = 58.6 * 9.81 / 2.45, payload * 9.81
    bending, stretching = MODULUS * 4.15e-6, MODULUS * 0.00191
    sag = force * over**2 * (span + over) / 3
    sag += line * over * (3 * over**3 + 4 * over**2 * span - span**3) / 24
    along = -np.sin(angle) * (force * 2.45 + line * 2.45**2 / 2) / stretching
    deflection = solve(structure, strokes, payload).tip_deflection
    c, s = np.cos(angle), np.sin(angle)
    in_jib = np.array([[c, s], [-s, c]]) @ deflection
    assert in_jib == pytest.approx([along, -c * sag / bending], rel=2e-5)


@every_case
def test_spring_alone_turns_the_crane_about_its_foot(strokes: Array, payload: float) -> None:
    structure = stiffened(nominal_structure(SPRING))
    result = solve(structure, strokes, payload)
    turn = -result.reaction[2] / SPRING
    x, y = pose(structure.geometry, strokes).tip[0] - np.array([0.0, -0.311])
    assert result.tip_deflection == pytest.approx([-turn * y, turn * x], rel=1e-5, abs=1e-9)


@every_case
def test_contributions_add_up_and_payload_superposes(strokes: Array, payload: float) -> None:
    structure = nominal_structure(SPRING)
    empty, half, full = (solve(structure, strokes, payload * f) for f in (0.0, 0.5, 1.0))
    force = solve(replace(structure, gravity=0.0), strokes, payload, (0.0, -payload * 9.81))
    assert full.tip_deflection == pytest.approx(sum(full.contributions.values()))
    assert full.tip_deflection == pytest.approx(empty.tip_deflection + force.tip_deflection)
    assert 2 * half.tip_deflection == pytest.approx(empty.tip_deflection + full.tip_deflection)


@every_case
def test_small_loads_bend_the_assembled_crane_as_virtual_work_says(
    strokes: Array, payload: float
) -> None:
    # curvatures integrated to shapes and pins joined anew: another road than the unit loads
    structure = replace(nominal_structure(SPRING), gravity=9.81e-3)
    expected = solve(structure, strokes, payload).tip_deflection
    found = solve_nonlinear(structure, strokes, payload).tip_deflection
    assert found == pytest.approx(expected, rel=3e-4, abs=3e-8)


@pytest.mark.parametrize("solver", [solve, solve_nonlinear])
@pytest.mark.parametrize(("strokes", "payload"), CASES[:2])
def test_flexibility_is_symmetric_and_positive(
    solver: Callable[..., Result], strokes: Array, payload: float
) -> None:
    """Maxwell: horizontal move by a vertical force = vertical move by a horizontal one.

    For the nonlinear solver the tangent flexibility under load: symmetric only if forces and
    kinematics fit together.
    """
    structure, step = nominal_structure(SPRING), 50.0
    columns = []
    for direction in np.eye(2):
        ahead, behind = (
            solver(structure, strokes, payload, tuple(sign * step * direction)).tip_deflection
            for sign in (1.0, -1.0)
        )
        columns.append((ahead - behind) / (2 * step))
    flexibility = np.array(columns)
    assert flexibility[0, 1] == pytest.approx(flexibility[1, 0], rel=1e-5)
    assert np.all(np.linalg.eigvalsh(flexibility) > 0)


@pytest.mark.parametrize(("strokes", "payload"), CASES[:2])
def test_work_of_a_tip_force_is_stored_as_strain_energy(strokes: Array, payload: float) -> None:
    """Half of force times way against closed-form energies of extension and spring."""
    structure = replace(stiffened(nominal_structure(SPRING), "extension"), gravity=0.0)
    force = np.array([30.0, -payload * 9.81])
    result = solve(structure, strokes, 0.0, tuple(force))
    angle = pose(structure.geometry, strokes).jib_angle[0]
    along = force @ [np.cos(angle), np.sin(angle)]
    across = force @ [-np.sin(angle), np.cos(angle)]
    span = 2.204 - strokes[2]
    over = 2.45 - span
    # triangular moment with its peak over the front pad
    bending = (across * over) ** 2 * (span + over) / (6 * MODULUS * 4.15e-6)
    stretching = along**2 * 2.45 / (2 * MODULUS * 0.00191)
    spring = result.reaction[2] ** 2 / (2 * SPRING)
    work = force @ result.tip_deflection / 2
    assert work == pytest.approx(bending + stretching + spring, rel=1e-5)


@pytest.mark.parametrize(("strokes", "payload"), CASES[:2])
def test_deformed_crane_balances_about_its_foot(strokes: Array, payload: float) -> None:
    structure = replace(nominal_structure(SPRING), gravity=0.0)
    force = -payload * 9.81
    result = solve_nonlinear(structure, strokes, 0.0, (0.0, force))
    tip = pose(structure.geometry, strokes).tip[0] + result.tip_deflection
    # the foot lies on the line x = 0
    assert result.reaction == pytest.approx([0.0, -force, -force * tip[0]], abs=1e-4)
