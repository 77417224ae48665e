"""The door: data in, the network with the least selection error out."""

import functools
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from threadpoolctl import threadpool_limits

from flexik.errors import DataError, TrainingError
from flexik.learning import training
from flexik.learning.perceptron import Quantity
from flexik.learning.training import (
    TRAINERS,
    Architecture,
    LevenbergMarquardt,
    Stopping,
    StopReason,
    train,
    train_best,
    trainer_settings,
)

INPUTS = (Quantity("x", "m"), Quantity("payload", "kg"))
OUTPUTS = (Quantity("lift_stroke", "m"), Quantity("jib_stroke", "m"))
QUICK = LevenbergMarquardt(n_iterations=15)


def data(n: int, seed: int = 0, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Smooth data of uneven scales: metres near 3, kilograms to 500, strokes of millimetres."""
    generator = np.random.default_rng(seed)
    inputs = generator.uniform([2.0, 0.0], [4.0, 500.0], (n, 2))
    x, payload = inputs[:, 0], inputs[:, 1] / 500.0
    outputs = 1e-3 * np.column_stack([np.sin(2.0 * x) * payload, np.cos(x) + payload**2])
    return inputs, outputs + 1e-3 * noise * generator.normal(size=outputs.shape)


def best(map_function=map, seed=1, n_restarts=6, settings=QUICK):
    return train_best(
        *data(30, noise=0.1), *data(25, seed=9), Architecture(6), settings, seed, n_restarts,
        INPUTS, OUTPUTS, map_function,
    )  # fmt: skip


def reversed_map(function, items):
    """Last item first, results out of order."""
    return [function(item) for item in reversed(list(items))]


def process_map(function, items):
    """Send function and results through pickle, as worker processes do."""
    for item in items:
        there = pickle.loads(pickle.dumps(function))
        yield pickle.loads(pickle.dumps(there(item)))


def assert_same_weights(one, other) -> None:
    for matrix, expected in zip(one.weights, other.weights, strict=True):
        np.testing.assert_array_equal(matrix, expected, strict=True)


def selection_error(network, inputs, outputs) -> float:
    """Root mean square of errors as fractions of half the training range, by hand."""
    half = np.ptp(data(30, noise=0.1)[1], axis=0) / 2.0
    return np.sqrt(np.mean(((network.predict(inputs) - outputs) / half) ** 2))


@pytest.mark.parametrize("activation", ["tanh", "logistic"])
def test_learns_in_physical_units(activation):
    network, record = train(
        *data(300), Architecture(8, activation), LevenbergMarquardt(n_iterations=200), 0,
        INPUTS, OUTPUTS,
    )  # fmt: skip
    inputs, outputs = data(200, seed=1)
    # strokes span 2 mm; a network in the wrong units would miss by far more
    assert np.sqrt(np.mean((network.predict(inputs) - outputs) ** 2)) < 0.005e-3
    assert (network.inputs, network.outputs) == (INPUTS, OUTPUTS)
    assert (network.n_hidden, network.activation) == (8, activation)
    assert (record.trainer, record.seed, record.selection_error) == ("levenberg_marquardt", 0, None)
    assert record.seconds > 0.0


def test_record_holds_the_error_of_the_network():
    network, record = train(*data(60), Architecture(4), QUICK, 3, INPUTS, OUTPUTS)
    inputs, outputs = data(60)
    normalisation = network.output_normalisation
    residuals = normalisation.to_unit(network.predict(inputs)) - normalisation.to_unit(outputs)
    assert record.errors[-1] == pytest.approx(np.mean(residuals**2), rel=1e-9)
    assert record.stop_reason is StopReason.ITERATIONS
    assert len(record.errors) == 16


def test_same_seed_same_network_other_seed_another():
    runs = [train(*data(60), Architecture(4), QUICK, seed, INPUTS, OUTPUTS) for seed in (3, 3, 4)]
    assert_same_weights(runs[0][0], runs[1][0])
    assert runs[0][1] == runs[1][1]
    assert runs[0][1].errors != runs[2][1].errors


def test_training_is_the_first_restart():
    alone = train(*data(30, noise=0.1), Architecture(6), QUICK, 1, INPUTS, OUTPUTS)
    _, _, records = best()
    assert alone[1].errors == records[0].errors


def test_the_selection_error_chooses_not_the_training_error():
    network, record, records = best()
    by_selection = min(records, key=lambda r: r.selection_error)
    by_training = min(records, key=lambda r: r.errors[-1])
    # the case is only a case when the two disagree
    assert by_selection.restart != by_training.restart
    assert record == by_selection
    assert record.selection_error == pytest.approx(selection_error(network, *data(25, seed=9)))
    assert [r.restart for r in records] == list(range(6))
    assert {r.n_restarts for r in records} == {6}


def judge(network) -> float:
    """Something that has nothing to do with the selection data."""
    return float(np.abs(network.weights[1]).max())


def test_a_judge_chooses_where_there_is_one():
    arguments = (*data(60), *data(40, seed=1), Architecture(4), QUICK, 1, 6, INPUTS, OUTPUTS)
    network, record, records = train_best(*arguments, process_map, judge)
    errors = [one.selection_error for one in records]
    assert record.selection_error == judge(network) == min(errors)
    usual = train_best(*arguments)[2]
    assert errors != [one.selection_error for one in usual]
    assert [one.errors for one in records] == [one.errors for one in usual]


@pytest.mark.parametrize("map_function", [reversed_map, process_map])
def test_order_and_workers_do_not_matter(map_function):
    expected, result = best(), best(map_function)
    assert_same_weights(result[0], expected[0])
    assert result[1:] == expected[1:]


def test_equal_restarts_give_the_first(monkeypatch):
    original = training._run
    monkeypatch.setattr(
        training,
        "_run",
        lambda task, k: (lambda n, r: (n, replace(r, selection_error=1.0)))(*original(task, k)),
    )
    assert best(reversed_map)[1].restart == 0


def test_more_restarts_keep_the_earlier_ones():
    few, many = best(n_restarts=2)[2], best(n_restarts=4)[2]
    assert [r.errors for r in few] == [r.errors for r in many[:2]]


def overflowing(original, *restarts_to_break):
    """Make initial weights that overflow in the chosen draws."""
    draws = iter(range(100))

    def draw(*arguments):
        weights = original(*arguments)
        factor = 1e200 if next(draws) in restarts_to_break else 1.0
        return (*weights[:-1], weights[-1] * factor)

    return draw


def test_a_failed_restart_is_recorded_and_not_chosen(monkeypatch):
    winner = best()[1].restart
    broken = overflowing(training.initial_weights, winner)
    monkeypatch.setattr(training, "initial_weights", broken)
    _, record, records = best()
    assert record.restart != winner
    assert len(records) == 6
    failed = records[winner]
    assert (failed.stop_reason, failed.errors) == (StopReason.NON_FINITE, ())
    assert failed.selection_error is None


def test_no_usable_network_names_network_seed_and_reason(monkeypatch):
    broken = overflowing(training.initial_weights, *range(100))
    monkeypatch.setattr(training, "initial_weights", broken)
    message = r"lift_stroke, jib_stroke with 6 tanh units, seed 1: .*non_finite"
    with pytest.raises(TrainingError, match=message):
        best()
    with pytest.raises(TrainingError, match=r"seed 7: .*non_finite"):
        train(*data(60), Architecture(4), QUICK, 7, INPUTS, OUTPUTS)


def test_a_constant_column_is_no_obstacle():
    inputs, outputs = data(60)
    inputs[:, 1] = 250.0
    outputs[:, 0] = 0.7
    network, record = train(inputs, outputs, Architecture(4), QUICK, 0, INPUTS, OUTPUTS)
    assert record.errors[-1] < record.errors[0]
    np.testing.assert_array_equal(network.predict(inputs)[:, 0], 0.7)


def with_value(array: np.ndarray, value: float) -> np.ndarray:
    changed = array.copy()
    changed[17, 1] = value
    return changed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda x, y: (with_value(x, np.nan), y), "inputs, sample 17: payload is nan"),
        (lambda x, y: (x, with_value(y, np.inf)), "outputs, sample 17: jib_stroke is inf"),
        (lambda x, y: (x[:-1], y), "inputs have 39 samples, outputs 40"),
        (lambda x, y: (x[:0], y[:0]), r"inputs have shape \(0, 2\)"),
        (lambda x, y: (x[:, :1], y), r"inputs have shape \(40, 1\), expected \(n, 2\).*x, payload"),
        (lambda x, y: (x, y[:, 0]), r"outputs have shape \(40,\)"),
    ],
)
def test_bad_data_is_named(change, message):
    bad, good = change(*data(40)), data(40)
    common = (Architecture(4), QUICK, 0)
    with pytest.raises(DataError, match=f"training {message}"):
        train(*bad, *common, INPUTS, OUTPUTS)
    with pytest.raises(DataError, match=f"selection {message}"):
        train_best(*good, *bad, *common, 1, INPUTS, OUTPUTS)


def test_more_weights_than_numbers_to_fit():
    start = functools.partial(
        train, settings=QUICK, seed=0, input_quantities=INPUTS, output_quantities=OUTPUTS
    )
    # 4 hidden units have 4 * 3 + 2 * 5 = 22 weights, 11 samples hold 22 numbers
    start(*data(11), Architecture(4))
    with pytest.raises(TrainingError, match="4 hidden units have 22 weights, more than the 20"):
        start(*data(10), Architecture(4))
    # 4 * 3 + 3 * 5 + 2 * 4 = 35 weights
    start(*data(18), Architecture((4, 3)))
    with pytest.raises(TrainingError, match="35 weights, more than the 34"):
        start(*data(17), Architecture((4, 3)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Architecture(0), "n_hidden=0"),
        (lambda: Architecture((4, 0)), r"n_hidden=\(4, 0\)"),
        (lambda: Architecture(()), r"n_hidden=\(\)"),
        (lambda: Architecture(3, "relu"), "activation='relu'"),
        (lambda: best(seed=-1), "seed=-1"),
        (lambda: best(n_restarts=0), "n_restarts=0"),
    ],
)
def test_settings_out_of_range_are_named(call, message):
    with pytest.raises(TrainingError, match=message):
        call()


def test_spread_weights_start_near_the_origin_or_far_from_it():
    def start(spread: float, restart: int = 0) -> np.ndarray:
        settings = trainer_settings("lbfgs", {"n_iterations": 1, "goal": 1e9})
        sizes = Architecture((5, 4))
        network, _ = train(
            *data(150), sizes, settings, 3, INPUTS, OUTPUTS, restart=restart, spread=spread
        )
        return np.concatenate([matrix.ravel() for matrix in network.weights])

    near, far = start(0.1), start(10.0)
    assert 0.09 < np.abs(near).max() <= 0.1
    np.testing.assert_allclose(far, 100.0 * near, rtol=1e-12)
    assert np.abs(start(0.1, restart=1) - near).max() > 0.05


EVERY_TRAINER = {
    "levenberg_marquardt": {"n_iterations": 60},
    "levenberg_marquardt_accelerated": {"n_iterations": 60},
    "back_propagation": {"n_iterations": 40, "mode": "pattern"},
    "adam": {"n_iterations": 200, "learning_rate": 0.02},
    "lbfgs": {"n_iterations": 200},
    "regularised_cg": {"n_iterations": 60},
}
every_trainer = pytest.mark.parametrize(("name", "options"), EVERY_TRAINER.items())


def test_every_trainer_is_tried():
    assert set(EVERY_TRAINER) == set(TRAINERS)


@every_trainer
@pytest.mark.parametrize("n_hidden", [6, (5, 4)])
@pytest.mark.parametrize("activation", ["tanh", "logistic"])
def test_every_trainer_learns_through_the_same_door(name, options, n_hidden, activation):
    settings = trainer_settings(name, options)
    arguments = (*data(150), Architecture(n_hidden, activation), settings, 0, INPUTS, OUTPUTS)
    network, record = train(*arguments)
    assert (record.trainer, network.n_hidden) == (name, n_hidden)
    assert record.errors[record.kept] == min(record.errors)
    # the targets' own mean square is about 0.2
    assert record.errors[record.kept] < 0.04
    again, record_again = train(*arguments)
    assert_same_weights(again, network)
    assert record_again == record


@every_trainer
def test_an_observer_sees_the_network_of_every_iteration(name, options):
    seen = []
    settings = trainer_settings(name, options | {"n_iterations": 5})
    inputs, outputs = data(150)
    arguments = (inputs, outputs, Architecture(4), settings, 0, INPUTS, OUTPUTS)
    network, record = train(*arguments, observer=seen.append)
    assert len(seen) == len(record.errors)
    assert_same_weights(seen[record.kept], network)
    normalisation = network.output_normalisation
    for watched, error in zip(seen, record.errors, strict=True):
        residuals = normalisation.to_unit(watched.predict(inputs)) - normalisation.to_unit(outputs)
        assert np.mean(residuals**2) == pytest.approx(error, rel=1e-10)
    # who looks on changes nothing
    assert_same_weights(train(*arguments)[0], network)


@pytest.mark.parametrize("name", EVERY_TRAINER)
def test_the_number_of_threads_and_processes_does_not_matter(name):
    settings = trainer_settings(name, EVERY_TRAINER[name] | {"n_iterations": 10})
    expected = best(settings=settings, n_restarts=2)
    before = torch.get_num_threads()
    try:
        for n_threads in (1, 2):
            torch.set_num_threads(n_threads)
            with threadpool_limits(n_threads):
                result = best(process_map, settings=settings, n_restarts=2)
            assert_same_weights(result[0], expected[0])
            assert result[1:] == expected[1:]
            assert torch.get_num_threads() == n_threads
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize("name", EVERY_TRAINER)
def test_selection_data_do_not_disturb_the_training(name):
    settings = trainer_settings(name, EVERY_TRAINER[name] | {"n_iterations": 10})
    arguments = (*data(60), Architecture(4), settings, 3, INPUTS, OUTPUTS)
    _, plain = train(*arguments)
    _, judged = train(*arguments, selection=data(25, seed=9))
    patient = replace(settings, selection_patience=1000)
    _, patient_record = train(
        *data(60), Architecture(4), patient, 3, INPUTS, OUTPUTS, data(25, seed=9)
    )
    assert plain.errors == judged.errors == patient_record.errors
    assert plain.selection_error is None
    assert judged.selection_error > 0.0


@pytest.mark.parametrize("name", ["levenberg_marquardt", "levenberg_marquardt_accelerated"])
def test_patience_keeps_the_network_of_the_least_selection_error(name):
    settings = trainer_settings(name, {"n_iterations": 100, "minimum_progress": 0.0})
    patient = replace(settings, selection_patience=5)
    noisy, selection = data(30, noise=0.1), data(200, seed=9)

    def run(settings):
        return train(*noisy, Architecture(6), settings, 1, INPUTS, OUTPUTS, selection)[1]

    record, full = run(patient), run(settings)
    assert record.stop_reason is StopReason.SELECTION
    assert len(record.errors) - 1 - record.kept == 5
    assert record.errors == full.errors[: len(record.errors)]
    assert record.selection_error < full.selection_error
    # the same as stopping there
    stopped = run(replace(settings, n_iterations=max(record.kept, 1)))
    assert record.selection_error == stopped.selection_error


def test_patience_without_selection_data_is_refused():
    patient = replace(QUICK, selection_patience=5)
    with pytest.raises(TrainingError, match="selection_patience needs selection data"):
        train(*data(60), Architecture(4), patient, 0, INPUTS, OUTPUTS)


def test_settings_from_names():
    settings = trainer_settings("levenberg_marquardt", {"n_iterations": 3, "mu": 1})
    assert settings == LevenbergMarquardt(n_iterations=3, mu=1.0)
    for name, trainer in TRAINERS.items():
        assert type(trainer_settings(name)) is trainer.settings


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("newton", {}, "trainer 'newton' is unknown, expected one of levenberg_marquardt, "),
        ("adam", {"mu": 1.0}, "trainer adam: option 'mu' is unknown, expected one of .*beta_1"),
        ("adam", {"beta_1": 1.0}, "trainer adam: trainer setting beta_1=1.0 is out of range"),
        ("lbfgs", {"n_iterations": 1.5}, "n_iterations=1.5, expected an integer"),
        ("lbfgs", {"memory": True}, "memory=True, expected an integer"),
        ("lbfgs", {"goal": "1e-3"}, "goal='1e-3', expected a number"),
        ("lbfgs", {"maximum_seconds": "x"}, "maximum_seconds='x', expected a number or null"),
        ("back_propagation", {"mode": "online"}, "mode=online is out of range"),
        ("back_propagation", {"mode": None}, "mode=None, expected a name"),
    ],
)
def test_bad_trainer_settings_are_named(name, options, message):
    with pytest.raises(TrainingError, match=message):
        trainer_settings(name, options)


def test_settings_of_no_trainer_are_refused():
    with pytest.raises(TrainingError, match="Stopping is not the settings of a trainer"):
        train(*data(60), Architecture(4), Stopping(), 0, INPUTS, OUTPUTS)


def test_levenberg_marquardt_does_not_import_torch():
    code = (
        "import sys, numpy as np; from flexik.learning import training as t; "
        "from flexik.learning.perceptron import Quantity as Q; x = np.linspace(0, 1, 40)[:, None]; "
        "t.train(x, np.sin(x), t.Architecture(2), t.LevenbergMarquardtAccelerated(), 0, "
        "[Q('x', 'm')], [Q('y', 'm')]); assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
