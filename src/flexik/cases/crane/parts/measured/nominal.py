"""Methods that position the nominal crane, with networks of other stages."""

from pathlib import Path

from flexik.cases.crane.measured_section import Campaign
from flexik.cases.crane.parts.crane import FlexibleCrane
from flexik.evaluation.conditions import every
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.learning.storage import load_network
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


def approaches(
    crane: FlexibleCrane, method: combined.Settings, network: Network, campaign: Campaign
) -> tuple[dict[str, Array], Array]:
    """Strokes (n, 3) commanded by each of fields.METHODS at the query (n, 3) of the campaign."""
    query, _ = every(campaign.points, campaign.payloads)
    methods = {"none": uncompensated(crane), "combined": compensating(crane, method, network)}
    current = CraneManipulator(crane.geometry).initial_positions(query[:, :2])
    return {name: method(query, current).values for name, method in methods.items()}, query
