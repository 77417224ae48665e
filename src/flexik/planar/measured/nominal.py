"""Methods that position the nominal machine, with networks of other stages."""

import numpy as np

from flexik.evaluation.conditions import every
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.planar import PlanarMachine
from flexik.planar.conditions import at
from flexik.planar.measured.section import Campaign
from flexik.positioning import combined
from flexik.positioning.method import Answer, Array, Ingredients, Method, Network
from flexik.positioning.none import Uncompensated


def compensating(machine: PlanarMachine, settings: combined.Settings, network: Network) -> Method:
    """Method of kind combined for the nominal `machine`."""
    return combined.build(settings, Ingredients(manipulator_of(machine), network))


def uncompensated(machine: PlanarMachine) -> Method:
    """Method none for the nominal `machine`."""
    return Uncompensated(manipulator_of(machine))


def asked(machine: PlanarMachine, method: Method, query: Array) -> Answer:
    """What `method` says to `query` (n, 3), from the initial positions of the `machine`."""
    conditions = at(query, np.arange(len(query)), manipulator_of(machine))
    return method(conditions.query, conditions.current)


def approaches(
    machine: PlanarMachine, method: combined.Settings, network: Network, campaign: Campaign
) -> tuple[dict[str, Array], Array]:
    """Coordinates (n, k) by each of fields.METHODS at the query (n, 3) of the campaign."""
    query, _ = every(campaign.points, campaign.payloads)
    methods = {"none": uncompensated(machine), "combined": compensating(machine, method, network)}
    return {name: asked(machine, found, query).values for name, found in methods.items()}, query
