"""Networks as files: exact, the same bytes again, and damage named by file and key."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexik.errors import DataError
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.storage import (
    load_network,
    load_networks,
    load_restarts,
    network_file,
    packed,
    unpacked,
)
from flexik.learning.training import Architecture, Lesson, TrainingRecord, train
from flexik.parameters.trainers import LevenbergMarquardt

EXTREMES = ("minimum", "maximum")
ONE = ("networks", 0)


def trained(n_hidden: int | tuple[int, ...] = 3, restart: int = 1):
    generator = np.random.default_rng(0)
    inputs = generator.uniform(-1.0, 3.0, (60, 2))
    outputs = np.sin(inputs.sum(axis=1, keepdims=True))
    quantities = (Quantity("x", "m"), Quantity("Winkel α", "rad")), (Quantity("stroke", "m"),)
    limits, selection = LevenbergMarquardt(n_iterations=5), (inputs[40:], outputs[40:])
    data = inputs[:40], outputs[:40], *quantities
    return train(Lesson(*data, Architecture(n_hidden), limits, 5, selection), restart)


def save(path, *networks: tuple[Network, TrainingRecord]) -> None:
    network_file(networks)(path)


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "network.json"
    save(path, trained())
    return path


def assert_same(loaded: Network, network: Network) -> None:
    for found, matrix in zip(loaded.weights, network.weights, strict=True):
        np.testing.assert_array_equal(found, matrix, strict=True)
    for name in ("input_normalisation", "output_normalisation"):
        for extreme in EXTREMES:
            np.testing.assert_array_equal(
                getattr(getattr(loaded, name), extreme), getattr(getattr(network, name), extreme)
            )
    assert (loaded.inputs, loaded.outputs) == (network.inputs, network.outputs)
    assert loaded.activation == network.activation


@pytest.mark.parametrize("n_hidden", [3, (3, 2)])
def test_round_trip_is_exact(tmp_path, n_hidden):
    network, record = trained(n_hidden)
    save(tmp_path / "network.json", (network, record))
    for loaded, loaded_record in (
        load_network(tmp_path / "network.json"),
        unpacked(packed(network, record)),
    ):
        assert_same(loaded, network)
        assert loaded_record == record
        values = np.random.default_rng(1).normal(size=(5, 2))
        np.testing.assert_array_equal(loaded.predict(values), network.predict(values))


def test_several_networks_in_a_file(tmp_path):
    both, path = [trained(), trained(restart=4)], tmp_path / "restarts.json"
    save(path, *both)
    assert [record for _, record in load_networks(path)] == [record for _, record in both]
    assert_same(load_restarts(path)[4], both[1][0])
    with pytest.raises(DataError, match=r"restarts\.json: holds 2 networks, expected one"):
        load_network(path)


def test_an_attempt_that_failed_survives():
    failed = replace(trained()[1], errors=(), selection_error=None)
    assert unpacked(packed(None, failed)) == (None, failed)


def test_retrained_and_resaved_files_are_identical(saved, tmp_path):
    for name, networks in {"again": trained(), "loaded": load_network(saved)}.items():
        save(tmp_path / name, networks)
        assert (tmp_path / name).read_bytes() == saved.read_bytes()


@given(arrays(np.float64, 3, elements=st.floats(allow_nan=False, allow_infinity=False)))
@settings(max_examples=50, deadline=None)
def test_every_float64_survives(tmp_path_factory, bias):
    network, record = trained()
    path = tmp_path_factory.getbasetemp() / "float64.json"
    weights = np.column_stack([network.weights[0][:, :-1], bias])
    save(path, (replace(network, weights=(weights, network.weights[1])), record))
    assert load_network(path)[0].weights[0].tobytes() == weights.tobytes()


def test_missing_file_and_directory(tmp_path):
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(DataError, match="cannot be read"):
            load_network(path)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b'"text"', b"[1]"])
def test_what_is_no_network_file_is_refused(tmp_path, content):
    path = tmp_path / "network.json"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"network\.json: no network file: "):
        load_network(path)


def test_every_truncation_is_refused(saved):
    whole = saved.read_bytes().rstrip()
    for length in range(0, len(whole), 97):
        saved.write_bytes(whole[:length])
        with pytest.raises(DataError, match=r"network\.json"):
            load_network(saved)


def every_key(content, prefix=()):
    """Paths of all keys, at any depth."""
    items = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in items:
        if isinstance(content, dict):
            yield (*prefix, key)
        if isinstance(value, dict) or (isinstance(value, list) and isinstance(value[0], dict)):
            yield from every_key(value, (*prefix, key))


def edit(path, keys, function) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    inner = document
    for key in keys[:-1]:
        inner = inner[key]
    function(inner, keys[-1])
    path.write_text(json.dumps(document), encoding="utf-8")


def test_every_missing_or_mistyped_key_is_named(saved):
    original = saved.read_bytes()
    keys = list(every_key(json.loads(original)))
    assert len(keys) == 31
    for path in keys:
        for damage in (
            lambda inner, key: inner.pop(key),
            lambda inner, key: inner.update({key: True}),
        ):
            saved.write_bytes(original)
            edit(saved, path, damage)
            with pytest.raises(DataError, match=rf"network\.json: .*{path[-1]}"):
                load_network(saved)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("format",), "other", "format: Input should be 'flexik-networks'"),
        (("version",), 1, "version: Input should be 3"),
        (("networks",), [], "networks: .*at least 1"),
        ((*ONE, "activation"), "relu", "activation 'relu'"),
        ((*ONE, "layers"), [], "weights are of 0 layers, expected at least a hidden layer"),
        ((*ONE, "layers", 1), "x", r"networks\.0\.layers\.1: "),
        ((*ONE, "layers", 0, "weights"), [[1.0, 2.0]], ""),
        ((*ONE, "layers", 0, "weights", 1), [1.0], ""),
        ((*ONE, "layers", 0, "weights", 1), [1.0, None], r"networks\.0\.layers\.0\.weights\.1\.1"),
        ((*ONE, "layers", 1, "weights", 0), ["1.0"] * 3, r"networks\.0\.layers\.1\.weights\.0"),
        ((*ONE, "layers", 0, "bias"), [], ""),
        ((*ONE, "layers", 1, "bias"), [1.0, 2.0], ""),
        ((*ONE, "layers", 0, "bias", 0), math.nan, r"networks\.0\.layers\.0\.bias\.0: .*finite"),
        ((*ONE, "layers", 1, "bias", 0), math.inf, r"networks\.0\.layers\.1\.bias\.0: .*finite"),
        ((*ONE, "inputs"), [], ""),
        ((*ONE, "inputs", 1), "x", r"networks\.0\.inputs\.1: "),
        ((*ONE, "input_normalisation", "maximum"), [9.0, -9.0], ".*minimum <="),
        ((*ONE, "output_normalisation", "minimum"), [1.0, 2.0], ".*shape"),
        ((*ONE, "training", "stop_reason"), "tired", r"networks\.0\.training\.stop_reason: "),
    ],
)
def test_damaged_values_are_named(saved, keys, value, message):
    edit(saved, keys, lambda inner, key: inner.__setitem__(key, value))
    with pytest.raises(DataError, match=rf"network\.json: {message}"):
        load_network(saved)


def test_a_network_that_is_not_finite_is_not_written(tmp_path):
    network, record = trained()
    network = replace(network, weights=tuple(w * np.nan for w in network.weights))
    with pytest.raises(DataError, match=r"network\.json.*not finite"):
        save(tmp_path / "network.json", (network, record))
    assert not list(tmp_path.iterdir())
