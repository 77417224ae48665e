"""Positioning methods of the crane by name."""

from collections.abc import Callable

from flexik.errors import ParameterError
from flexik.kinematics.crane import CraneGeometry
from flexik.positioning import combined, direct, modular, none
from flexik.positioning.crane import inverse
from flexik.positioning.ingredients import Ingredients
from flexik.positioning.method import Method

METHODS: dict[str, Callable[..., Method]] = {
    "none": none.build,
    "combined": combined.build,
    "direct": direct.build,
    "modular": modular.build,
    "inverse": inverse.build,
}


def build_method(name: str, ingredients: Ingredients[CraneGeometry], **options: object) -> Method:
    """Build method `name` of METHODS, with its own options.

    Raises
    ------
    ParameterError
        If there is no such method; the known names are listed.
    """
    if name not in METHODS:
        raise ParameterError(f"method {name!r} is not known, expected one of {sorted(METHODS)}")
    return METHODS[name](ingredients, **options)
