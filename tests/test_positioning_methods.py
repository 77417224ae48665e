"""Methods of planar machines, every one on every machine, and each where its answer is known."""

import subprocess
import sys
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from elastic_arm import GEOMETRY as ARM
from planar_machines import FILES, ROOT
from pydantic import TypeAdapter, ValidationError

from flexik.evaluation.conditions import every
from flexik.kinematics.crane import inverse, smallest_extension
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import NOT_CONVERGED, REACHED, STATUS_MEANING
from flexik.learning.perceptron import Network, Normalisation, Quantity
from flexik.machines.planar import read_machine
from flexik.parameters.networks import Network as NetworkModel
from flexik.positioning.combined import Combined
from flexik.positioning.genetic import Genetic, GeneticManipulator
from flexik.positioning.inverse import InverseNetwork
from flexik.positioning.inversion import GaussNewton, GradientDescent
from flexik.positioning.inverted_network import InvertedNetwork
from flexik.positioning.method import Answer, Ingredients, PositioningError
from flexik.positioning.none import Uncompensated
from flexik.positioning.registry import METHODS, Methods, build_of, check_methods


@dataclass(frozen=True)
class Sag:
    """Smooth deflection, about `size` m at 470 kg; stands for the network and for the model."""

    manipulator: object
    size: float

    def predict(self, values):
        """Deflection, as a network gives it."""
        values, payload = values[:, :-1], values[:, -1:]
        x, y = self.manipulator.forward(values).T
        shape = np.column_stack([np.sin(y / 3) + 0.1 * values[:, -1], -0.3 * x - np.cos(x - y) / 4])
        return self.size * payload / 470 * shape

    def tip(self, values, payload):
        """Tip of the flexible model."""
        return self.manipulator.forward(values) + self.predict(np.column_stack([values, payload]))


@dataclass(frozen=True)
class Constant:
    """Predicts one row everywhere."""

    row: tuple

    def predict(self, values):
        """Repeat the row."""
        return np.tile(self.row, (len(values), 1))


@dataclass(frozen=True)
class RigidInverse:
    """The first `n` coordinates of the rigid inverse, and `offset` added."""

    manipulator: object
    n: int
    offset: tuple = (0.0, 0.0)

    def predict(self, values):
        """Coordinates for x, y, payload and branch."""
        current = np.zeros((len(values), len(self.manipulator.lower)))
        return self.manipulator.inverse(values[:, :2], current).values[:, : self.n] + self.offset


def perceptron(manipulator):
    """Tip that is linear in a hidden unit for each output, nearly."""
    k = len(manipulator.lower)
    low, high = np.append(manipulator.lower, 0.0), np.append(manipulator.upper, 500.0)
    reach = manipulator.forward(np.array([manipulator.lower, manipulator.upper]))
    return Network(
        weights=(np.eye(2, k + 2), np.eye(2, 3)),
        activation="tanh",
        input_normalisation=Normalisation(low, high),
        output_normalisation=Normalisation(reach.min(axis=0), reach.max(axis=0)),
        inputs=tuple(Quantity(f"input_{n}", "1") for n in range(k + 1)),
        outputs=(Quantity("tip_x", "m"), Quantity("tip_y", "m")),
    )


@pytest.fixture(scope="module")
def crane(geometry):
    return CraneManipulator(geometry)


@pytest.fixture(scope="module")
def query(points, payloads):
    return every(points, payloads)[0]


@pytest.fixture(scope="module")
def current(crane, query):
    return crane.initial_positions(query[:, :2])


def network_for(needs, manipulator):
    """What answers as a network that learnt `needs` without an error."""
    return {
        None: None,
        "deflection": Sag(manipulator, 0.02),
        "remainder": Sag(manipulator, 1e-4),
        "payload_linear": Constant((0.0, -0.01, 0.0, -0.02)),
        "payload_quadratic": Constant((0.0, -0.01, 0.0, -0.02, 0.0, -0.03)),
        "target_shift": Constant((0.001, 0.01)),
        "stroke_shift": Constant((0.001, -0.001)),
        "tip": perceptron(manipulator),
        "correction": perceptron(manipulator),
        "coordinates": RigidInverse(manipulator, 2),
    }[needs]


def settings(name, **given):
    return TypeAdapter(Methods).validate_python({"it": {"method": name, **given}})["it"]


@dataclass(frozen=True)
class Asked:
    """A method of a machine and its answers to 20 queries, of which row 3 is out of reach."""

    manipulator: object
    network: object
    method: object
    query: np.ndarray
    current: np.ndarray
    answer: Answer


def machine_of(name):
    """A machine of a file, its ground spring known."""
    found = read_machine(FILES[name].relative_to(ROOT))
    return found.with_constants(dict.fromkeys(found.free, 8.5e6))


