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
from flexik.learning.levenberg_marquardt import LevenbergMarquardt
from flexik.learning.perceptron import Network, Quantity
from flexik.learning.storage import load_network, save_network
from flexik.learning.training import Architecture, TrainingRecord, train_best

EXTREMES = ("minimum", "maximum")


def trained(n_hidden: int | tuple[int, ...] = 3) -> tuple[Network, TrainingRecord]:
    generator = np.random.default_rng(0)
    inputs = generator.uniform(-1.0, 3.0, (60, 2))
    outputs = np.sin(inputs.sum(axis=1, keepdims=True))
    quantities = (Quantity("x", "m"), Quantity("Winkel α", "rad")), (Quantity("stroke", "m"),)
    data = inputs[:40], outputs[:40], inputs[40:], outputs[40:]
    limits = LevenbergMarquardt(n_iterations=5)
    network, record, _ = train_best(*data, Architecture(n_hidden), limits, 5, 2, *quantities)
    return network, record


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "network.json"
    save_network(path, *trained(), "abc")
    return path


@pytest.mark.parametrize("n_hidden", [3, (3, 2)])
def test_round_trip_is_exact(tmp_path, n_hidden):
    network, record = trained(n_hidden)
    save_network(tmp_path / "network.json", network, record, "abc")
    loaded, loaded_record = load_network(tmp_path / "network.json", "abc")
    for found, matrix in zip(loaded.weights, network.weights, strict=True):
        np.testing.assert_array_equal(found, matrix, strict=True)
    for name in ("input_normalisation", "output_normalisation"):
        for extreme in EXTREMES:
            np.testing.assert_array_equal(
                getattr(getattr(loaded, name), extreme), getattr(getattr(network, name), extreme)
            )
    assert (loaded.inputs, loaded.outputs) == (network.inputs, network.outputs)
    assert loaded.activation == network.activation
    assert loaded_record == record
    assert math.isnan(loaded_record.seconds)
    values = np.random.default_rng(1).normal(size=(5, 2))
    np.testing.assert_array_equal(loaded.predict(values), network.predict(values))


def test_retrained_and_resaved_files_are_identical(saved, tmp_path):
    network, record = trained()
    save_network(tmp_path / "again.json", network, replace(record, seconds=1e3), "abc")
    assert (tmp_path / "again.json").read_bytes() == saved.read_bytes()
    save_network(tmp_path / "loaded.json", *load_network(saved), "abc")
    assert (tmp_path / "loaded.json").read_bytes() == saved.read_bytes()
    assert "seconds" not in saved.read_text(encoding="utf-8")


@given(arrays(np.float64, 3, elements=st.floats(allow_nan=False, allow_infinity=False)))
@settings(max_examples=50, deadline=None)
def test_every_float64_survives(tmp_path_factory, bias):
    network, record = trained()
    path = tmp_path_factory.getbasetemp() / "float64.json"
    weights = np.column_stack([network.weights[0][:, :-1], bias])
    save_network(path, replace(network, weights=(weights, network.weights[1])), record, "")
    assert load_network(path)[0].weights[0].tobytes() == weights.tobytes()


def test_no_selection_error_survives(tmp_path):
    network, record = trained()
    save_network(tmp_path / "n.json", network, replace(record, selection_error=None), "abc")
    assert load_network(tmp_path / "n.json")[1].selection_error is None


def test_another_checksum_is_refused_only_when_asked_for(saved):
    load_network(saved)
    with pytest.raises(DataError, match=r"network\.json: parameters_checksum is abc, expected xyz"):
        load_network(saved, "xyz")


def test_missing_file_and_directory(tmp_path):
    with pytest.raises(DataError, match=r"none\.json: there is no such"):
        load_network(tmp_path / "none.json")
    with pytest.raises(DataError, match="cannot be read"):
        load_network(tmp_path)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b'"text"', b"[1]"])
def test_what_is_no_json_object_is_refused(tmp_path, content):
    path = tmp_path / "network.json"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"network\.json: "):
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
    assert len(keys) == 32
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
        (("format",), "other", "format expected"),
        (("version",), 1, "version expected 2"),
        (("activation",), "relu", "activation is 'relu'"),
        (("layers",), [], "layers holds 0, expected a hidden layer and the output layer"),
        (("layers", 1), "x", r"layers\[1\] is not an object with weights and bias"),
        (
            ("layers", 0, "weights"),
            [[1.0, 2.0]],
            r"layers\[0\].weights has shape \(1, 2\), expected \(3, 2\)",
        ),
        (("layers", 0, "weights", 1), [1.0], r"layers\[0\].weights has rows of different lengths"),
        (("layers", 0, "weights", 1), [1.0, None], r"layers\[0\].weights holds something other"),
        (("layers", 1, "weights", 0), ["1.0"] * 3, r"layers\[1\].weights holds something other"),
        (("layers", 0, "bias"), [], r"layers\[0\].weights has shape"),
        (("layers", 1, "bias"), [1.0, 2.0], r"layers\[1\].bias has shape \(2,\), expected \(1,\)"),
        (("layers", 0, "bias", 0), math.nan, r"layers\[0\].bias holds something other"),
        (("layers", 1, "bias", 0), math.inf, r"layers\[1\].bias holds something other"),
        (("layers", 1, "bias", 0), 10**400, r"layers\[1\].bias holds something other"),
        (("inputs",), [], "inputs is empty"),
        (("inputs", 1), "x", r"inputs\[1\] is not an object"),
        (("input_normalisation", "maximum"), [9.0, -9.0], "input_normalisation: .*minimum <="),
        (("output_normalisation", "minimum"), [1.0, 2.0], "output_normalisation.minimum has shape"),
        (("training", "stop_reason"), "tired", "training.stop_reason is 'tired'"),
        (("training", "kept"), -1, "training.kept is -1"),
        (("training", "seed"), -1, "training.seed is -1"),
        (("training", "selection_error"), math.inf, "training.selection_error is not finite"),
        (("training", "errors", 0), math.nan, "training.errors holds something other"),
    ],
)
def test_damaged_values_are_named(saved, keys, value, message):
    edit(saved, keys, lambda inner, key: inner.__setitem__(key, value))
    with pytest.raises(DataError, match=rf"network\.json: {message}"):
        load_network(saved)


def test_a_network_that_is_not_finite_is_not_written(tmp_path):
    network, record = trained()
    path = tmp_path / "network.json"
    with pytest.raises(DataError, match=r"network\.json.*not finite"):
        save_network(
            path,
            replace(network, weights=tuple(w * np.nan for w in network.weights)),
            record,
            "abc",
        )
    assert not list(tmp_path.iterdir())
