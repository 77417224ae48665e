"""What methods are built from; a method takes what it needs."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from flexik.mechanisms.crane import CraneGeometry
from flexik.positioning.method import Network
from flexik.positioning.rigid_inverse import RigidInverse


@dataclass(frozen=True)
class Ingredients:
    """A crane, its rigid inverse, and trained networks by name."""

    geometry: CraneGeometry
    inverse: RigidInverse
    networks: Mapping[str, Network] = field(default_factory=dict)
