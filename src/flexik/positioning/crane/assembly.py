"""Methods from the parameters of params.yaml."""

from collections.abc import Callable
from typing import Any

from flexik import parameters
from flexik.kinematics.crane import CraneGeometry
from flexik.positioning.crane.closed_form import closed_form
from flexik.positioning.crane.genetic import GeneticSettings, genetic
from flexik.positioning.crane.methods import build_method
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.inversion import GaussNewton, GradientDescent
from flexik.positioning.method import Method, Network
from flexik.positioning.rigid_inverse import RigidInverse

INVERSIONS: dict[str, Callable[..., GradientDescent | GaussNewton]] = {
    "gradient_descent": GradientDescent,
    "gauss_newton": GaussNewton,
}


def uncompensated(geometry: CraneGeometry) -> Method:
    """Method `none`."""
    return build_method("none", Ingredients(geometry, closed_form(geometry)))


def crane_method(
    method: parameters.MethodModel, geometry: CraneGeometry, network: Network
) -> Method:
    """Method with the settings `method` and its trained `network`."""
    inverse: RigidInverse = closed_form(geometry)
    options: dict[str, Any] = {}
    # the name under which each method looks for its network
    name: str = method.method
    if isinstance(method, parameters.CombinedModel):
        name = "deflection"
        options["n_corrections"] = method.n_corrections
        if method.genetic is not None:
            inverse = genetic(geometry, GeneticSettings(**method.genetic.model_dump()))
    elif isinstance(method, parameters.InvertedModel):
        inversion = method.inversion.model_dump()
        options["inversion"] = INVERSIONS[inversion.pop("kind")](**inversion)
    return build_method(method.method, Ingredients(geometry, inverse, {name: network}), **options)