@pytest.fixture(params=["crane", "arm"])
def asked(crane, name, request, monkeypatch):
    monkeypatch.chdir(ROOT)
    manipulator = {"crane": crane, "arm": ARM}[request.param]
    machine = machine_of({"crane": "crane", "arm": "elastic_arm"}[request.param])
    low, high = manipulator.lower, manipulator.upper
    generator = np.random.default_rng(5)
    inside = low + generator.uniform(0.55, 0.75, (20, len(low))) * (high - low)
    payload = generator.uniform(0.0, 100.0 if len(low) > 2 else 2.0, 20)
    chosen, tip = settings(name), manipulator.forward(inside)
    axes = [*(np.linspace(*ends, 4) for ends in zip(low, high, strict=True)), [0.0, 100.0]]
    grid = np.column_stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")])
    names = [*(f"coordinate_{k}" for k in range(len(low))), "payload"]
    samples = {"grid": pd.DataFrame(grid, columns=names)}
    for kind in ("rigid", "tip"):
        samples["grid"][[f"{kind}_x", f"{kind}_y"]] = manipulator.forward(grid[:, :-1])
    network = network_for(chosen.needs, manipulator)
    if isinstance(network, Network):
        tip = network.predict(np.column_stack([inside, payload]))
    query = np.column_stack([tip, payload])
    query[3, :2] = 50.0
    current = inside + 0.01 * (high - low)
    before = query.copy(), current.copy()
    method = build_of(chosen)(chosen, Ingredients(manipulator, network, samples, machine))
    answer = method(query, current)
    assert np.array_equal(query, before[0]) and np.array_equal(current, before[1])
    return Asked(manipulator, network, method, query, current, answer)


@pytest.mark.parametrize("name", METHODS)
def test_every_method_answers_for_every_machine(asked, name):
    low, high, values = asked.manipulator.lower, asked.manipulator.upper, asked.answer.values
    assert values.shape == asked.current.shape
    assert ((values >= low) & (values <= high)).all()
    assert set(asked.answer.status) <= set(STATUS_MEANING)
    # rows do not influence each other
    some = np.array([4, 3, 11])
    alone = asked.method(asked.query[some], asked.current[some])
    assert alone.values == pytest.approx(values[some], abs=1e-9)
    assert np.array_equal(alone.status, asked.answer.status[some])
    assert asked.method(asked.query[:0], asked.current[:0]).values.shape == (0, len(low))
    with pytest.raises(PositioningError, match="query: expected shape"):
        asked.method(asked.query[:, :2], asked.current)


@pytest.mark.parametrize("name", ["none", "combined", "direct", "modular", "inverse"])
def test_with_an_exact_network_a_method_reaches_what_can_be_reached(asked, name):
    reached = np.arange(20) != 3
    assert ((asked.answer.status == REACHED) == reached).all()
    values, network = asked.answer.values, asked.network
    inputs = np.column_stack([values, asked.query[:, 2]])
    if isinstance(network, Network):
        found = network.predict(inputs)
    else:
        found = asked.manipulator.forward(values)
        assert np.array_equal(values[3], asked.current[3])
    if name == "combined":
        found += network.predict(inputs)
    assert found[reached] == pytest.approx(asked.query[reached, :2], abs=3e-3)
    with pytest.raises(PositioningError, match="current coordinates: expected shape"):
        asked.method(asked.query, asked.current[:, :1])
    chosen = settings(name)
    if chosen.needs is not None:
        with pytest.raises(PositioningError, match="needs a network"):
            build_of(chosen)(chosen, Ingredients(asked.manipulator))


def errors(method, query, current, sag):
    answer = method(query, current)
    assert (answer.status == REACHED).all()
    return query[:, :2] - sag.tip(answer.values, query[:, 2])


def test_error_of_none_is_the_deflection(crane, query, current):
    sag = Sag(crane, 0.03)
    values = Uncompensated(crane)(query, current).values
    deflection = sag.predict(np.column_stack([values, query[:, 2]]))
    error = errors(Uncompensated(crane), query, current, sag)
    assert error == pytest.approx(-deflection, abs=1e-9)
    assert np.abs(error).max() > 0.02


def test_each_correction_gains_an_order(crane, query, current):
    # halving the deflection: error of order k falls by 2^k
    for n_corrections, order in ((1, 2), (2, 3)):
        largest = [
            np.abs(errors(Combined(crane, sag, n_corrections), query, current, sag)).max()
            for sag in (Sag(crane, size) for size in (0.005, 0.0025))
        ]
        assert np.log2(largest[0] / largest[1]) == pytest.approx(order, abs=0.3)


