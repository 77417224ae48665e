"""A network of a planar machine in params.yaml, or what stands in place of one."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Tag

from flexik.parameters.networks import Network, Regressor, TorchModule
from flexik.positioning.beam_model import Passes

Learns = Literal[
    "deflection",
    "remainder",
    "tip",
    "rigid_tip",
    "coordinates",
    "target_shift",
    "stroke_shift",
    "payload_linear",
    "payload_quadratic",
]


class PlanarNetwork(Network):
    """A network of a planar machine.

    learns : deflection (flexible minus rigid tip); remainder (what beam theory leaves of it); tip;
        rigid_tip; coordinates (from tip and payload; machines of two drives); target_shift or
        stroke_shift (what the rigid inverse of the target lacks); payload_linear or
        payload_quadratic (deflection as a polynomial of the payload); given unless it corrects
        another.
    n_passes : over the deformed pose, of the beam theory whose remainder it learns.
    """

    learns: Learns | None = None
    n_passes: Passes = 2


# What a regressor or a module learns: of the others a network alone is judged
Learnt = Literal["deflection", "remainder", "tip", "rigid_tip", "target_shift", "stroke_shift"]


class PlanarRegressor(Regressor):
    """A regressor in place of a network.

    learns : as for a network.
    n_passes : over the deformed pose, of the beam theory whose remainder it learns.
    """

    learns: Learnt
    n_passes: Passes = 2


class PlanarModule(TorchModule):
    """A module of torch in place of a network.

    learns : as for a network.
    n_passes : over the deformed pose, of the beam theory whose remainder it learns.
    """

    learns: Learnt
    n_passes: Passes = 2


def _learner(given: Any) -> str:
    keys = given if isinstance(given, dict) else getattr(type(given), "model_fields", ())
    return next((f"a_{kind}" for kind in ("regressor", "module") if kind in keys), "a_network")


AnyNetwork = Annotated[
    Annotated[PlanarNetwork, Tag("a_network")]
    | Annotated[PlanarRegressor, Tag("a_regressor")]
    | Annotated[PlanarModule, Tag("a_module")],
    Discriminator(_learner),
]
