"""Two networks whose predictions add up, written as one network (modular networks)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexik.errors import FlexikError
from flexik.learning.perceptron import Array, Network, Normalisation, Quantity

Columns = NDArray[np.intp]


def combine(rigid: Network, correction: Network) -> Network:
    """One network that predicts ``rigid`` plus ``correction``, both hidden layers side by side.

    Source: Rouvinen 1999, equations 64 and 65. The networks are normalised each in its own way, so
    their weights are re-expressed, which is linear: inputs in the normalisation of `correction`,
    outputs in that of `rigid`. Where a column was constant there, the other network's normalisation
    takes its place, so that the sum holds for every value.

    Parameters
    ----------
    rigid : its inputs are some or all of those of `correction`, matched by name
    correction : gives the inputs of the result; its outputs are those of `rigid`

    Raises
    ------
    FlexikError
        Naming what does not fit: hidden layers, activation, inputs or outputs.
    """
    columns = _columns(rigid, correction)
    inputs = _input_normalisation(rigid, correction, columns)
    outputs = _output_normalisation(rigid, correction)
    every = np.arange(len(correction.inputs))
    first = [
        _first_layer(rigid, columns, inputs),
        _first_layer(correction, every, inputs),
    ]
    return Network(
        weights=(np.vstack(first), _last_layer(rigid, correction, outputs)),
        activation=rigid.activation,
        input_normalisation=inputs,
        output_normalisation=outputs,
        inputs=correction.inputs,
        outputs=rigid.outputs,
    )


def _columns(rigid: Network, correction: Network) -> Columns:
    """Column of `correction` that each input of `rigid` is, after a look at all that must fit."""
    for role, network in [("rigid", rigid), ("correction", correction)]:
        if len(network.weights) != 2:
            raise FlexikError(
                f"the {role} network has hidden layers of {network.n_hidden} units, "
                "expected one hidden layer"
            )
    if rigid.activation != correction.activation:
        raise FlexikError(
            f"the rigid network has activation {rigid.activation!r}, the correction "
            f"{correction.activation!r}, expected the same"
        )
    if rigid.outputs != correction.outputs:
        raise FlexikError(
            f"the rigid network has outputs {_listed(rigid.outputs)}, the correction "
            f"{_listed(correction.outputs)}, expected the same"
        )
    names = [quantity.name for quantity in correction.inputs]
    for quantity in rigid.inputs:
        if quantity not in correction.inputs:
            raise FlexikError(
                f"input {_listed([quantity])} of the rigid network is none of the correction, "
                f"which has {_listed(correction.inputs)}"
            )
    return np.array([names.index(quantity.name) for quantity in rigid.inputs])


def _listed(columns: Sequence[Quantity]) -> str:
    return ", ".join(f"{quantity.name} ({quantity.unit})" for quantity in columns)


def _input_normalisation(rigid: Network, correction: Network, columns: Columns) -> Normalisation:
    chosen, own = correction.input_normalisation, rigid.input_normalisation
    minimum, maximum = chosen.minimum.copy(), chosen.maximum.copy()
    constant = chosen.half_range[columns] == 0.0
    minimum[columns[constant]] = own.minimum[constant]
    maximum[columns[constant]] = own.maximum[constant]
    return Normalisation(minimum, maximum)


def _output_normalisation(rigid: Network, correction: Network) -> Normalisation:
    chosen, other = rigid.output_normalisation, correction.output_normalisation
    constant = chosen.half_range == 0.0
    return Normalisation(
        chosen.minimum + np.where(constant, other.minimum, 0.0),
        np.where(constant, chosen.minimum + other.maximum, chosen.maximum),
    )


def _first_layer(network: Network, columns: Columns, inputs: Normalisation) -> Array:
    """Hidden weights of `network` for all columns of `inputs`, of which its own are `columns`."""
    own = network.input_normalisation
    half, new_half = own.half_range, inputs.half_range[columns]
    # own unit = scale * new unit + shift; a constant column has unit 0 whatever its value
    centre, new_centre = own.minimum + half, inputs.minimum[columns] + new_half
    scale, shift = _divided(new_half, half), _divided(new_centre - centre, half)
    weights = network.weights[0]
    layer = np.zeros((len(weights), len(inputs.minimum) + 1))
    layer[:, columns] = weights[:, :-1] * scale
    layer[:, -1] = weights[:, -1] + weights[:, :-1] @ shift
    return layer


def _last_layer(rigid: Network, correction: Network, outputs: Normalisation) -> Array:
    """Output weights for both hidden layers side by side."""
    half = outputs.half_range
    parts, centre, bias = [], -outputs.minimum - half, np.zeros(len(half))
    for network in (rigid, correction):
        own, weights = network.output_normalisation, network.weights[1]
        scale = _divided(own.half_range, half)
        parts.append(weights[:, :-1] * scale[:, None])
        bias += weights[:, -1] * scale
        centre += own.minimum + own.half_range
    return np.column_stack([*parts, bias + _divided(centre, half)])


def _divided(values: Array, half: Array) -> Array:
    """`values` in units of `half`; 0 for a constant column."""
    return np.divide(values, half, out=np.zeros(len(half)), where=half > 0.0)
