"""Methods of the arm from the parameters of params.yaml."""

from flexik import parameters
from flexik.mechanisms.elastic_arm import ArmGeometry
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
) -> Method:
    """Method with the settings `method` and its trained `network`.

    `deformation` (n, 6), what gauges show in the poses that it should find, is for kind `gauges`
    alone; raises PositioningError if it is missing there.
    """
    if isinstance(method, parameters.CombinedMethod):
        ingredients = Ingredients(geometry, closed_form(geometry), {"deflection": network})
        return combined.build(ingredients, method.n_corrections)
    if not isinstance(method, parameters.GaugeMethod):
        return InverseNetwork(geometry, network)
    if deformation is None:
        raise PositioningError("method gauges: expected the deformation that the gauges show")
    return GaugeNetwork(geometry, network, deformation)
