"""Methods of the elastic arm, with exact functions in place of networks, and their errors."""

from types import SimpleNamespace

import numpy as np
import pytest
from elastic_arm import GEOMETRY, HOME, MODEL, QUERY, SECTION, TARGETS, tips

from flexik.cases import case as cases
from flexik.cases.elastic_arm.parts import evaluate
from flexik.cases.elastic_arm.parts.gauge_method import GaugeNetwork
from flexik.cases.elastic_arm.parts.kinds import KINDS
from flexik.cases.elastic_arm.parts.trained import Trained
from flexik.evaluation.conditions import Conditions
from flexik.kinematics.elastic_arm import elbow
from flexik.kinematics.status import OUT_OF_REACH, REACHED
from flexik.positioning.inverse import InverseNetwork
from flexik.positioning.method import PositioningError

DEFORMED = np.arange(24.0).reshape(4, 6)
CONDITIONS = Conditions(QUERY, HOME, np.arange(4))
SIDE = elbow(GEOMETRY.inverse(TARGETS, HOME).values)


def predicting(function):
    return SimpleNamespace(predict=function)


def exact_deflection(inputs):
    return tips(inputs[:, :2], inputs[:, 2]) - GEOMETRY.forward(inputs[:, :2])


def error(label, network=None, **options):
    """Errors of a method of params.yaml with `network`."""
    given = evaluate.described(SECTION, "workspace", label)["settings"]
    trained = network and Trained("it", given["network"], 0, True, network)
    found = evaluate.errors(
        given["machine"], given["method"], given["build"], CONDITIONS, None, trained, **options
    )
    return found["error"]


def test_combined_with_the_exact_deflection_converges_to_the_target():
    exact = predicting(exact_deflection)
    assert error("none").min() > 1e-3
    assert error("combined", exact).max() < 1e-3
    assert error("combined_iterated", exact).max() < 1e-6
    # each 0.05 kg too much moves the tip that much less
    told = error("combined_iterated", exact, told_too_much=0.05)
    sag = np.linalg.norm(GEOMETRY.forward(HOME) - tips(HOME, np.full(4, 0.05)), axis=1)
    assert (told > 1e-5).all() and (told < sag).all()


def test_inverse_network_is_asked_for_target_payload_and_elbow():
    asked = []

    def predict(inputs):
        asked.append(inputs)
        return np.full((len(inputs), 2), 9.0)  # beyond both limits

    query = np.vstack([QUERY, [[1.3, 0.0, 1.0]]])
    answer = InverseNetwork(GEOMETRY, predicting(predict))(query, np.zeros((5, 2)))
    assert set(SIDE) == {-1.0, 1.0}
    assert np.array_equal(asked[0], np.column_stack([QUERY, SIDE]))
    assert answer.status.tolist() == [REACHED] * 4 + [OUT_OF_REACH]
    assert np.array_equal(answer.values[:4], np.tile(GEOMETRY.upper, (4, 1)))
    assert answer.values[4].tolist() == [0.0, 0.0]
    assert answer.diagnostics["n_clipped"].tolist() == [2, 2, 2, 2, 0]


@pytest.mark.parametrize(
    ("learns", "inputs"),
    [
        ("gauges", np.hstack([DEFORMED, TARGETS])),
        ("gauges_without_dx", np.hstack([DEFORMED[:, [0, 2, 3, 5]], TARGETS])),
        ("gauges_elbow", np.column_stack([DEFORMED, TARGETS, SIDE])),
    ],
)
def test_gauge_network_is_told_the_deformation_beside_the_target(learns, inputs):
    asked = []

    def predict(values):
        asked.append(values)
        return np.tile([0.1, 9.0], (4, 1))

    method = GaugeNetwork(GEOMETRY, predicting(predict), KINDS[learns].inputs, DEFORMED)
    answer = method(QUERY, HOME)
    assert np.array_equal(asked[0], inputs)
    assert answer.values.tolist() == [[0.1, GEOMETRY.upper[1]]] * 4
    assert answer.diagnostics["n_clipped"].tolist() == [1] * 4
    assert (answer.status == REACHED).all()
    with pytest.raises(PositioningError, match="deformation by the gauges"):
        method(QUERY[:2], HOME[:2])


def test_a_gauge_method_is_told_what_its_network_learnt_from():
    told = {
        label: str(evaluate.described(SECTION, "workspace", label)["inputs"].get("shown", ""))
        for label in SECTION.methods
    }
    noisy = {"published_network_noisy", "gauges_elbow_lm_noisy"}
    for label, path in told.items():
        gauges = SECTION.methods[label].method == "gauges"
        assert path.endswith(".parquet") == gauges
        assert (".noisy.parquet" in path) == (label in noisy)
    assert told["published_network_noisy_voltages"].endswith("workspace.noisy_voltages.parquet")
    assert told["published_network"].endswith("workspace.noise_free.parquet")


def test_the_table_is_of_the_chosen_start_and_the_others_stand_beside(tmp_path):
    network = SECTION.networks["deflection"]
    starts = [Trained("deflection", network, k, k == 1, None) for k in (0, 1)]
    given = SECTION.machine, SECTION.methods["combined"]
    results = [
        evaluate.errors(*given, build, CONDITIONS, None, start)
        for start, build in zip(starts, (lambda *_: far, lambda *_: near), strict=True)
    ]
    written = evaluate.written(evaluate.columns(MODEL), starts, results)
    for extension, write in written.items():
        write(tmp_path / f"it{extension}")
    table = evaluate.read_table(tmp_path / "it.parquet")
    beside = evaluate.read_table(tmp_path / "it.restarts.parquet")
    assert table["error"].to_numpy() == pytest.approx(results[1]["error"])
    assert beside["chosen"].tolist() == [0, 1]
    assert beside["max_error"].tolist() == [r["error"].max() for r in results]
    assert beside["mean_error"][0] > beside["mean_error"][1]


def near(query, current):
    """The rigid inverse."""
    return evaluate.registry.build_of(SECTION.methods["none"])(
        SECTION.methods["none"], evaluate.Ingredients(GEOMETRY)
    )(query, current)


def far(query, current):
    """The stretched arm."""
    answer = near(query, current)
    return type(answer)(current, answer.status)


def test_files_are_those_of_the_name_of_the_section():
    other = SECTION.model_copy(update={"name": "other_arm"})
    parts = [part for stage in cases.STAGES for part in cases.parts(other, stage)]
    assert "elastic_arm" not in str([part.inputs for part in parts])
    assert "data/other_arm/samples/readings.parquet" in str(parts[-1].inputs)
