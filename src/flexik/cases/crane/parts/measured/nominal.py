"""Methods that position the nominal crane, with networks of other stages."""

from collections.abc import Mapping
from pathlib import Path

from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.learning.storage import load_network
from flexik.multibody.crane.structure import FlexibleCrane
from flexik.positioning import combined
from flexik.positioning.method import Array, Ingredients, Method, Network
from flexik.positioning.none import Uncompensated


def read_network(path: Path) -> Network:
    """Trained network of the file `path`."""
    return load_network(path)[0]


def compensating(crane: FlexibleCrane, settings: combined.Settings, network: Network) -> Method:
    """Method of kind combined for the nominal `crane`."""
    return combined.build(settings, Ingredients(CraneManipulator(crane.geometry), network))


def uncompensated(crane: FlexibleCrane) -> Method:
    """Method none for the nominal `crane`."""
    return Uncompensated(CraneManipulator(crane.geometry))


def commanded(
    crane: FlexibleCrane, methods: Mapping[str, Method], query: Array
) -> dict[str, Array]:
    """Strokes (n, 3) in m of `methods` at `query` (n, 3), from the published initial positions."""
    current = CraneManipulator(crane.geometry).initial_positions(query[:, :2])
    return {name: method(query, current).values for name, method in methods.items()}