def test_corrections_shrink_the_error(crane, query, current):
    sag = Sag(crane, 0.02)
    methods = [Uncompensated(crane), *(Combined(crane, sag, n) for n in (1, 2, 3))]
    mean = [np.abs(errors(method, query, current, sag)).mean() for method in methods]
    assert all(later < 0.2 * earlier for earlier, later in pairwise(mean))


def test_combined_keeps_the_extension_where_it_still_reaches(crane, query, current):
    geometry, targets = crane.geometry, query[:, :2]
    answer = Combined(crane, Sag(crane, 0.02))(query, current)
    kept = smallest_extension(geometry, targets)
    deflection = np.column_stack([answer.diagnostics[f"deflection_{axis}"] for axis in "xy"])
    corrected = targets - deflection
    still = inverse(geometry, corrected, kept).reached
    shorter = smallest_extension(geometry, corrected) < kept - 1e-6
    assert (still & shorter).any()  # rows that a rule without memory would change
    assert np.array_equal(answer.values[still, 2], kept[still])


def test_combined_with_the_genetic_inverse_ends_near_its_tolerance(crane, query, current):
    rows, sag = slice(32, 62, 5), Sag(crane, 0.02)
    chosen = settings("combined", genetic={"seed": 5})
    method = build_of(chosen)(chosen, Ingredients(crane, sag))
    assert method == Combined(GeneticManipulator(crane, Genetic(seed=5)), sag)
    error = np.linalg.norm(errors(method, query[rows], current[rows], sag), axis=1)
    assert (error < 6e-3).all()  # 5 mm and a second-order remainder
    diagnostics = method(query[rows], current[rows]).diagnostics
    assert {"first_n_generations", "corrected_n_generations"} <= diagnostics.keys()


def test_an_unreachable_corrected_target_is_flagged(crane):
    query = np.array([[2.0, -3.95, 30.0], [4.0, 1.0, 30.0]])
    start = crane.initial_positions(query[:, :2])
    # 0.1 m of lift at the lower border asks for a point below the working area
    for n in (1, 2):
        answer = Combined(crane, Constant((0.0, 0.1)), n)(query, start)
        assert (answer.status == REACHED).tolist() == [False, True]
        assert crane.forward(answer.values)[1] == pytest.approx([4.0, 0.9], abs=1e-9)
        kept = np.array_equal(answer.values[0], crane.inverse(query[:, :2], start).values[0])
        assert kept == (n == 1)  # further ones go as far as they can
    assert -4.05 < crane.forward(answer.values)[0, 1] < -3.95


def test_a_correction_that_leads_beyond_the_reach_is_halved(crane):
    heights = np.linspace(-3.5, -4.5, 1001)
    places = np.column_stack([np.full_like(heights, 2.0), heights])
    lowest = heights[crane.inverse(places, np.zeros((1001, 3))).reached].min()

    class Sinking:
        """Lifts the tip the less, the lower it is."""

        def predict(self, values):
            height = crane.forward(values[:, :3])[:, 1]
            return np.column_stack([np.zeros(len(values)), 0.035 + 0.4 * (height - lowest)])

    query = np.array([[2.0, lowest + 0.05, 30.0]])
    start = crane.initial_positions(query[:, :2])
    assert Combined(crane, Sinking(), 1)(query, start).status[0] != REACHED
    answer = Combined(crane, Sinking(), 50)(query, start)
    assert answer.status[0] == REACHED
    at = np.column_stack([answer.values, query[:, 2]])
    found = crane.forward(answer.values) + Sinking().predict(at)
    assert found[0] == pytest.approx(query[0, :2], abs=1e-8)


def test_unreachable_target_stays_flagged_though_its_correction_would_reach(crane):
    query, start = np.array([[2.0, -4.1, 0.0]]), np.array([[0.0, 0.3, 0.5]])
    answer = Combined(crane, Constant((0.0, -0.5)))(query, start)
    assert answer.status[0] != REACHED
    assert np.array_equal(answer.values, start)


def test_predictions_that_do_not_fit_are_told(crane, query, current):
    with pytest.raises(PositioningError, match="predicted deflection: sample 0 is not finite"):
        Combined(crane, Constant((0.0, np.nan)))(query, current)
    with pytest.raises(PositioningError, match="predicted coordinates: sample 0 is not finite"):
        InverseNetwork(crane, Constant((np.nan, 0.1)))(query, current)
    with pytest.raises(PositioningError, match="Constant: expected a perceptron"):
        chosen = settings("direct")
        build_of(chosen)(chosen, Ingredients(crane, Constant((0.0, 0.0))))
    with pytest.raises(PositioningError, match="status"):
        Answer(current, np.zeros(3, dtype=np.int64))


