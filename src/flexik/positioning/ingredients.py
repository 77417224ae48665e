"""What methods are built from; a method takes what it needs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from flexik.positioning.method import Network
from flexik.positioning.rigid_inverse import RigidInverse

Geometry = TypeVar("Geometry", covariant=True)


@dataclass(frozen=True)
class Ingredients(Generic[Geometry]):
    """The geometry of a mechanism, its rigid inverse, and trained networks by name."""

    geometry: Geometry
    inverse: RigidInverse
    networks: Mapping[str, Network] = field(default_factory=dict)
