"""Perceptron with hidden layers: a frozen value that maps physical units to physical units."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flexik.errors import DataError, FlexikError

Array = NDArray[np.float64]

ACTIVATIONS = ("tanh", "logistic")

# a column whose values differ by rounding alone is constant
_CONSTANT_RANGE = 4 * np.finfo(np.float64).eps


def activate(net_input: Array, activation: str, out: Array | None = None) -> Array:
    """Apply equation 45 (tanh) or 46 (logistic) of Rouvinen 1999 to each element."""
    if activation == "tanh":
        return np.tanh(net_input, out=out)
    # 1 / (1 + exp(-z)) written with tanh, which NumPy computes several times faster
    values = np.tanh(np.multiply(net_input, 0.5, out=out), out=out)
    values += 1.0
    values *= 0.5
    return values


def slope(hidden: Array, activation: str) -> Array:
    """Return the derivative of the activation, told by its own output `hidden`."""
    if activation == "tanh":
        square = hidden * hidden
        return np.subtract(1.0, square, out=square)
    rest = 1.0 - hidden
    return np.multiply(hidden, rest, out=rest)


def bend(hidden: Array, activation: str) -> Array:
    """Return the second derivative divided by the first, told by the output `hidden`."""
    return -2.0 * hidden if activation == "tanh" else 1.0 - 2.0 * hidden


def check_activation(activation: str) -> None:
    """Raise FlexikError unless `activation` is one of ACTIVATIONS."""
    if activation not in ACTIVATIONS:
        raise FlexikError(f"activation {activation!r} is unknown, expected one of {ACTIVATIONS}")


@dataclass(frozen=True)
class Quantity:
    """Name and unit of one column, for example ``Quantity("lift_stroke", "m")``."""

    name: str
    unit: str


class Column(Protocol):
    """Anything with a name and a unit."""

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def unit(self) -> str: ...  # noqa: D102


def quantities(columns: Iterable[Column]) -> list[Quantity]:
    """Name and unit of each of `columns`."""
    return [Quantity(column.name, column.unit) for column in columns]


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
    """Perceptron with one or more hidden layers and linear outputs (Rouvinen 1999, equation 47).

    In normalised values ``a[0] = x``, ``a[k] = f(W[k] @ [a[k - 1], 1])`` for each hidden layer and
    ``y = W[-1] @ [a[-1], 1]``; the biases are added, so they are the paper's theta with the sign
    turned.

    Attributes
    ----------
    weights : one matrix (units, inputs of the layer + 1) a layer, the output layer last; the last
        column is the bias
    activation : one of ACTIVATIONS
    input_normalisation, output_normalisation : of p and of q columns
    inputs, outputs : names and units of the p and q columns

    Raises
    ------
    FlexikError
        When the shapes do not belong together.
    """

    weights: tuple[Array, ...]
    activation: str
    input_normalisation: Normalisation
    output_normalisation: Normalisation
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]

    def __post_init__(self) -> None:
        check_activation(self.activation)
        if len(self.weights) < 2:
            raise FlexikError(
                f"weights are of {len(self.weights)} layers, expected at least a hidden layer and "
                "the output layer"
            )
        p, q = len(self.inputs), len(self.outputs)
        n_columns = p + 1
        for k, matrix in enumerate(self.weights):
            n_units = q if k == len(self.weights) - 1 else len(matrix)
            if matrix.shape != (n_units, n_columns):
                raise FlexikError(
                    f"weights[{k}] has shape {matrix.shape}, expected {(n_units, n_columns)}"
                )
            n_columns = n_units + 1
        for name, minimum, count in [
            ("input_normalisation", self.input_normalisation.minimum, p),
            ("output_normalisation", self.output_normalisation.minimum, q),
        ]:
            if minimum.shape != (count,):
                raise FlexikError(f"{name} has shape {minimum.shape}, expected {(count,)}")

    @property
    def n_hidden(self) -> int | tuple[int, ...]:
        """Number of hidden units; of several hidden layers one number each."""
        sizes = tuple(len(matrix) for matrix in self.weights[:-1])
        return sizes[0] if len(sizes) == 1 else sizes

    @property
    def n_weights(self) -> int:
        """Number of free weights, biases among them."""
        return sum(matrix.size for matrix in self.weights)

    def predict(self, values: Array) -> Array:
        """Return the outputs (n, q) at inputs `values` (n, p), both in physical units.

        Raises FlexikError when `values` has another shape.
        """
        unit = _layer(self._hidden(values)[-1], self.weights[-1])
        return self.output_normalisation.from_unit(unit)

    def jacobian(self, values: Array) -> Array:
        """Return the derivatives (n, q, p) of outputs by inputs at `values` (n, p), physical units.

        They are 0 for a column that was constant in the training data.
        Raises FlexikError when `values` has another shape.
        """
        half = self.input_normalisation.half_range
        first = self.weights[0][:, :-1]
        by_input = np.divide(first, half, out=np.zeros_like(first), where=half > 0.0)
        derivative = self.output_normalisation.half_range[:, None] * self.weights[-1][:, :-1]
        before = [by_input, *(matrix[:, :-1] for matrix in self.weights[1:-1])]
        for hidden, matrix in zip(self._hidden(values)[::-1], before[::-1], strict=True):
            derivative = (slope(hidden, self.activation)[:, None, :] * derivative) @ matrix
        return derivative

    def _hidden(self, values: Array) -> list[Array]:
        """Outputs (n, units) of every hidden layer."""
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            names = ", ".join(quantity.name for quantity in self.inputs)
            raise FlexikError(
                f"values have shape {values.shape}, expected (n, {len(self.inputs)}): {names}"
            )
        layers = [self.input_normalisation.to_unit(values)]
        for matrix in self.weights[:-1]:
            layers.append(activate(_layer(layers[-1], matrix), self.activation))
        return layers[1:]


def _layer(values: Array, matrix: Array) -> Array:
    return values @ matrix[:, :-1].T + matrix[:, -1]
