"""Perceptron with one hidden layer: a frozen value that maps physical units to physical units."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from flexik.errors import DataError, FlexikError

Array = NDArray[np.float64]

ACTIVATIONS = ("tanh", "logistic")

# a column whose values differ by rounding alone is constant
_CONSTANT_RANGE = 4 * np.finfo(np.float64).eps


def activate(net_input: Array, activation: str) -> Array:
    """Apply equation 45 (tanh) or 46 (logistic) of Rouvinen 1999 to each element."""
    return np.tanh(net_input) if activation == "tanh" else expit(net_input)


def slope(hidden: Array, activation: str) -> Array:
    """Return the derivative of the activation, told by its own output `hidden`."""
    return 1.0 - hidden * hidden if activation == "tanh" else hidden * (1.0 - hidden)


def check_activation(activation: str) -> None:
    """Raise FlexikError unless `activation` is one of ACTIVATIONS."""
    if activation not in ACTIVATIONS:
        raise FlexikError(f"activation {activation!r} is unknown, expected one of {ACTIVATIONS}")


@dataclass(frozen=True)
class Quantity:
    """Name and unit of one column, for example ``Quantity("lift_stroke", "m")``."""

    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class Normalisation:
    """Linear map of each column from [minimum, maximum] to [-1, 1].

    A constant column maps to 0 whatever its value, and back to its minimum.

    Attributes
    ----------
    minimum, maximum : (p,) in the units of the columns
    """

    minimum: Array
    maximum: Array

    def __post_init__(self) -> None:
        if self.minimum.ndim != 1 or self.minimum.shape != self.maximum.shape:
            raise FlexikError(
                "a normalisation needs a minimum and a maximum of the same shape (p,), got "
                f"{self.minimum.shape} and {self.maximum.shape}"
            )
        if not np.all(self.minimum <= self.maximum):
            raise FlexikError("a normalisation needs minimum <= maximum in every column")

    @classmethod
    def from_data(cls, values: Array) -> Self:
        """Extremes of `values` (n, p); DataError when they are empty or not finite."""
        if values.ndim != 2 or len(values) == 0:
            raise DataError(
                f"a normalisation needs data of shape (n, p), n > 0, got {values.shape}"
            )
        minimum, maximum = values.min(axis=0), values.max(axis=0)
        with np.errstate(over="ignore", invalid="ignore"):
            unusable = np.flatnonzero(~np.isfinite(maximum - minimum))
        if unusable.size:
            raise DataError(f"column {unusable[0]} holds values that are not finite or too large")
        return cls(minimum, maximum)

    @property
    def half_range(self) -> Array:
        """Physical units per normalised unit (p,); 0 for a constant column."""
        extent = self.maximum - self.minimum
        magnitude = np.maximum(np.abs(self.minimum), np.abs(self.maximum))
        return np.where(extent > _CONSTANT_RANGE * magnitude, 0.5 * extent, 0.0)

    def to_unit(self, values: Array) -> Array:
        """Normalised values (n, p) of physical `values` (n, p)."""
        half = self.half_range
        varies = np.broadcast_to(half > 0.0, values.shape)
        unit = np.zeros(values.shape)
        np.divide(values - self.minimum, half, out=unit, where=varies)
        return np.subtract(unit, 1.0, out=unit, where=varies)

    def from_unit(self, unit: Array) -> Array:
        """Physical values (n, p) of normalised values (n, p)."""
        return self.minimum + (unit + 1.0) * self.half_range


@dataclass(frozen=True, eq=False)
class Network:
    """Perceptron with one hidden layer and linear outputs (Rouvinen 1999, equation 47).

    In normalised values ``y = output_weights @ f(hidden_weights @ x + hidden_bias) + output_bias``;
    the biases are added, so they are the paper's theta with the sign turned.

    Attributes
    ----------
    hidden_weights, hidden_bias : (h, p) and (h,)
    output_weights, output_bias : (q, h) and (q,)
    activation : one of ACTIVATIONS
    input_normalisation, output_normalisation : of p and of q columns
    inputs, outputs : names and units of the p and q columns

    Raises
    ------
    FlexikError
        When the shapes do not belong together.
    """

    hidden_weights: Array
    hidden_bias: Array
    output_weights: Array
    output_bias: Array
    activation: str
    input_normalisation: Normalisation
    output_normalisation: Normalisation
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]

    def __post_init__(self) -> None:
        check_activation(self.activation)
        p, q, h = len(self.inputs), len(self.outputs), self.hidden_bias.size
        expected = {
            "hidden_weights": (self.hidden_weights, (h, p)),
            "hidden_bias": (self.hidden_bias, (h,)),
            "output_weights": (self.output_weights, (q, h)),
            "output_bias": (self.output_bias, (q,)),
            "input_normalisation": (self.input_normalisation.minimum, (p,)),
            "output_normalisation": (self.output_normalisation.minimum, (q,)),
        }
        for name, (array, shape) in expected.items():
            if array.shape != shape:
                raise FlexikError(f"{name} has shape {array.shape}, expected {shape}")

    @property
    def n_hidden(self) -> int:
        """Number of hidden units."""
        return self.hidden_bias.size

    @property
    def n_weights(self) -> int:
        """Number of free weights, biases among them."""
        return (
            self.hidden_weights.size
            + self.hidden_bias.size
            + self.output_weights.size
            + self.output_bias.size
        )

    def predict(self, values: Array) -> Array:
        """Return the outputs (n, q) at inputs `values` (n, p), both in physical units.

        Raises FlexikError when `values` has another shape.
        """
        unit = self._hidden(values) @ self.output_weights.T + self.output_bias
        return self.output_normalisation.from_unit(unit)

    def jacobian(self, values: Array) -> Array:
        """Return the derivatives (n, q, p) of outputs by inputs at `values` (n, p), physical units.

        They are 0 for a column that was constant in the training data.
        Raises FlexikError when `values` has another shape.
        """
        slopes = slope(self._hidden(values), self.activation)
        half = self.input_normalisation.half_range
        by_input = np.divide(
            self.hidden_weights, half, out=np.zeros_like(self.hidden_weights), where=half > 0.0
        )
        by_hidden = self.output_normalisation.half_range[:, None] * self.output_weights
        return (slopes[:, None, :] * by_hidden) @ by_input

    def _hidden(self, values: Array) -> Array:
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            names = ", ".join(quantity.name for quantity in self.inputs)
            raise FlexikError(
                f"values have shape {values.shape}, expected (n, {len(self.inputs)}): {names}"
            )
        unit = self.input_normalisation.to_unit(values)
        return activate(unit @ self.hidden_weights.T + self.hidden_bias, self.activation)
