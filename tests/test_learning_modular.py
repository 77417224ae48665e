"""Two networks that add up, as one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.errors import FlexikError
from flexik.learning.modular import combine
from flexik.learning.perceptron import ACTIVATIONS, Network, Normalisation, Quantity

STROKES = (Quantity("lift", "m"), Quantity("jib", "m"))
INPUTS = (Quantity("payload", "kg"), *STROKES)
OUTPUTS = (Quantity("x", "m"), Quantity("y", "m"))


def some_normalisation(generator, count, constant):
    """Random extremes; the columns of the mask `constant` do not vary."""
    minimum = generator.uniform(-2.0, 2.0, count)
    extent = np.where(constant, 0.0, generator.uniform(0.5, 3.0, count))
    return Normalisation(minimum, minimum + extent)


def some_network(generator, inputs, n_hidden=3, activation="tanh", constant=(False,) * 5):
    p, q = len(inputs), len(OUTPUTS)
    return Network(
        weights=(
            generator.normal(size=(n_hidden, p + 1)),
            generator.normal(size=(q, n_hidden + 1)),
        ),
        activation=activation,
        input_normalisation=some_normalisation(generator, p, constant[:p]),
        output_normalisation=some_normalisation(generator, q, constant[-q:]),
        inputs=inputs,
        outputs=OUTPUTS,
    )


def assert_adds_up(combined, rigid, correction, generator):
    values = generator.uniform(-5.0, 5.0, (20, len(correction.inputs)))
    columns = [correction.inputs.index(quantity) for quantity in rigid.inputs]
    expected = rigid.predict(values[:, columns]) + correction.predict(values)
    np.testing.assert_allclose(combined.predict(values), expected, rtol=0.0, atol=1e-11)


@settings(deadline=None)
@given(
    seed=st.integers(0, 10**6),
    inputs=st.sampled_from([STROKES, STROKES[::-1], INPUTS[::-1], INPUTS[:1]]),
    sizes=st.tuples(st.integers(1, 6), st.integers(1, 6)),
    activation=st.sampled_from(ACTIVATIONS),
)
def test_predictions_add_up(seed, inputs, sizes, activation):
    generator = np.random.default_rng(seed)
    rigid = some_network(generator, inputs, sizes[0], activation)
    correction = some_network(generator, INPUTS, sizes[1], activation)
    combined = combine(rigid, correction)
    assert combined.n_hidden == sum(sizes)
    assert combined.inputs == INPUTS
    assert combined.outputs == OUTPUTS
    assert combined.activation == activation
    assert_adds_up(combined, rigid, correction, generator)


@settings(deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rigid_constant=st.tuples(*[st.booleans()] * 5),
    correction_constant=st.tuples(*[st.booleans()] * 5),
)
def test_predictions_add_up_where_columns_were_constant(seed, rigid_constant, correction_constant):
    generator = np.random.default_rng(seed)
    rigid = some_network(generator, INPUTS[::-1], constant=rigid_constant)
    correction = some_network(generator, INPUTS, constant=correction_constant)
    assert_adds_up(combine(rigid, correction), rigid, correction, generator)


def test_equations_64_and_65_unit_by_unit():
    unit = Normalisation(-np.ones(2), np.ones(2))
    three = Normalisation(-np.ones(3), np.ones(3))
    w11, w12 = np.array([[0.3, -0.2, 0.1]]), np.array([[0.5, 0.4], [-0.7, 0.2]])
    w21, w22 = np.array([[0.2, 0.6, -0.4, 0.3]]), np.array([[0.05, -0.1], [0.08, 0.02]])
    rigid = Network((w11, w12), "tanh", unit, unit, STROKES, OUTPUTS)
    correction = Network((w21, w22), "tanh", three, unit, INPUTS, OUTPUTS)
    payload, lift, jib = 0.7, -0.4, 0.9
    h1 = math.tanh(0.3 * lift - 0.2 * jib + 0.1)
    h2 = math.tanh(0.2 * payload + 0.6 * lift - 0.4 * jib + 0.3)
    expected = [0.5 * h1 + 0.05 * h2 + 0.3, -0.7 * h1 + 0.08 * h2 + 0.22]
    combined = combine(rigid, correction)
    np.testing.assert_allclose(
        combined.predict(np.array([[payload, lift, jib]]))[0], expected, rtol=1e-14
    )
    # nothing to re-express: the matrices of the equations themselves
    np.testing.assert_allclose(combined.weights[0], [[0.0, *w11[0]], w21[0]], rtol=1e-15)
    np.testing.assert_allclose(combined.weights[1][:, :-1], [[0.5, 0.05], [-0.7, 0.08]], rtol=1e-15)


def test_normalisations_are_the_corrections_inputs_and_the_rigid_outputs():
    generator = np.random.default_rng(1)
    rigid, correction = some_network(generator, STROKES), some_network(generator, INPUTS)
    combined = combine(rigid, correction)
    for found, expected in [
        (combined.input_normalisation, correction.input_normalisation),
        (combined.output_normalisation, rigid.output_normalisation),
    ]:
        np.testing.assert_array_equal(found.minimum, expected.minimum)
        np.testing.assert_array_equal(found.maximum, expected.maximum)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"activation": "logistic"}, "'logistic'.*'tanh'"),
        ({"outputs": OUTPUTS[::-1]}, r"outputs y \(m\), x \(m\).*x \(m\), y \(m\)"),
        ({"outputs": (OUTPUTS[0], Quantity("y", "mm"))}, r"y \(mm\)"),
        ({"inputs": (STROKES[0], Quantity("slew", "rad"))}, r"slew \(rad\).*payload \(kg\)"),
        ({"inputs": (STROKES[0], Quantity("jib", "mm"))}, r"jib \(mm\).*jib \(m\)"),
        ({"weights": (np.ones((3, 3)), np.ones((2, 4)), np.ones((2, 3)))}, r"rigid.*\(3, 2\)"),
    ],
)
def test_networks_that_do_not_fit_are_named(change, message):
    generator = np.random.default_rng(0)
    rigid, correction = some_network(generator, STROKES), some_network(generator, INPUTS)
    with pytest.raises(FlexikError, match=message):
        combine(replace(rigid, **change), correction)


def test_a_deep_correction_is_named():
    generator = np.random.default_rng(0)
    rigid, correction = some_network(generator, STROKES), some_network(generator, INPUTS)
    deep = replace(correction, weights=(np.ones((3, 4)), np.ones((2, 4)), np.ones((2, 3))))
    with pytest.raises(FlexikError, match=r"correction network has hidden layers of \(3, 2\)"):
        combine(rigid, deep)
