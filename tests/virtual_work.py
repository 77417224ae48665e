"""Statics and virtual work of the log crane: a calculation that shares nothing with Exudyn.

The crane is statically determinate: 14 equations (four beams, pin H) for 14 forces. Section cuts
give bending moments and tensions, the unit-load theorem the tip deflection (Euler-Bernoulli
bending, stretching, ground spring; pin arms, cylinders and rods rigid). `solve` keeps the rigid
pose; `solve_nonlinear` bends the beams, puts the linkage together again and repeats the statics.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve

from flexik.kinematics.crane import CraneGeometry, pose

Array = NDArray[np.float64]
Vector = tuple[float, float]
SECTIONS = Path(__file__).parents[1] / "data" / "reference" / "crane"
CELLS = 2000  # a beam, at least; midpoint rule
BEAMS = ("pillar", "lift", "jib", "extension")
JOINTS = ("ground", "B", "G", "rear")  # of each beam with the one before
# columns of the unknowns; a joint's force acts on the beam farther out
GROUND_MOMENT, LINKS, FRONT, N_UNKNOWNS = 8, 9, 13, 14
LINK_NAMES = ("lift_cylinder", "jib_cylinder", "rocker", "coupler")
H_ROWS = slice(12, 14)
# Of the source, not of the machine file
GEOMETRY = CraneGeometry(
    lift_pivot=(-0.09, 1.115),
    lift_cylinder_base=(-0.09 + 0.26, 1.115 - 1.04),
    lift_cylinder_head=(0.3025, -0.105),
    jib_pivot=(2.88, -0.024),
    rocker_pivot=(2.88 - 0.19, -0.024 - 0.015),
    jib_cylinder_base=(2.88 - 0.19 - 1.4165, -0.024 - 0.015 + 0.203),
    coupler_pin=(-0.095, 0.24),
    extension_start=(-0.095 + 2.141, 0.24 + 0.008),
    lift_cylinder_length=0.8,
    jib_cylinder_length=1.037,
    rocker_length=0.45,
    coupler_length=0.48,
    stroke_maximum=(0.535, 0.78, 1.6),
)


@dataclass(frozen=True)
class Beam:
    """A beam; coordinates (abscissa, lateral) of its body frame, in m.

    start, end, axis : abscissae of the ends, lateral coordinate of the axis.
    section : (n, 3) rows of x in m, Iz in m4, A in m2; end values hold beyond.
    mass, mass_centre : total mass in kg, abscissa of its centre.
    mass_span : abscissae between which density is proportional to A(x) (a + b x).
    mass_offset : lateral distance of the centre of mass from the axis, positive to the left.
    pins : pin points, joined to the axis point of the same abscissa by a rigid arm.
    corner : abscissa at which the axis turns to the left, and the angle in rad.
    """

    start: float
    end: float
    axis: float
    section: Array
    mass: float
    mass_centre: float
    mass_span: Vector
    mass_offset: float
    pins: dict[str, Vector]
    corner: Vector = (np.inf, 0.0)


@dataclass(frozen=True)
class Structure:
    """The crane without the pins of the two pads, whose place depends on the stroke.

    pin_masses : rocker and coupler as point masses at F, H and I, in kg.
    extension_rear : rear end of the extension in the jib frame at zero stroke, in m.
    spring_stiffness : in N m/rad. elastic_modulus : in Pa. gravity : in m/s2.
    """

    geometry: CraneGeometry
    beams: dict[str, Beam]
    pin_masses: tuple[float, float, float]
    extension_rear: Vector
    spring_stiffness: float
    elastic_modulus: float = 210e9
    gravity: float = 9.81


class Result(NamedTuple):
    """What a pose and load give.

    tip_deflection : (2,) in m, ground frame.
    forces : tensions of `LINK_NAMES` in N; `front_pad` in N, positive where it pushes the
        extension to the left of its axis (up, with the jib level).
    reaction : (3,) force x, y in N and moment in N m of the ground on the pillar base.
    contributions : parts of the deflection (2,) in m; empty for the nonlinear calculation.
    """

    tip_deflection: Array
    forces: dict[str, float]
    reaction: Array
    contributions: dict[str, Array]


class Mesh(NamedTuple):
    """Cells of a beam: edges (n + 1,); the others (n,), at cell middles; masses in kg."""

    edges: Array
    widths: Array
    bending_stiffness: Array
    axial_stiffness: Array
    masses: Array


class Placed(NamedTuple):
    """Ground frame, m and rad: (n, 2) and angles (n,) of the cells, (2,) of each pin."""

    middles: Array
    mass_points: Array
    angles: Array
    end_angle: float
    pins: dict[str, Array]


# placed beams; angles of lift, jib, extension and point H, (5,)
State = tuple[dict[str, Placed], Array]
# of each beam, (n,) each: moment and tension, or curvature and axial strain
Pairs = dict[str, tuple[Array, Array]]


class Posed(NamedTuple):
    """The crane at strokes (3,): beams with all pins, their cells, the rigid pose."""

    structure: Structure
    strokes: Array
    beams: dict[str, Beam]
    meshes: dict[str, Mesh]
    rigid: State


def nominal_structure(spring_stiffness: float) -> Structure:
    """Return the crane of the reference data on a ground spring of N m/rad."""
    # the pillar's body frame is the ground frame turned a quarter: abscissa y, lateral -x; above
    # y = -0.013 that of the box, which leans back to B
    lean = float(np.arctan2(0.09, 1.115 + 0.013))

    def on_box(x: float, y: float) -> Vector:
        up, back = y + 0.013, -x
        ahead = up * np.cos(lean) + back * np.sin(lean)
        return float(ahead - 0.013), float(back * np.cos(lean) - up * np.sin(lean))

    pillar_pins = {"ground": (-0.311, 0.0), "C": on_box(0.17, 0.075), "B": on_box(-0.09, 1.115)}
    (end, _), (centre, offset) = pillar_pins["B"], on_box(-0.017, 0.577)
    lift_pins = {"B": (0.0, 0.0), "D": (0.3025, -0.105), "E": (1.2735, 0.164)}
    lift_pins |= {"F": (2.69, -0.039), "G": (2.88, -0.024)}
    jib_pins = {"I": (-0.095, 0.24), "G": (0.0, 0.0)}
    pillar, lift, jib, extension = (
        np.loadtxt(SECTIONS / f"{name}_section.csv", delimiter=",", skiprows=1) for name in BEAMS
    )
    beams = (
        Beam(
            *(-0.311, end, 0.0, pillar, 93.26, centre, (0.03, 1.118), offset, pillar_pins),
            corner=(-0.013, lean),
        ),
        Beam(0.0, 2.88, 0.03, lift, 124.6, 1.12, (0.0, 2.88), 0.0, lift_pins),
        Beam(-0.446, 1.8, 0.266, jib, 76.6, 0.498, (-0.446, 1.8), -0.0265, jib_pins),
        Beam(0.0, 2.45, 0.0, extension, 58.6, 1.15, (0.0, 2.45), 0.0, {"tip": (2.45, 0.0)}),
    )
    rocker_at_h, coupler_at_i = 11.52 * 0.257 / 0.45, 7.9 * 0.267 / 0.48
    pin_masses = (11.52 - rocker_at_h, rocker_at_h + 7.9 - coupler_at_i, coupler_at_i)
    named = dict(zip(BEAMS, beams, strict=True))
    return Structure(GEOMETRY, named, pin_masses, (-0.404, 0.248), spring_stiffness)


def solve(
    structure: Structure, strokes: Array, payload: float, tip_force: Vector = (0.0, 0.0)
) -> Result:
    """Small-displacement solution about the rigid pose.

    Parameters: strokes (3,) in m, payload in kg, a further force on the tip in N (ground frame).
    """
    crane = _posed(structure, strokes)
    cuts, unknowns = _statics(crane, crane.rigid, payload, tip_force)
    weightless = crane._replace(structure=replace(structure, gravity=0.0))
    virtual = [_statics(weightless, crane.rigid, 0.0, e) for e in ((1.0, 0.0), (0.0, 1.0))]
    parts = {}
    for name, strains in _strains(crane, cuts).items():
        widths = crane.meshes[name].widths
        for i, kind in enumerate(("bending", "axial")):
            work = [unit[name][i] @ (strains[i] * widths) for unit, _ in virtual]
            parts[f"{name}_{kind}"] = np.array(work)
    turn = unknowns[GROUND_MOMENT] / structure.spring_stiffness
    parts["spring"] = np.array([unit[GROUND_MOMENT] * turn for _, unit in virtual])
    return _result(np.sum(list(parts.values()), axis=0), unknowns, parts)


def solve_nonlinear(
    structure: Structure, strokes: Array, payload: float, tip_force: Vector = (0.0, 0.0)
) -> Result:
    """Equilibrium on the deformed crane, beams geometrically exact (extensible elastica).

    Repeats statics, strains, bent shapes and assembly until the tip moves by less than 1e-10 m.
    Moment = EI d(angle)/dx, tension = EA strain, per unstrained length. The front pad meets a fixed
    point of the extension and pushes perpendicular to the axis of the bent jib's end.
    Raises RuntimeError if 60 rounds do not suffice.
    """
    crane = _posed(structure, strokes)
    state = crane.rigid
    rigid_tip = tip = state[0]["extension"].pins["tip"]
    for _ in range(60):
        cuts, unknowns = _statics(crane, state, payload, tip_force)
        base_turn = -unknowns[GROUND_MOMENT] / structure.spring_stiffness
        state = _assemble(crane, _strains(crane, cuts), base_turn, state[1])
        previous, tip = tip, state[0]["extension"].pins["tip"]
        if np.abs(tip - previous).max() < 1e-10:
            return _result(tip - rigid_tip, unknowns, {})
    raise RuntimeError(f"no equilibrium within 60 rounds at strokes {strokes}, payload {payload}")


def mesh(beam: Beam, elastic_modulus: float) -> Mesh:
    """Cells with edges at the ends, pins, rows of the section table and ends of the mass span."""
    x, inertia, area = beam.section.T
    pins = [abscissa for abscissa, _ in beam.pins.values()]
    marks = np.concatenate([[beam.start, beam.end, beam.corner[0]], pins, x, beam.mass_span])
    marks = np.unique(np.clip(marks, beam.start, beam.end))
    counts = np.ceil(np.diff(marks) / (beam.end - beam.start) * CELLS).astype(int) + 3
    widths = np.repeat(np.diff(marks) / counts, counts)
    within = np.concatenate([np.arange(count) for count in counts])
    left = np.repeat(marks[:-1], counts) + within * widths
    middles = left + widths / 2
    areas = np.interp(middles, x, area)
    # a and b of the density from the two moments of mass
    low, high = beam.mass_span
    volumes = np.where((middles > low) & (middles < high), areas * widths, 0.0)
    v0, v1, v2 = (np.sum(volumes * middles**n) for n in range(3))
    a, b = np.linalg.solve([[v0, v1], [v1, v2]], [beam.mass, beam.mass * beam.mass_centre])
    masses = volumes * (a + b * middles)
    bending, axial = elastic_modulus * np.interp(middles, x, inertia), elastic_modulus * areas
    return Mesh(np.append(left, beam.end), widths, bending, axial, masses)


def place(
    beam: Beam, cells: Mesh, strains: tuple[Array, Array], pin: str, at: Array, angle: float
) -> Placed:
    """Bent beam with its pin `pin` at `at` (2,) in m, its near end turned to `angle` in rad."""
    curvature, strain = strains
    turns = np.append(angle, angle + np.cumsum(curvature * cells.widths))
    angles = (turns[:-1] + turns[1:]) / 2
    at_corner, lean = beam.corner
    angles += lean * (cells.edges[:-1] > at_corner - 1e-9)
    turns += lean * (cells.edges > at_corner + 1e-9)
    steps = ((1 + strain) * cells.widths)[:, None] * _tangent(angles)
    nodes = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    pins = {}
    for name, (abscissa, lateral) in beam.pins.items():
        i = np.argmin(np.abs(cells.edges - abscissa))
        pins[name] = nodes[i] + (lateral - beam.axis) * _normal(turns[i])
    shift = at - pins[pin]
    middles = nodes[:-1] + steps / 2 + shift
    mass_points = middles + beam.mass_offset * _normal(angles)
    pins = {name: point + shift for name, point in pins.items()}
    return Placed(middles, mass_points, angles, turns[-1], pins)


def section_cut(
    beam: Beam, cells: Mesh, placed: Placed, gravity: float, loads: list[tuple[str, Array]]
) -> tuple[Array, Array]:
    """Bending moment in N m, positive where it bends to the left, and tension in N, (n,) each.

    loads : pin and (3,) force in N, moment about the ground origin in N m.
    """
    weights = gravity * cells.masses
    turning = weights * placed.mass_points[:, 0]
    weight_loads = -np.column_stack([0 * weights, weights, turning])
    # half of a cell's weight lies on the near side of its middle
    near = np.cumsum(weight_loads, axis=0) - weight_loads / 2
    abscissae = cells.edges[:-1] + cells.widths / 2
    for pin, load in loads:
        near[abscissae > beam.pins[pin][0]] += load
    moment = _cross(placed.middles, near[:, :2]) - near[:, 2]
    return moment, -np.sum(near[:, :2] * _tangent(placed.angles), axis=1)


def _posed(structure: Structure, strokes: Array) -> Posed:
    strokes = np.asarray(strokes, dtype=float)
    jib, extension = structure.beams["jib"], structure.beams["extension"]
    rear, lateral = structure.extension_rear[0] + strokes[2], structure.extension_rear[1]
    on_jib = {"rear": (rear, lateral), "front": (jib.end, lateral)}
    on_extension = {"rear": (0.0, 0.0), "front": (jib.end - rear, 0.0)}
    beams = structure.beams | {
        "jib": replace(jib, pins=jib.pins | on_jib),
        "extension": replace(extension, pins=extension.pins | on_extension),
    }
    meshes = {name: mesh(beam, structure.elastic_modulus) for name, beam in beams.items()}
    p = pose(structure.geometry, strokes)
    unknowns = np.array([p.lift_angle[0], p.jib_angle[0], p.jib_angle[0], *p.rocker_head[0]])
    crane = Posed(structure, strokes, beams, meshes, ({}, unknowns))
    none = {name: (0 * cells.widths, 0 * cells.widths) for name, cells in meshes.items()}
    return crane._replace(rigid=_joined(crane, none, 0.0, unknowns))


def _joined(crane: Posed, strains: Pairs, base_turn: float, unknowns: Array) -> State:
    """Beams in a row, their near ends turned to the angles in `unknowns`, as in `State`."""
    at = np.array([0.0, crane.beams["pillar"].start])
    angles = [np.pi / 2 + base_turn, *unknowns[:3]]
    placed: dict[str, Placed] = {}
    for i, (name, joint) in enumerate(zip(BEAMS, JOINTS, strict=True)):
        if i > 0:
            at = placed[BEAMS[i - 1]].pins[joint]
        here = (joint, at, angles[i])
        placed[name] = place(crane.beams[name], crane.meshes[name], strains[name], *here)
    return placed, unknowns


def _assemble(crane: Posed, strains: Pairs, base_turn: float, guess: Array) -> State:
    """Bent beams joined so that the rods have their lengths and the front pad touches."""
    g, strokes = crane.structure.geometry, crane.strokes
    cylinders = [g.lift_cylinder_length + strokes[0], g.jib_cylinder_length + strokes[1]]
    lengths = [*cylinders, g.rocker_length, g.coupler_length]

    def residual(unknowns: Array) -> Array:
        placed, _ = state = _joined(crane, strains, base_turn, unknowns)
        spans = [np.hypot(*(far - near)) for near, far in _link_ends(state)]
        gap = placed["extension"].pins["front"] - placed["jib"].pins["front"]
        return np.append(np.subtract(spans, lengths), gap @ _normal(placed["jib"].end_angle))

    solution, *_, message = fsolve(residual, guess, xtol=1e-13, full_output=True)
    if np.abs(residual(solution)).max() > 1e-11:
        raise RuntimeError(f"no assembly of the bent crane at {strokes}: {message}")
    return _joined(crane, strains, base_turn, solution)


def _link_ends(state: State) -> list[tuple[Array, Array]]:
    """Near and far end of the cylinders and rods, in the order of `LINK_NAMES`."""
    pillar, lift, jib, _ = (state[0][name].pins for name in BEAMS)
    head = state[1][3:]
    return [(pillar["C"], lift["D"]), (lift["E"], head), (lift["F"], head), (jib["I"], head)]


def _actions(state: State) -> list[tuple[str, str, int, Array]]:
    """Beam, pin, unknown and direction (2,) of every unknown force on a beam."""
    actions = []
    for j, (name, joint) in enumerate(zip(BEAMS, JOINTS, strict=True)):
        for i, e in enumerate(np.eye(2)):
            actions.append((name, joint, 2 * j + i, e))
            if j > 0:
                actions.append((BEAMS[j - 1], joint, 2 * j + i, -e))
    pulls = [_direction(near, far) for near, far in _link_ends(state)]
    feet = (("pillar", "C"), ("lift", "E"), ("lift", "F"), ("jib", "I"))
    for i, ((name, pin), pull) in enumerate(zip(feet, pulls, strict=True)):
        actions.append((name, pin, LINKS + i, pull))
    actions.append(("lift", "D", LINKS, -pulls[0]))
    push = _normal(state[0]["jib"].end_angle)
    return [*actions, ("extension", "front", FRONT, push), ("jib", "front", FRONT, -push)]


def _statics(crane: Posed, state: State, payload: float, tip_force: Vector) -> tuple[Pairs, Array]:
    """Moments and tensions of the beams and the unknowns (14,), in the positions of `state`."""
    jib, extension = state[0]["jib"], state[0]["extension"]
    # bent parts slide a little: the jib too takes the pad's force where the extension does
    jib = jib._replace(pins=jib.pins | {"front": extension.pins["front"]})
    placed = state[0] | {"jib": jib}
    gravity = crane.structure.gravity
    down = np.array([0.0, -gravity])
    at_f, at_h, at_i = (mass * down for mass in crane.structure.pin_masses)
    at_tip = np.array(tip_force) + payload * down
    known = [("lift", "F", at_f), ("jib", "I", at_i), ("extension", "tip", at_tip)]
    actions = _actions(state)
    matrix, load = np.zeros((N_UNKNOWNS, N_UNKNOWNS)), np.zeros(N_UNKNOWNS)
    rows = {name: slice(3 * i, 3 * i + 3) for i, name in enumerate(BEAMS)}
    for name, pin, column, direction in actions:
        matrix[rows[name], column] += _wrench(placed[name].pins[pin], direction)
    matrix[2, GROUND_MOMENT] = 1.0
    for i, (near, far) in enumerate(_link_ends(state)[1:]):
        matrix[H_ROWS, LINKS + 1 + i] = _direction(far, near)
    for name, pin, force in known:
        load[rows[name]] += _wrench(placed[name].pins[pin], force)
    load[H_ROWS] = at_h
    for name, cells in crane.meshes.items():
        moment = cells.masses @ placed[name].mass_points[:, 0]
        load[rows[name]] -= gravity * np.array([0.0, np.sum(cells.masses), moment])
    unknowns = np.asarray(np.linalg.solve(matrix, -load))

    forces = [(*where, unknowns[column] * d) for *where, column, d in actions] + known
    cuts = {}
    for name, beam in crane.beams.items():
        points = placed[name].pins
        loads = [(pin, _wrench(points[pin], f)) for owner, pin, f in forces if owner == name]
        if name == "pillar":
            loads.append(("ground", np.array([0.0, 0.0, unknowns[GROUND_MOMENT]])))
        cuts[name] = section_cut(beam, crane.meshes[name], placed[name], gravity, loads)
    return cuts, unknowns


def _strains(crane: Posed, cuts: Pairs) -> Pairs:
    return {
        name: (cuts[name][0] / cells.bending_stiffness, cuts[name][1] / cells.axial_stiffness)
        for name, cells in crane.meshes.items()
    }


def _result(deflection: Array, unknowns: Array, parts: dict[str, Array]) -> Result:
    forces = {name: float(unknowns[LINKS + i]) for i, name in enumerate(LINK_NAMES)}
    forces["front_pad"] = float(unknowns[FRONT])
    return Result(deflection, forces, unknowns[[0, 1, GROUND_MOMENT]], parts)


def _wrench(point: Array, force: Array) -> Array:
    """Force and its moment about the ground origin, (3,)."""
    return np.append(force, _cross(point, force))


def _direction(near: Array, far: Array) -> Array:
    return (far - near) / np.hypot(*(far - near))


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _tangent(angle: Array | float) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _normal(angle: Array | float) -> Array:
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
