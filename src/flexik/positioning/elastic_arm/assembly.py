"""Methods of the arm from the parameters of params.yaml."""

from flexik import parameters
from flexik.datasets.elastic_arm.learning import KINDS
from flexik.kinematics.elastic_arm import ArmGeometry
from flexik.positioning import combined, none
from flexik.positioning.elastic_arm.closed_form import closed_form
from flexik.positioning.elastic_arm.learnt_angles import GaugeNetwork, InverseNetwork
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import Array, Method, Network, PositioningError


def uncompensated(geometry: ArmGeometry) -> Method:
    """Method `none`."""
    return none.build(Ingredients(geometry, closed_form(geometry)))


def arm_method(
    method: parameters.ArmMethod,
    geometry: ArmGeometry,
    network: Network,
    deformation: Array | None = None,
    kind: str = "gauges",
) -> Method:
    """Method with the settings `method` and its trained `network`.

    `deformation` (n, 6), what gauges show in the poses that it should find, and the `kind` of the
    network are for method `gauges` alone; raises PositioningError if the former is missing there.
    """
    if isinstance(method, parameters.CombinedMethod):
        ingredients = Ingredients(geometry, closed_form(geometry), {"deflection": network})
        return combined.build(ingredients, method.n_corrections)
    if not isinstance(method, parameters.GaugeMethod):
        return InverseNetwork(geometry, network)
    if deformation is None:
        raise PositioningError("method gauges: expected the deformation that the gauges show")
    inputs = tuple(field.name for field in KINDS[kind].inputs)
    return GaugeNetwork(geometry, network, inputs, deformation)