@pytest.mark.parametrize("offset", [(0.2, 0.0), (-0.2, 0.9), (-9.0, -9.0)])
def test_inverse_clips_and_counts_what_is_beyond_the_limits(crane, query, current, offset):
    exact = crane.inverse(query[:, :2], current).values
    answer = InverseNetwork(crane, RigidInverse(crane, 2, offset))(query, current)
    wanted = exact[:, :2] + np.array(offset)
    assert np.array_equal(answer.values[:, :2], np.clip(wanted, 0.0, crane.upper[:2]))
    assert np.array_equal(answer.values[:, 2], smallest_extension(crane.geometry, query[:, :2]))
    beyond = (wanted < 0.0) | (wanted > crane.upper[:2])
    assert np.array_equal(answer.diagnostics["n_clipped"], beyond.sum(axis=1))
    assert answer.diagnostics["n_clipped"].dtype.kind == "i" and beyond.any()
    # below the base: the links are long enough, the cylinders are not
    near = np.array([[0.5, -4.0, 10.0]])
    status = InverseNetwork(crane, RigidInverse(crane, 2))(near, current[:1]).status[0]
    assert status == inverse(crane.geometry, near[:, :2], 0.0).status[0] != REACHED


def test_inverse_asks_the_network_with_payload_and_branch(crane, query, current):
    asked = []

    class Spy(RigidInverse):
        def predict(self, values):
            asked.append(values)
            return super().predict(values)

    rows = query.copy()
    rows[1, :2] = 9.0
    InverseNetwork(crane, Spy(crane, 2))(rows, current)
    reached = np.arange(len(rows)) != 1
    extension = smallest_extension(crane.geometry, rows[reached, :2])
    assert np.array_equal(asked[0], np.column_stack([rows[reached], extension]))


@pytest.mark.parametrize(("name", "needs"), [("direct", "tip"), ("modular", "correction")])
def test_searches_have_the_settings_of_params_yaml(crane, name, needs):
    network = perceptron(crane)
    for inversion, kind in (
        ({"kind": "gradient_descent", "n_iterations": 1}, GradientDescent(n_iterations=1)),
        ({"kind": "gauss_newton", "damping": 0.5}, GaussNewton(damping=0.5)),
    ):
        chosen = settings(name, inversion=inversion)
        assert (chosen.needs, chosen.inversion) == (needs, kind)
        method = build_of(chosen)(chosen, Ingredients(crane, network))
        assert method == InvertedNetwork(crane, network, kind)
    assert settings(name).inversion == GradientDescent()
    # one step is not enough: flagged, and still what the crane can take
    query = np.array([[2.5, 1.0, 200.0]])
    chosen = settings(name, inversion={"kind": "gradient_descent", "n_iterations": 1})
    answer = build_of(chosen)(chosen, Ingredients(crane, network))(query, np.full((1, 3), 0.5))
    assert answer.status.tolist() == [NOT_CONVERGED]
    assert answer.diagnostics["network_residual"][0] > 1e-3


def test_an_entry_called_like_a_method_is_this_method():
    given = {"none": None, "combined": {"network": "a"}, "mine": {"method": "direct"}}
    found = TypeAdapter(Methods).validate_python(given)
    assert {name: entry.method for name, entry in found.items()} == {
        "none": "none",
        "combined": "combined",
        "mine": "direct",
    }


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"method": "combine"}, "'combine'"),
        ({"method": "combined", "n_corrections": 0}, "n_corrections"),
        ({"method": "combined", "n_correction": 2}, "n_correction"),
        ({"method": "combined", "genetic": {"n_current": 16}}, "n_current"),
        ({"method": "direct", "inversion": {"kind": "gauss_newton", "damping": 0.0}}, "damping"),
        ({"method": "direct", "inversion": {"kind": "newton"}}, "inversion"),
        ({"network": "deflection"}, "method"),
    ],
)
def test_wrong_settings_are_told(entry, message):
    with pytest.raises(ValidationError, match=message):
        TypeAdapter(Methods).validate_python({"mine": entry})


def test_a_method_without_the_network_it_needs_is_told():
    networks = {"deflection": NetworkModel(learns="deflection", n_hidden=3, n_restarts=1)}
    check_methods(
        {"a": settings("combined", network="deflection"), "none": settings("none")}, networks
    )
    for chosen, message in (
        (settings("direct", network="deflection"), "learns deflection, direct needs tip"),
        (settings("combined", network="other"), "no network 'other' \\(deflection\\)"),
        (settings("combined"), "no network None"),
        (settings("none", network="deflection"), "none needs none"),
    ):
        with pytest.raises(ValueError, match=f"methods.a.network: .*{message}"):
            check_methods({"a": chosen}, networks)


def test_the_contract_loads_no_heavy_library():
    heavy = "{'torch', 'exudyn', 'pymoo'}"
    code = f"import sys, flexik.positioning.method; print({heavy} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
