"""Regressors of scikit-learn: what they predict, and what their files hold."""

import numpy as np
import pytest
from skops import io as skops

from flexik.errors import DataError, FlexikError, TrainingError
from flexik.learning.examples import Examples
from flexik.learning.regressor import TRUSTED, estimator, fit, load_regressor, stored

PROCESS = {
    "name": "GaussianProcessRegressor",
    "kernel": {"name": "RBF", "length_scale": [1.0, 2.0]},
    "alpha": 1e-4,
    "optimizer": None,
}
POLYNOMIAL = {
    "name": "Pipeline",
    "steps": [{"name": "PolynomialFeatures", "degree": 3}, {"name": "Ridge", "alpha": 1e-12}],
}
REGRESSORS = [
    PROCESS,
    POLYNOMIAL,
    {"name": "KernelRidge", "kernel": "rbf", "gamma": 0.5, "alpha": 1e-3},
    {"name": "ExtraTreesRegressor", "n_estimators": 3},
    {"name": "HistGradientBoostingRegressor", "max_iter": 5},
    {"name": "MLPRegressor", "hidden_layer_sizes": [5], "max_iter": 20},
    {
        "name": "Pipeline",
        "steps": [{"name": "Nystroem", "n_components": 20}, {"name": "Ridge"}],
    },
]


def curve(values):
    """Cubic (n, 2) in m of a stroke in m and a payload in kg."""
    x, m = values[:, 0], values[:, 1] / 500.0
    return np.column_stack([0.01 * x * m + 0.002 * x**3, -0.1 * m + 0.03 * x**2 * m + 0.01 * m**2])


def drawn(n, seed):
    values = np.random.default_rng(seed).uniform([0.0, 30.0], [0.8, 500.0], (n, 2))
    return values, curve(values)


@pytest.fixture(scope="module")
def examples():
    return Examples(*drawn(120, 1), drawn(40, 2))


def unit(examples, values):
    """Inputs scaled to [-1, 1], written out."""
    low, high = examples.inputs.min(axis=0), examples.inputs.max(axis=0)
    return 2.0 * (values - low) / (high - low) - 1.0


def kernel_fit(examples, kernel, alpha):
    """Solution of the normal equations of a kernel, at the inputs of the selection."""
    x, at = unit(examples, examples.inputs), unit(examples, examples.selection[0])
    low, high = examples.outputs.min(axis=0), examples.outputs.max(axis=0)
    y = 2.0 * (examples.outputs - low) / (high - low) - 1.0
    weights = np.linalg.solve(kernel(x, x) + alpha * np.eye(len(x)), y)
    return low + (kernel(at, x) @ weights + 1.0) * (high - low) / 2.0


def gaussian(scales):
    return lambda a, b: np.exp(-0.5 * np.sum(((a[:, None] - b) / scales) ** 2, axis=2))


def test_a_polynomial_of_its_degree_is_found(examples):
    found = fit(POLYNOMIAL, 1, examples)
    inputs, outputs = examples.selection
    assert found.predict(inputs) == pytest.approx(outputs, abs=1e-9)
    assert max(examples.errors(found.predict)) < 1e-7


def test_kernels_predict_what_their_equations_say(examples):
    inputs = examples.selection[0]
    for given, scales, alpha in (
        (PROCESS, np.array([1.0, 2.0]), 1e-4),
        (REGRESSORS[2], 1.0, 1e-3),  # gamma 0.5
    ):
        expected = kernel_fit(examples, gaussian(scales), alpha)
        assert fit(given, 1, examples).predict(inputs) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("given", REGRESSORS, ids=lambda given: str(given)[10:40])
def test_a_file_gives_the_same_regressor_and_has_the_same_bytes(given, examples, tmp_path):
    found = fit(given, 7, examples)
    data = stored(found)
    # whatever draws at random is seeded, and files name no address in memory
    assert stored(fit(given, 7, examples)) == data
    path = tmp_path / "some.skops"
    path.write_bytes(data)
    ((read, record),) = load_regressor(path)
    inputs = examples.selection[0]
    assert record is None
    assert np.array_equal(read.predict(inputs), found.predict(inputs))
    assert read.predict(inputs[:0]).shape == (0, 2)
    with pytest.raises(FlexikError, match=r"values have shape \(40, 1\), expected \(n, 2\)"):
        read.predict(inputs[:, :1])


def test_errors_are_those_of_normalised_outputs(examples):
    half = np.ptp(examples.outputs, axis=0) / 2.0
    learnt, chosen = examples.errors(lambda values: curve(values) + 0.5 * half)
    assert (learnt, chosen) == pytest.approx((0.5, 0.5), abs=1e-12)


def test_the_file_of_a_gaussian_process_grows_with_its_samples_not_their_square(examples):
    twice = Examples(*drawn(240, 1), examples.selection)
    one, two = (len(stored(fit(PROCESS, 1, each))) for each in (examples, twice))
    assert two - one < 8 * 120 * 10  # two inputs, two outputs, two weights a sample


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"name": "GaussProcess"}, "scikit-learn has no 'GaussProcess'"),
        ({"name": "KernelRidge", "gama": 1.0}, "KernelRidge: .*unexpected.*'gama'"),
        ({"name": "KernelRidge", "kernel": "cosmic"}, "KernelRidge: .*cosmic"),
        ({"name": "Pipeline"}, "Pipeline: 'steps'"),
    ],
)
def test_what_scikit_learn_does_not_know_is_told(given, message, examples):
    with pytest.raises(TrainingError, match=message):
        fit(given, 1, examples)


def test_an_own_seed_is_kept():
    forest = {"name": "ExtraTreesRegressor", "random_state": 3}
    assert estimator(forest, 7).get_params()["random_state"] == 3
    assert estimator({"name": "ExtraTreesRegressor"}, 7).get_params()["random_state"] == 7


class Other:
    """A type of no library."""


def test_other_types_than_the_trusted_are_refused(examples, tmp_path):
    path, found = tmp_path / "other.skops", fit(POLYNOMIAL, 1, examples)
    path.write_bytes(skops.dumps({"estimator": Other(), "scales": []}))
    with pytest.raises(DataError, match=r"other.skops: no regressor .*Other"):
        load_regressor(path)
    found.estimator.steps[-1][1].more = Other()
    with pytest.raises(TrainingError, match=r"holds .*Other, which is none of the types"):
        stored(found)
    assert not any(name.startswith("builtins") for name in TRUSTED)


def test_a_damaged_or_missing_file_is_told(examples, tmp_path):
    path = tmp_path / "some.skops"
    with pytest.raises(DataError, match=r"some.skops: cannot be read"):
        load_regressor(path)
    path.write_bytes(stored(fit(POLYNOMIAL, 1, examples))[:-200])
    with pytest.raises(DataError, match=r"some.skops: no regressor"):
        load_regressor(path)
