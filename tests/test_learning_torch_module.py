"""Modules of torch: what they predict, how they learn, and what their files hold."""

import json

import numpy as np
import pytest

from flexik.errors import DataError, TrainingError
from flexik.learning.examples import Examples
from flexik.learning.torch_module import Module, code_of, train
from flexik.learning.torch_storage import load_modules, module_file, packed, unpacked
from flexik.parameters.trainers import Adam, Lbfgs

ADAM = Adam(n_iterations=10, learning_rate=0.01, batch_size=32)
LBFGS = Lbfgs(n_iterations=60)
LAYERS = {"n_hidden": [6, 5], "activation": "Tanh"}
OWN = '''
from torch import nn

class Own(nn.Module):
    """A layer beside a line, with running means."""

    def __init__(self, n_inputs, n_outputs, n_units=4):
        super().__init__()
        self.norm = nn.BatchNorm1d(n_inputs)
        layers = nn.Linear(n_inputs, n_units), nn.SiLU(), nn.Linear(n_units, n_outputs)
        self.bent = nn.Sequential(*layers)
        self.line = nn.Linear(n_inputs, n_outputs)

    def forward(self, x):
        return self.bent(self.norm(x)) + self.line(x)

def own(n_inputs, n_outputs):
    return Own(n_inputs, n_outputs)
'''


def drawn(n, seed):
    values = np.random.default_rng(seed).uniform([0.0, 30.0], [0.8, 500.0], (n, 2))
    x, m = values[:, 0], values[:, 1] / 500.0
    return values, np.column_stack([0.01 * np.sin(3 * x) * m, -0.1 * m * np.cos(2 * x)])


@pytest.fixture(scope="module")
def examples():
    return Examples(*drawn(200, 1), drawn(60, 2))


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "plugged_in.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    return {"name": "plugged_in:Own", "n_units": 3}


def test_layers_predict_what_their_formula_says(examples):
    found, _ = train(LAYERS, examples, [ADAM], 1)
    a = found.arrays
    x = found.input_normalisation.to_unit(examples.inputs)
    for layer in ("0", "2"):
        x = np.tanh(x @ a[f"{layer}.weight"].T + a[f"{layer}.bias"])
    expected = found.output_normalisation.from_unit(x @ a["4.weight"].T + a["4.bias"])
    assert found.predict(examples.inputs) == pytest.approx(expected, abs=1e-14)


def test_lbfgs_goes_on_where_adam_ended(examples):
    alone, first = train(LAYERS, examples, [ADAM], 1)
    both, record = train(LAYERS, examples, [ADAM, LBFGS], 1)
    errors = np.array(record.errors)
    assert record.trainer == "adam + lbfgs"
    assert record.errors[: len(first.errors)] == first.errors
    assert len(errors) == 1 + 10 + 60
    # a step of L-BFGS never raises the error, and many lower it well
    later = errors[11:]
    assert (np.diff(later) <= 0.0).all()
    assert later[-1] < 0.02 * first.errors[first.kept]
    # the record tells of the module that is kept
    for found, told in ((alone, first), (both, record)):
        assert examples.errors(found.predict)[1] == pytest.approx(told.selection_error, rel=1e-12)
    assert examples.errors(both.predict)[0] == pytest.approx(record.training_error, rel=1e-6)


def test_a_start_is_drawn_by_seed_and_restart(examples):
    given = LAYERS, examples, [ADAM]
    one = train(*given, 1, 0)[0].arrays
    for seed, restart, same in ((1, 0, True), (1, 1, False), (2, 0, False)):
        other = train(*given, seed, restart)[0].arrays
        assert all(np.array_equal(one[name], other[name]) for name in one) == same


def test_patience_keeps_the_least_selection_error(examples):
    rough = Adam(n_iterations=60, learning_rate=0.3, selection_patience=5)
    found, record = train(LAYERS, examples, [rough], 1)
    assert record.stop_reason == "selection"
    assert record.kept == len(record.errors) - 1 - 5
    assert examples.errors(found.predict)[1] == pytest.approx(record.selection_error)


def test_a_run_that_overflows_gives_none_or_what_it_had_before(examples):
    found, record = train(LAYERS, examples, [Adam(learning_rate=1e300, n_iterations=5)], 1)
    assert record.stop_reason == "non_finite"
    assert found is None or np.isfinite(found.predict(examples.inputs)).all()


def test_a_module_of_ones_own_is_plugged_in_by_name(own, examples, tmp_path):
    found, record = train(own, examples, [ADAM, LBFGS], 1)
    assert found.arrays["bent.0.weight"].shape == (3, 2)
    assert {"norm.running_mean", "norm.num_batches_tracked"} <= found.arrays.keys()
    assert record.training_error < 0.1
    assert code_of(own) == tmp_path / "plugged_in.py"
    path = tmp_path / "own.json"
    module_file([(found, record)])(path)
    ((read, told),) = load_modules(path)
    assert told == record
    assert np.array_equal(read.predict(examples.inputs), found.predict(examples.inputs))


def test_files_and_messages_between_processes_hold_all(examples, tmp_path):
    trained = [train(LAYERS, examples, [ADAM], 1, restart) for restart in range(2)]
    module_file(trained)(tmp_path / "modules.json")
    for pairs in (load_modules(tmp_path / "modules.json"), [unpacked(packed(*t)) for t in trained]):
        for (read, told), (found, record) in zip(pairs, trained, strict=True):
            assert told == record
            assert np.array_equal(read.predict(examples.inputs), found.predict(examples.inputs))
    assert unpacked(packed(None, trained[0][1])) == (None, trained[0][1])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"n_hidden": [4], "activation": "Cosmic"}, "'Cosmic' is no class of torch.nn"),
        ({"n_hidden": [4], "units": 3}, "unexpected keyword argument 'units'"),
        ({"name": "os:system"}, "expected a class of torch.nn.Module"),
        ({"name": "plugged_in:own"}, "expected a class of torch.nn.Module"),
        ({"name": "plugged_in:Other"}, "no attribute 'Other'"),
        ({"name": "nowhere.at.all:Own"}, "No module named 'nowhere'"),
    ],
)
def test_what_is_no_module_is_told(given, message, own, examples):
    with pytest.raises(TrainingError, match=message):
        train(given, examples, [ADAM], 1)


def test_a_damaged_file_is_told(examples, tmp_path):
    path = tmp_path / "modules.json"
    with pytest.raises(DataError, match=r"modules.json: cannot be read"):
        load_modules(path)
    module_file([train(LAYERS, examples, [ADAM], 1)])(path)
    whole = json.loads(path.read_text())
    path.write_text(path.read_text()[:-10])
    with pytest.raises(DataError, match=r"modules.json: "):
        load_modules(path)
    del whole["modules"][0]["training"]["kept"]
    path.write_text(json.dumps(whole))
    with pytest.raises(DataError, match=r"modules.json: modules.0.training.kept"):
        load_modules(path)


def test_arrays_of_another_module_are_told(examples):
    found, _ = train(LAYERS, examples, [ADAM], 1)
    scales = found.input_normalisation, found.output_normalisation
    other = Module({"n_hidden": [6]}, found.arrays, *scales)
    with pytest.raises(Exception, match=r"arrays .*expected"):
        other.predict(examples.inputs)
