"""Beams in Exudyn against closed forms; section tables and their reduction to elements."""

import exudyn as exu
import numpy as np
import pytest
from exudyn import itemInterface as item
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_bvp

from flexik.errors import DataError
from flexik.machines.sections import Section, read_section
from flexik.multibody.beams import Beam, discretise
from flexik.multibody.elements import ELEMENTS, place_beam

LENGTH, EI, EA = 2.0, 2.1e5, 2.1e8
UNIFORM = Section(np.array([0.0, LENGTH]), np.full(2, 1e-6), np.full(2, 1e-3))


def uniform_beam(n_elements, section=UNIFORM):
    return Beam(section, 210e9, (0.0, LENGTH), 10.0, 1.0, (0.0, LENGTH), 0.0, n_elements)


def cantilever(element, beam, force, offset=0.0, upright=False):
    """Tip displacement of a clamped beam under `force` at its end, `offset` left of the axis."""
    angle = np.pi / 2 if upright else 0.0
    container = exu.SystemContainer()
    system = container.AddSystem()
    placed = place_beam(system, element, discretise(beam, [()])[0], np.zeros(2), angle)
    ground = system.AddNode(item.NodePointGround())
    fixed = system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    # position, and rotation or the component of the slope vector across the axis
    across = 3 if element == "ancf" and not upright else 2
    for coordinate in (0, 1, across):
        node = placed.coordinate_marker(0, coordinate)
        system.AddObject(item.ObjectConnectorCoordinate(markerNumbers=[fixed, node]))
    marker = placed.marker(LENGTH, offset)
    system.AddLoad(item.LoadForceVector(markerNumber=marker, loadVector=[*force, 0.0]))
    system.Assemble()
    start = LENGTH * np.array([np.cos(angle), np.sin(angle)])
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.newton.absoluteTolerance = 1e-5
    assert exu.MainSolverStatic().SolveSystem(system, settings)
    return placed.shape()[-1] - start


def elastica(force):
    """Tip displacement of an inextensible cantilever under a dead vertical end force."""

    def slope(s, y):
        return np.array([y[1], force / EI * np.cos(y[0])])

    mesh = np.linspace(0.0, LENGTH, 400)
    solution = solve_bvp(
        slope, lambda a, b: np.array([a[0], b[1]]), mesh, np.zeros((2, 400)), tol=1e-8
    )
    x = quad(lambda s: np.cos(solution.sol(s)[0]), 0, LENGTH, epsabs=1e-9)[0]
    y = quad(lambda s: np.sin(solution.sol(s)[0]), 0, LENGTH, epsabs=1e-9)[0]
    return np.array([x - LENGTH, y])


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("n_elements", [1, 3])
def test_small_deflection_is_exact_with_any_number_of_elements(element, n_elements):
    found = cantilever(element, uniform_beam(n_elements), (0.0, -10.0))
    assert found[1] == pytest.approx(-10.0 * LENGTH**3 / (3 * EI), rel=1e-5)


@pytest.mark.parametrize("element", ELEMENTS)
def test_stretching(element):
    found = cantilever(element, uniform_beam(2), (1e4, 0.0))
    assert found == pytest.approx([1e4 * LENGTH / EA, 0.0], abs=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
def test_large_deflection_is_that_of_the_elastica(element):
    force = 1.5 * EI / LENGTH**2  # the tip sags by almost half the length
    expected = elastica(force)
    assert expected[1] < -0.4 * LENGTH
    found = cantilever(element, uniform_beam(24), (0.0, -force))
    assert found == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_force_off_the_axis_bends(element):
    force, offset = -10.0, 0.2
    found = cantilever(element, uniform_beam(4), (force, 0.0), offset)
    assert found[1] == pytest.approx(-force * offset * LENGTH**2 / (2 * EI), rel=1e-3)


@pytest.mark.parametrize("element", ELEMENTS)
def test_upright_beam_bends_like_a_level_one(element):
    upright = cantilever(element, uniform_beam(4), (30.0, 0.0), upright=True)
    level = cantilever(element, uniform_beam(4), (0.0, -30.0))
    assert upright == pytest.approx([-level[1], level[0]], rel=1e-6)


@pytest.mark.parametrize("element", ELEMENTS)
def test_tapered_cantilever_by_the_unit_load(element):
    section = Section(np.array([0.0, LENGTH]), np.array([2e-6, 0.5e-6]), np.full(2, 1e-3))
    flexibility = quad(
        lambda x: (LENGTH - x) ** 2 / (210e9 * np.interp(x, [0, LENGTH], [2e-6, 0.5e-6])), 0, LENGTH
    )[0]
    found = cantilever(element, uniform_beam(16, section), (0.0, -10.0))
    assert found[1] == pytest.approx(-10.0 * flexibility, rel=2e-3)


@given(
    pins=st.lists(st.floats(0.0, LENGTH), max_size=4),
    n_elements=st.integers(1, 9),
    mass=st.floats(1.0, 500.0),
    centre=st.floats(0.8, 1.2),
    refinement=st.sampled_from([1, 2, 4]),
)
def test_elements_keep_mass_centre_and_flexibility(pins, n_elements, mass, centre, refinement):
    beam = Beam(UNIFORM, 210e9, (0.0, LENGTH), mass, centre, (0.0, LENGTH), 0.0, n_elements)
    elements = discretise(beam, [tuple(pins)], refinement)[0]
    length = np.diff(elements.stations)
    assert (length > 0).all()
    assert length.max() <= LENGTH / (n_elements * refinement) * (1 + 1e-6)
    assert elements.node_mass.sum() == pytest.approx(mass)
    assert elements.node_mass @ elements.stations == pytest.approx(mass * centre)
    assert (length / elements.bending_stiffness).sum() == pytest.approx(LENGTH / EI)
    assert (length / elements.axial_stiffness).sum() == pytest.approx(LENGTH / EA)
    assert elements.residual_flexibility == pytest.approx(length**3 / (12 * EI))
    for pin in pins:
        assert np.abs(elements.stations - pin).min() < 0.031


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("x_m,Iz_m4\n0,1\n1,1\n", "columns"),
        ("x_m,Iz_m4,A_m2\n0,1,1\n0,1,1\n", "increase"),
        ("x_m,Iz_m4,A_m2\n0,1,1\n", "increase"),
        ("x_m,Iz_m4,A_m2\n0,1,1\n1,-1,1\n", "positive"),
        ("x_m,Iz_m4,A_m2\n0,1,1\n1,abc,1\n", "positive"),
    ],
)
def test_damaged_section_table(tmp_path, text, complaint):
    path = tmp_path / "section.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=f"section.csv.*{complaint}"):
        read_section(path)


def test_missing_section_table(tmp_path):
    with pytest.raises(DataError, match=r"nowhere\.csv"):
        read_section(tmp_path / "nowhere.csv")
