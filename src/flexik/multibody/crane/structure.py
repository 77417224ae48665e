"""What bends and weighs in the crane, as data, and its meshes (NumPy only)."""

from collections.abc import Sequence
from dataclasses import dataclass

from flexik.kinematics.crane import (
    extension_start_in_jib,
    jib_cylinder_base_in_lift,
    rocker_pivot_in_lift,
)
from flexik.machines.crane import CraneGeometry, Rod
from flexik.multibody.beams import Beam, Elements, discretise

BEAMS = ("pillar", "lift", "jib", "extension")
# Beams whose mesh depends on the extension stroke: the pads slide on them
SLIDING = ("jib", "extension")


@dataclass(frozen=True)
class CraneStructure:
    """What bends and weighs. Lengths in m, masses in kg.

    axis_height : height of the lift and jib axes above B and G in the lift and jib frames.

    The front pad sits at the end of the jib, the rear pad at the rear end of the extension.
    """

    pillar: Beam
    lift: Beam
    jib: Beam
    extension: Beam
    rocker: Rod
    coupler: Rod
    lift_axis_height: float
    jib_axis_height: float
    gravity: float

    @property
    def front_pad(self) -> float:
        """Abscissa of the front pad, jib frame."""
        return self.jib.span[1]

    @property
    def extension_length(self) -> float:
        """Rear end to tip."""
        return self.extension.span[1] - self.extension.span[0]


@dataclass(frozen=True)
class FlexibleCrane:
    """A crane whose equilibria can be computed.

    spring_stiffness : of the ground connection, N m/rad.
    element : one of multibody.elements.ELEMENTS.
    refinement : every beam is cut into this many times its n_elements.
    """

    geometry: CraneGeometry
    structure: CraneStructure
    spring_stiffness: float
    element: str = "geometrically_exact"
    refinement: int = 1

    def rear_pad(self, extension: float) -> float:
        """Abscissa of the rear pad at stroke `extension`, jib frame, m."""
        start = extension_start_in_jib(self.geometry)[0]
        return start + extension - self.structure.extension_length


Meshes = dict[str, Elements]


def beam_meshes(
    crane: FlexibleCrane, extensions: Sequence[float], names: Sequence[str] = BEAMS
) -> list[Meshes]:
    """Meshes of beams `names` at strokes `extensions` in m, a node at every pin and pad."""
    geometry = crane.geometry
    fixed = {
        "pillar": (geometry.lift_pivot[1] + geometry.lift_cylinder_base[1],),
        "lift": (
            geometry.lift_cylinder_head[0],
            jib_cylinder_base_in_lift(geometry)[0],
            rocker_pivot_in_lift(geometry)[0],
        ),
    }
    pads = [crane.rear_pad(extension) for extension in extensions]
    pins: dict[str, list[tuple[float, ...]]] = {n: [at] * len(pads) for n, at in fixed.items()}
    pins["jib"] = [(geometry.coupler_pin[0], 0.0, pad) for pad in pads]
    pins["extension"] = [(crane.structure.front_pad - pad,) for pad in pads]
    found = [discretise(getattr(crane.structure, n), pins[n], crane.refinement) for n in names]
    return [dict(zip(names, meshes, strict=True)) for meshes in zip(*found, strict=True)]
