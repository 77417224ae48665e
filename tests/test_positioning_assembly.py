"""Each kind of method in params.yaml becomes the method it names, with its settings."""

from pathlib import Path

import numpy as np
import pytest

from flexik.errors import FlexikError
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.kinematics.crane import forward
from flexik.parameters import load_parameters
from flexik.positioning.combined import Combined
from flexik.positioning.crane.assembly import crane_method, uncompensated
from flexik.positioning.crane.initial import initial_positions
from flexik.positioning.crane.inverse import InverseNetwork
from flexik.positioning.inversion import GaussNewton, GradientDescent
from flexik.positioning.inverted_network import InvertedNetwork
from flexik.positioning.none import Uncompensated

ROOT = Path(__file__).parents[1]
KINDS = {GradientDescent: "gradient_descent", GaussNewton: "gauss_newton"}


@pytest.fixture(scope="module")
def methods():
    return load_parameters(ROOT / "params.yaml").crane.methods


@pytest.fixture(scope="module")
def network():
    """Perceptron from strokes and payload to a tip, linear in a hidden unit for each output."""
    lower, upper = np.zeros(4), np.array([0.535, 0.78, 1.6, 500.0])
    columns = ("lift_stroke", "jib_stroke", "extension_stroke", "payload")
    return Network(
        weights=(np.eye(2, 5), np.eye(2, 3)),
        activation="tanh",
        input_normalisation=Normalisation(lower, upper),
        output_normalisation=Normalisation(np.array([0.0, -4.0]), np.array([6.0, 7.0])),
        inputs=tuple(Quantity(n, "kg" if n == "payload" else "m") for n in columns),
        outputs=(Quantity("tip_x", "m"), Quantity("tip_y", "m")),
    )


class Constant:
    """Predicts one row everywhere."""

    def __init__(self, *row):
        self.row = row

    def predict(self, values):
        """Repeat the row."""
        return np.tile(self.row, (len(values), 1))


def test_none_is_the_rigid_inverse_alone(geometry, points):
    method = uncompensated(geometry)
    assert isinstance(method, Uncompensated)
    command = method(points, np.full(25, 100.0), initial_positions(geometry, points))
    assert forward(geometry, command.strokes) == pytest.approx(points, abs=1e-9)


@pytest.mark.parametrize("n_corrections", [1, 3])
def test_combined_has_its_network_and_corrections(methods, geometry, points, n_corrections):
    network = Constant(0.01, -0.03)
    chosen = methods["combined"].model_copy(update={"n_corrections": n_corrections})
    method = crane_method(chosen, geometry, network)
    assert isinstance(method, Combined)
    assert (method.network, method.n_corrections) == (network, n_corrections)
    # the exact inverse: it ends on the corrected target
    start = initial_positions(geometry, points[12:])
    command = method(points[12:], np.zeros(13), start)
    corrected = points[12:] - network.predict(points[12:])
    assert forward(geometry, command.strokes) == pytest.approx(corrected, abs=1e-9)


def test_a_genetic_inverse_has_its_settings(methods, geometry, points):
    settings = methods["combined_ga"].genetic.model_copy(update={"n_generations": 3, "seed": 5})
    chosen = methods["combined_ga"].model_copy(update={"genetic": settings})
    targets, start = points[:3], initial_positions(geometry, points[:3])
    method = crane_method(chosen, geometry, Constant(0.0, 0.0))
    first = method(targets, np.zeros(3), start)
    assert (first.diagnostics["first_n_generations"] <= 3).all()
    again = crane_method(chosen, geometry, Constant(0.0, 0.0))(targets, np.zeros(3), start)
    assert np.array_equal(again.strokes, first.strokes)
    wide = settings.model_copy(update={"tolerance": 20.0})
    chosen = chosen.model_copy(update={"genetic": wide})
    wide_command = crane_method(chosen, geometry, Constant(0.0, 0.0))(targets, np.zeros(3), start)
    assert (wide_command.diagnostics["first_n_generations"] == 1).all()


@pytest.mark.parametrize(
    ("label", "kind"),
    [
        ("direct", GradientDescent),
        ("modular", GradientDescent),
        ("direct_gauss_newton", GaussNewton),
        ("modular_gauss_newton", GaussNewton),
    ],
)
def test_an_inverted_network_has_its_inversion(methods, geometry, network, label, kind):
    chosen = methods[label]
    method = crane_method(chosen, geometry, network)
    assert isinstance(method, InvertedNetwork)
    assert method.network is network
    assert method.stroke_maximum == geometry.stroke_maximum
    settings = chosen.inversion.model_dump()
    assert settings.pop("kind") == KINDS[kind]
    assert method.inversion == kind(**settings)
    target = network.predict(np.array([[0.2, 0.3, 0.8, 100.0]]))
    command = method(target, np.array([100.0]), np.array([[0.25, 0.35, 0.8]]))
    assert command.strokes[0] == pytest.approx([0.2, 0.3, 0.8], abs=2e-3)


def test_inverse_has_its_network(methods, geometry, points):
    network = Constant(0.2, 0.3)
    method = crane_method(methods["inverse"], geometry, network)
    assert isinstance(method, InverseNetwork)
    assert (method.geometry, method.network) == (geometry, network)


def test_every_method_of_params_yaml_can_be_built(methods, geometry, network):
    kinds = {"combined": Combined, "inverse": InverseNetwork}
    for chosen in methods.values():
        built = crane_method(chosen, geometry, network)
        assert type(built) is kinds.get(chosen.method, InvertedNetwork)


def test_what_is_no_perceptron_cannot_be_inverted(methods, geometry):
    with pytest.raises(FlexikError, match="network 'direct' is a Constant, expected a perceptron"):
        crane_method(methods["direct"], geometry, Constant(0.0, 0.0))
