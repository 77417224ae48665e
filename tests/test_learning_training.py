"""The door: data in, the network with the least selection error out."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from learning_problems import written
from pydantic import TypeAdapter
from threadpoolctl import threadpool_limits

from flexik.errors import DataError, TrainingError
from flexik.learning import training
from flexik.learning.fit import fit
from flexik.learning.perceptron import Quantity
from flexik.learning.stopping import StopReason
from flexik.learning.storage import load_network, load_restarts
from flexik.learning.training import TRAINERS, Architecture, Lesson, train, train_best
from flexik.parameters.trainers import LevenbergMarquardt, Stopping, Trainer

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


def lesson(given=None, n_hidden=4, settings=QUICK, seed=1, activation="tanh", **others) -> Lesson:
    inputs, outputs = data(60) if given is None else given
    architecture = Architecture(n_hidden, activation)
    return Lesson(inputs, outputs, INPUTS, OUTPUTS, architecture, settings, seed, **others)


NOISY = lesson(data(30, noise=0.1), (6,), selection=data(25, seed=9))


def settings_of(kind: str, **options) -> Stopping:
    return TypeAdapter(Trainer).validate_python({"kind": kind, **options})


def assert_same_weights(one, other) -> None:
    for matrix, expected in zip(one.weights, other.weights, strict=True):
        np.testing.assert_array_equal(matrix, expected, strict=True)


def mean_square(network, inputs, outputs) -> float:
    """Of the normalised errors, by hand."""
    half = (network.output_normalisation.maximum - network.output_normalisation.minimum) / 2.0
    return np.mean(((network.predict(inputs) - outputs) / half) ** 2)


@pytest.mark.parametrize("activation", ["tanh", "logistic"])
def test_learns_in_physical_units(activation):
    settings = LevenbergMarquardt(n_iterations=200)
    network, record = train(lesson(data(300), 8, settings, 0, activation))
    inputs, outputs = data(200, seed=1)
    # strokes span 2 mm; a network in the wrong units would miss by far more
    assert np.sqrt(np.mean((network.predict(inputs) - outputs) ** 2)) < 0.005e-3
    assert (network.inputs, network.outputs) == (INPUTS, OUTPUTS)
    assert (network.n_hidden, network.activation) == (8, activation)
    assert (record.trainer, record.seed, record.selection_error) == ("levenberg_marquardt", 0, None)


def test_record_holds_the_error_of_the_network():
    network, record = train(lesson())
    assert record.errors[-1] == pytest.approx(mean_square(network, *data(60)), rel=1e-9)
    assert record.training_error == pytest.approx(record.errors[-1] ** 0.5)
    assert record.stop_reason is StopReason.ITERATIONS
    assert len(record.errors) == 16


def test_same_seed_same_network_other_seed_another():
    runs = [train(lesson(seed=seed)) for seed in (3, 3, 4)]
    assert_same_weights(runs[0][0], runs[1][0])
    assert runs[0][1] == runs[1][1]
    assert runs[0][1].errors != runs[2][1].errors


def test_the_selection_error_chooses_not_the_training_error():
    network, record, records = train_best(NOISY, 6)
    by_selection = min(records, key=lambda r: r.selection_error)
    by_training = min(records, key=lambda r: r.errors[-1])
    # the case is only a case when the two disagree
    assert by_selection.restart != by_training.restart
    assert record == by_selection
    assert record.selection_error == pytest.approx(mean_square(network, *data(25, seed=9)) ** 0.5)
    assert [r.restart for r in records] == list(range(6))
    # a restart does not depend on the others
    assert train(NOISY, 4)[1] == train_best(NOISY, 5)[2][4] == records[4]


def judge(network) -> float:
    """Something that has nothing to do with the selection data."""
    return float(np.abs(network.weights[1]).max())


def test_a_judge_chooses_where_there_is_one():
    network, record, records = train_best(replace(NOISY, judge=judge), 6)
    errors = [one.selection_error for one in records]
    assert record.selection_error == judge(network) == min(errors)
    usual = train_best(NOISY, 6)[2]
    assert errors != [one.selection_error for one in usual]
    assert [one.errors for one in records] == [one.errors for one in usual]


def test_equal_restarts_give_the_first():
    assert train_best(replace(NOISY, judge=lambda _: 1.0), 3)[1].restart == 0


def test_restarts_as_divided_work(tmp_path):
    network, record, records = train_best(NOISY, 4)
    chosen, restarts, table = written(fit(NOISY, 4), tmp_path).values()
    assert_same_weights(load_network(chosen)[0], network)
    assert load_network(chosen)[1] == record
    assert list(load_restarts(restarts)) == [0, 1, 2, 3]
    assert_same_weights(load_restarts(restarts)[record.restart], network)
    lines = table.read_text().splitlines()
    assert lines[0].startswith("restart,n_hidden,trainer,n_iterations,training_error,")
    assert lines[3].split(",")[:4] == ["2", "6", "levenberg_marquardt", "15"]
    assert float(lines[3].split(",")[5]) == records[2].selection_error


def test_what_is_written_may_be_made_of_the_network(tmp_path):
    def doubled(network):
        return replace(network, weights=(network.weights[0], 2.0 * network.weights[1]))

    chosen, restarts, _ = written(fit(NOISY, 2, doubled), tmp_path).values()
    network, record, _ = train_best(NOISY, 2)
    for found in (load_network(chosen)[0], load_restarts(restarts)[record.restart]):
        assert_same_weights(found, doubled(network))


def overflowing(original, *restarts_to_break):
    """Make initial weights that overflow in the chosen draws."""
    draws = iter(range(100))

    def draw(*arguments):
        weights = original(*arguments)
        factor = 1e200 if next(draws) in restarts_to_break else 1.0
        return (*weights[:-1], weights[-1] * factor)

    return draw


def test_a_failed_restart_is_recorded_and_not_chosen(monkeypatch, tmp_path):
    winner = train_best(NOISY, 6)[1].restart
    broken = overflowing(training.initial_weights, winner)
    monkeypatch.setattr(training, "initial_weights", broken)
    chosen, restarts, table = written(fit(NOISY, 6), tmp_path).values()
    assert load_network(chosen)[1].restart != winner
    assert winner not in load_restarts(restarts)
    line = table.read_text().splitlines()[1 + winner]
    assert line == f"{winner},6,levenberg_marquardt,0,,,non_finite"


def test_no_usable_network_names_network_seed_and_reason(monkeypatch):
    broken = overflowing(training.initial_weights, *range(100))
    monkeypatch.setattr(training, "initial_weights", broken)
    message = r"lift_stroke, jib_stroke with 6 tanh units, seed 1: .*non_finite"
    with pytest.raises(TrainingError, match=message):
        train_best(NOISY, 2)
    with pytest.raises(TrainingError, match=r"seed 7: .*non_finite"):
        train(lesson(seed=7))


def test_a_constant_column_is_no_obstacle():
    inputs, outputs = data(60)
    inputs[:, 1] = 250.0
    outputs[:, 0] = 0.7
    network, record = train(lesson((inputs, outputs)))
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
    bad = change(*data(40))
    with pytest.raises(DataError, match=f"training {message}"):
        lesson(bad)
    with pytest.raises(DataError, match=f"selection {message}"):
        lesson(selection=bad)


def test_more_weights_than_numbers_to_fit():
    # 4 hidden units have 4 * 3 + 2 * 5 = 22 weights, 11 samples hold 22 numbers
    train(lesson(data(11)))
    with pytest.raises(TrainingError, match="4 tanh units have 22 weights, more than the 20"):
        lesson(data(10))
    # 4 * 3 + 3 * 5 + 2 * 4 = 35 weights
    train(lesson(data(18), (4, 3)))
    with pytest.raises(TrainingError, match="4-3 tanh units have 35 weights, more than the 34"):
        lesson(data(17), (4, 3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Architecture(0), "n_hidden=0"),
        (lambda: Architecture((4, 0)), r"n_hidden=\(4, 0\)"),
        (lambda: Architecture(()), r"n_hidden=\(\)"),
        (lambda: Architecture(3, "relu"), "activation='relu'"),
        (lambda: lesson(seed=-1), "seed=-1"),
        (lambda: lesson(settings=QUICK.but(selection_patience=5)), "selection_patience needs"),
        (lambda: train(lesson(settings=Stopping())), "Stopping is not the settings of a trainer"),
    ],
)
def test_settings_out_of_range_are_named(call, message):
    with pytest.raises(TrainingError, match=message):
        call()


def test_spread_weights_start_near_the_origin_or_far_from_it():
    def start(spread: float, restart: int = 0) -> np.ndarray:
        settings = settings_of("lbfgs", n_iterations=1, goal=1e9)
        network, _ = train(lesson(data(150), (5, 4), settings, spread=spread), restart)
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
    given = lesson(data(150), n_hidden, settings_of(name, **options), 0, activation)
    network, record = train(given)
    assert (record.trainer, network.n_hidden) == (name, n_hidden)
    assert record.errors[record.kept] == min(record.errors)
    # the targets' own mean square is about 0.2
    assert record.errors[record.kept] < 0.04
    again, record_again = train(given)
    assert_same_weights(again, network)
    assert record_again == record


@every_trainer
def test_an_observer_sees_the_network_of_every_iteration(name, options):
    seen = []
    given = lesson(data(150), settings=settings_of(name, **options).but(n_iterations=5))
    network, record = train(given, observer=seen.append)
    assert len(seen) == len(record.errors)
    assert_same_weights(seen[record.kept], network)
    for watched, error in zip(seen, record.errors, strict=True):
        assert mean_square(watched, *data(150)) == pytest.approx(error, rel=1e-10)
    # who looks on changes nothing
    assert_same_weights(train(given)[0], network)


@every_trainer
def test_the_number_of_threads_does_not_matter(name, options):
    given = replace(NOISY, settings=settings_of(name, **options).but(n_iterations=10))
    expected = train(given)
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(2)
        with threadpool_limits(2):
            result = train(given)
        assert_same_weights(result[0], expected[0])
        assert result[1] == expected[1]
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


@every_trainer
def test_selection_data_do_not_disturb_the_training(name, options):
    judged = replace(NOISY, settings=settings_of(name, **options).but(n_iterations=10))
    patient = replace(judged, settings=judged.settings.but(selection_patience=1000))
    plain = replace(judged, selection=None)
    assert train(plain)[1].errors == train(judged)[1].errors == train(patient)[1].errors
    assert train(plain)[1].selection_error is None
    assert train(judged)[1].selection_error > 0.0


@pytest.mark.parametrize("name", ["levenberg_marquardt", "levenberg_marquardt_accelerated"])
def test_patience_keeps_the_network_of_the_least_selection_error(name):
    settings = settings_of(name, n_iterations=100, minimum_progress=0.0)

    def run(settings):
        noisy = data(30, noise=0.1)
        return train(lesson(noisy, 6, settings, selection=data(200, seed=9)))[1]

    record, full = run(settings.but(selection_patience=5)), run(settings)
    assert record.stop_reason is StopReason.SELECTION
    assert len(record.errors) - 1 - record.kept == 5
    assert record.errors == full.errors[: len(record.errors)]
    assert record.selection_error < full.selection_error
    # the same as stopping there
    stopped = run(settings.but(n_iterations=max(record.kept, 1)))
    assert record.selection_error == stopped.selection_error


def test_torch_is_imported_by_its_trainers_alone():
    code = (
        "import sys, numpy as np; from flexik.learning import training as t; "
        "from flexik.learning.perceptron import Quantity as Q; x = np.linspace(0, 1, 40)[:, None]; "
        "from flexik.parameters.trainers import LevenbergMarquardtAccelerated as L; "
        "q = [Q('x', 'm')]; t.train(t.Lesson(x, np.sin(x), q, q, t.Architecture(2), L())); "
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
