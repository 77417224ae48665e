"""What joint play and the ground spring do to the tip of the crane, in closed form.

The joint forces of the rigid crane follow from moments about its pins. By the principle of virtual
work the tip gives way, along a unit force on it, by the sum over the joints of the unit force's
joint force times the gap there. A gap opens along the force that the loads put on the joint, so it
changes side where that force changes its sign.
"""

from typing import NamedTuple

import numpy as np

from flexik.kinematics.crane import CranePose, placed, pose
from flexik.multibody.beams import Array
from flexik.multibody.crane.structure import FlexibleCrane

# How many pins a joint has: a rod has one at either end
JOINTS = {
    "lift_pivot": 1,
    "jib_pivot": 1,
    "lift_cylinder": 2,
    "jib_cylinder": 2,
    "rocker": 2,
    "coupler": 2,
}


class JointForces(NamedTuple):
    """Forces of the rigid crane in equilibrium.

    joints : by name of JOINTS; (n, 1) in N, the tension of a rod; (n, 2) in N, the force of a
        pivot on what lies farther out.
    moment : (n,) in N m, of all loads about the ground connection.
    """

    joints: dict[str, Array]
    moment: Array


class Compliance(NamedTuple):
    """Displacement of the tip in m.

    play : (n, 2, 6), for one metre of gap in each pin of the JOINTS, in their order.
    spring : (n, 2), by the ground spring under weights and payload.
    """

    play: Array
    spring: Array


def compliance(crane: FlexibleCrane, strokes: Array, payload: Array) -> Compliance:
    """What joint gaps and the ground spring add to the rigid tip.

    At `strokes` (n, 3) in m under `payload` (n,) in kg.
    """
    gravity = crane.structure.gravity
    load = joint_forces(crane, strokes, -gravity * payload[:, None] * [0.0, 1.0], gravity)
    play = np.empty((len(strokes), 2, len(JOINTS)))
    spring = np.empty((len(strokes), 2))
    for axis, direction in enumerate(np.eye(2)):
        unit = joint_forces(crane, strokes, np.tile(direction, (len(strokes), 1)), 0.0)
        for k, (name, n_pins) in enumerate(JOINTS.items()):
            force = load.joints[name]
            size = np.maximum(np.linalg.norm(force, axis=1), np.finfo(float).tiny)
            play[:, axis, k] = n_pins * np.sum(unit.joints[name] * force, axis=1) / size
        spring[:, axis] = unit.moment * load.moment / crane.spring_stiffness
    return Compliance(play, spring)


def joint_forces(
    crane: FlexibleCrane, strokes: Array, tip_force: Array, gravity: float
) -> JointForces:
    """Joint forces at `strokes` (n, 3) in m under `tip_force` (n, 2) in N and the crane's weight.

    gravity : m/s2, of the crane's own weight; zero leaves the tip force alone.
    """
    p = pose(crane.geometry, strokes)
    jib, head, lift, pillar = _loads(crane, p, tip_force, gravity)
    to_pin = _unit(p.rocker_head - p.coupler_pin)
    coupler = -_moment(jib, p.jib_pivot) / _cross(p.coupler_pin - p.jib_pivot, to_pin)
    # at H the pulls of rocker and jib cylinder balance that of the coupler and the weights
    pull = _sum(head) - coupler[:, None] * to_pin
    to_rocker = _unit(p.rocker_pivot - p.rocker_head)
    to_cylinder = _unit(p.jib_cylinder_base - p.rocker_head)
    across = _cross(to_rocker, to_cylinder)
    beyond_lift_pivot = jib + head + lift
    along_lift = _unit(p.lift_cylinder_base - p.lift_cylinder_head)
    lift_cylinder = -_moment(beyond_lift_pivot, p.lift_pivot) / _cross(
        p.lift_cylinder_head - p.lift_pivot, along_lift
    )
    joints = {
        "lift_pivot": -_sum(beyond_lift_pivot) - lift_cylinder[:, None] * along_lift,
        "jib_pivot": -_sum(jib) - coupler[:, None] * to_pin,
        "lift_cylinder": lift_cylinder[:, None],
        "jib_cylinder": (-_cross(to_rocker, pull) / across)[:, None],
        "rocker": (_cross(to_cylinder, pull) / across)[:, None],
        "coupler": coupler[:, None],
    }
    base = np.array([0.0, crane.structure.pillar.span[0]])
    return JointForces(joints, _moment(beyond_lift_pivot + pillar, base))


Loads = list[tuple[Array, Array]]


def _loads(
    crane: FlexibleCrane, p: CranePose, tip_force: Array, gravity: float
) -> tuple[Loads, Loads, Loads, Loads]:
    """Points (n, 2) in m and forces (n, 2) in N on the jib with extension, H, lift arm, pillar."""
    geometry, parts = crane.geometry, crane.structure
    n = len(tip_force)

    def weight(mass: float) -> Array:
        return np.tile([0.0, -gravity * mass], (n, 1))

    at_rocker = parts.rocker.centre_of_mass / geometry.rocker_length
    at_coupler = parts.coupler.centre_of_mass / geometry.coupler_length
    along = parts.extension.centre_of_mass - parts.extension.span[1]
    centre = placed(p.tip, p.jib_angle, (along, parts.extension.mass_offset))
    in_jib = parts.jib.centre_of_mass, parts.jib_axis_height + parts.jib.mass_offset
    jib_centre = placed(p.jib_pivot, p.jib_angle, in_jib)
    in_lift = parts.lift.centre_of_mass, parts.lift_axis_height + parts.lift.mass_offset
    lift_centre = placed(p.lift_pivot, p.lift_angle, in_lift)
    pillar_centre = np.tile([-parts.pillar.mass_offset, parts.pillar.centre_of_mass], (n, 1))
    return (
        [
            (p.tip, tip_force),
            (centre, weight(parts.extension.mass)),
            (jib_centre, weight(parts.jib.mass)),
            (p.coupler_pin, weight(parts.coupler.mass * at_coupler)),
        ],
        [
            (p.rocker_head, weight(parts.rocker.mass * at_rocker)),
            (p.rocker_head, weight(parts.coupler.mass * (1 - at_coupler))),
        ],
        [
            (lift_centre, weight(parts.lift.mass)),
            (p.rocker_pivot, weight(parts.rocker.mass * (1 - at_rocker))),
        ],
        [(pillar_centre, weight(parts.pillar.mass))],
    )


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _moment(loads: Loads, about: Array) -> Array:
    return np.sum([_cross(point - about, force) for point, force in loads], axis=0)


def _sum(loads: Loads) -> Array:
    return np.sum([force for _, force in loads], axis=0)
