"""The report of the elastic arm, from results whose statistics are known."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from elastic_arm import ARM, GEOMETRY, MODEL

from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import EVALUATION_FIELDS, FIT_FIELDS, SENSITIVITY_FIELDS
from flexik.datasets.elastic_arm.readings import (
    FIELDS,
    HELD_OUT,
    columns_of,
    divide,
    gauges_of,
    noise_generator,
    poses,
)
from flexik.errors import DataError
from flexik.learning.size_selection import by_size
from flexik.kinematics.elastic_arm import DEFORMATION, flexible_forward, forward
from flexik.multibody.elastic_arm.model import equilibria
from flexik.reporting.elastic_arm import figures
from flexik.reporting.elastic_arm.report import metrics, write_report
from flexik.reporting.elastic_arm.results import Results, SizeStudy
from flexik.reporting.elastic_arm.sensitivity import sensitivity_table, sensitivity_text
from flexik.reporting.elastic_arm.tables import (
    fit_notes,
    fit_table,
    positioning_notes,
    positioning_table,
    size_notes,
    splits_notes,
    weights_notes,
)

NAMES = ARM.gauge_networks
DEGREES = {
    "published_network": 0.1,
    "published_network_noisy": 1.0,
    "published_network_noisy_voltages": 0.3,
    "published_network_without_dx": 0.8,
    "published_network_lm": 0.01,
    "network_12_40": 0.2,
    "one_layer_15": 0.3,
    "one_layer_28": 0.4,
    "one_layer_28_lm": 0.02,
    "gauges_elbow_lm_noisy": 0.5,
    "selected_pair": 0.03,
}
WRONG_BY = {name: np.radians(DEGREES[name]) for name in NAMES}


def readings():
    angles, payload = poses(ARM.readings)
    rows = np.arange(0, len(payload), 7)
    angles, payload = angles[rows], payload[rows]
    found = equilibria(MODEL, angles, payload)
    part = divide(len(payload), 0.2, 0.2, 0)
    columns = [angles, payload, part, forward(GEOMETRY, angles), *found]
    shown = {}
    for name in gauges.SHOWN:
        read = gauges.read(gauges_of(ARM, name), *found[1:], noise_generator(ARM, name, 0))
        tip = flexible_forward(GEOMETRY, angles, read.deformation)
        shown[name] = pd.DataFrame(columns_of([*read, tip], gauges.FIELDS))
    return pd.DataFrame(columns_of(columns, FIELDS)), shown


def fit(table, shown, name):
    """A network that turns the first joint too far by a constant, half of the readings each way."""
    sign = np.where(np.arange(len(table)) % 2, 1.0, -1.0)
    angles = table[["theta_1", "theta_2"]].to_numpy() + np.outer(sign, [WRONG_BY[name], 0.001])
    deformation = table[["dy_1", "dx_1", "dphi_1", "dy_2", "dx_2", "dphi_2"]].to_numpy()
    tip = flexible_forward(GEOMETRY, angles, deformation)
    columns = [np.full(len(table), name), np.arange(len(table)), angles, tip, tip]
    return pd.DataFrame(columns_of(columns, FIT_FIELDS))


def sensitivity(table):
    """Every input off adds a millimetre to an error of one, dx_1 a hundred."""
    changes = dict(zip(("nothing", *DEFORMATION), [0.0, *np.arange(1.0, 7.0)], strict=True))
    reading = int(np.flatnonzero(table["part"] == HELD_OUT)[0])
    rows = [
        (name, changed, change * 1e-6, reading, {"nothing": 1e-3, "dx_1": 0.1}.get(changed, 2e-3))
        for name in NAMES
        for changed, change in changes.items()
        if not (name.endswith("without_dx") and changed.startswith("dx"))
    ]
    return pd.DataFrame(rows, columns=[field.name for field in SENSITIVITY_FIELDS])


def errors(scale, seed):
    generator = np.random.default_rng(seed)
    n = 60
    error = scale * generator.standard_normal((n, 2))
    targets = generator.uniform([0.6, 0.0], [1.1, 0.8], (n, 2))
    payload = np.where(np.arange(n) % 2, 1.0, generator.uniform(1.2, 1.8, n))
    columns = [np.arange(n), targets, payload, targets, targets - error, error]
    columns += [np.linalg.norm(error, axis=1), np.zeros(n, dtype=np.int64), np.arange(n) % 3]
    return pd.DataFrame(columns_of(columns, EVALUATION_FIELDS))


@pytest.fixture(scope="module")
def results():
    table, shown = readings()
    training = [
        {
            "network": name,
            "restart": 0,
            "n_iterations": 10,
            "training_error": 0.01,
            "selection_error": 0.02,
        }
        for name in ARM.all_networks
    ]
    study = pd.DataFrame(
        [
            (first, second, restart, 0.1, 1.0 / (first + second + restart), 5, "iterations")
            for first in (5, 10)
            for second in (3, 8)
            for restart in (0, 1)
        ],
        columns=[
            *("n_hidden_1", "n_hidden_2", "restart", "training_error"),
            *("selection_error", "n_iterations", "stop_reason"),
        ],
    )
    layers = {
        name: tuple(getattr(network, "n_hidden", (10, 8)))
        for name, network in ARM.all_networks.items()
    }
    scales = {"none": 1e-2} | {label: 1e-3 * (k + 1) for k, label in enumerate(ARM.methods)}
    by_method = {label: errors(s, k) for k, (label, s) in enumerate(scales.items())}
    one = by_method["none"]
    return Results(
        arm=ARM,
        readings=table,
        shown=shown,
        fit=pd.concat([fit(table, shown, name) for name in NAMES], ignore_index=True),
        layers=layers,
        training=pd.DataFrame(training),
        studies={"selected_pair": SizeStudy(by_size(study), (10, 8), 0, len(study))},
        errors=by_method,
        targets=one[["target_x", "target_y", "payload", "theta_1", "theta_2"]],
        target_counts={"drawn": 500, "reached": 70, "kept": len(one)},
        sensitivity=sensitivity(table),
        payload_error=pd.DataFrame({"method": "combined", "point": [0, 1], "error": [1e-3, 3e-3]}),
        splits=pd.DataFrame({"seed": [2, 3], "r_theta_1": [0.4, 0.6], "r_theta_2": [0.7, 0.8]}),
        published=pd.DataFrame(
            {"network": ["published_network"], "r_theta_1": [0.5], "r_theta_2": [0.5]}
        ),
    )


def test_fit_is_that_of_the_held_out_readings(results):
    table = results.readings[results.readings["part"] == HELD_OUT]
    rows = table.index.to_numpy()
    sign = np.where(rows % 2, 1.0, -1.0)
    for name in ("published_network", "published_network_noisy"):
        found = results.fit_of(name, HELD_OUT)
        turned = table["theta_1"] + sign * WRONG_BY[name]
        assert found.r[0] == pytest.approx(np.corrcoef(table["theta_1"], turned)[0, 1])
        # the arm turned about its first joint, and a little about its second
        reach = np.hypot(table["tip_x"], table["tip_y"])
        assert found.mean_error == pytest.approx((reach * WRONG_BY[name]).mean(), abs=7e-4)
    ours = fit_table(results).set_index("network")
    assert ours.loc["published_network", "R theta_1, published"] == 0.5
    assert np.isnan(ours.loc["network_12_40", "R theta_1, published"])
    assert ours.loc["network_12_40", "hidden"] == "12-40"


def test_notes_follow_the_data(results):
    published, at_targets, layers = fit_notes(results)
    assert published.startswith("Published R reached on held-out readings by `published_network`")
    assert at_targets.startswith("R at the random targets by `published_network`")
    # both measures, no verdict
    assert "one layer `one_layer_15`" in layers and "several `published_network`" in layers
    missed = replace(results, published=results.published.assign(r_theta_1=0.9999999))
    assert fit_notes(missed)[0].startswith("Published R missed")
    first, second = splits_notes(missed)
    assert "missed by the main division" in first and "reached in 0 of 3" in first
    assert "reached by the main division" in second and "reached in 3 of 3" in second
    notes = positioning_notes(results)
    assert sum("on held-out readings" in note for note in notes) == 6
    assert any("told 0.05 kg more than there is, mean 2.000 mm" in note for note in notes)
    clipped = positioning_table(results).set_index("method")["clipped"]
    assert clipped["published_network"] == 40
    near = results.errors["published_network"].query("payload == 1.0")["error"].mean()
    assert f"{1e3 * near:.2f} mm at the 30 targets" in notes[0]


def test_a_choice_on_the_border_is_told(results):
    sizes = results.studies["selected_pair"].sizes
    assert len(size_notes(sizes, (10, 8))) == 2
    assert size_notes(sizes, (5, 3)) == []
    goal, weights = weights_notes(results, "selected_pair")
    assert goal.startswith("0 of 8 runs")
    assert f"{10 * 9 + 8 * 11 + 2 * 9} weights" in weights


def test_what_the_gauges_tell_is_computed(results):
    table = sensitivity_table(results).set_index("input that is off")
    assert table.loc["nothing", "published_network"] == pytest.approx(1.0)
    assert table.loc["dx_1", "published_network"] == pytest.approx(100.0)
    assert np.isnan(table.loc["dx_1", "published_network_without_dx"])
    assert table.loc["dx_1", "off by (um, urad)"] == pytest.approx(2.0)
    text = sensitivity_text(results)
    assert "depends most on dx_1: 100.00 mm with dx_1 off by 2 micrometres" in text
    assert "noise of the strains" in text
    by = results.fit.copy()
    turn = {"published_network_noisy": "published_network_noisy_voltages"}
    by["network"] = by["network"].replace({**turn, **{b: a for a, b in turn.items()}})
    assert "noise of the voltages" in sensitivity_text(replace(results, fit=by))


def test_held_out_readings_on_the_border_are_counted(results):
    table = results.readings[results.readings["part"] == HELD_OUT]
    theta = np.degrees(table[["theta_1", "theta_2"]]).round()
    on = theta["theta_1"].isin([0, 30]) | theta["theta_2"].isin([-35, 60])
    assert results.on_border() == (int(on.sum()), len(table))


def test_metrics_are_flat_finite_numbers(results):
    found = metrics(results)
    assert all(np.isfinite(value) for value in found.values())
    for k in (0, 1):
        r = results.fit_of("published_network", HELD_OUT).r[k]
        assert found[f"published_network.r_theta{k + 1}"] == pytest.approx(r, abs=1e-6)
    for label in ("none", *ARM.methods):
        error = 1e3 * results.errors[label]["error"]
        assert found[f"{label}.mean_error_mm"] == pytest.approx(error.mean(), abs=1e-4)
        assert found[f"{label}.max_error_mm"] == pytest.approx(error.max(), abs=1e-4)
    assert found["select.selected_pair.n_hidden_1"] == 10


def test_report_is_whole_and_the_same_again(results, tmp_path):
    published = tmp_path / "fit.csv"
    results.published.to_csv(published, index=False)
    for folder in ("a", "b"):
        write_report(results, tmp_path / folder, [published])
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*"))
    assert {"README.md", "metrics.json", "fit.csv", "gauges.md"} <= {str(f) for f in files}
    assert len([f for f in files if f.suffix == ".png"]) == 6
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    page = (tmp_path / "a/README.md").read_text()
    assert "No controller knows that" in page and "`combined`" in page
    assert json.loads((tmp_path / "a/metrics.json").read_text()) == metrics(results)


def test_figures_refuse_what_they_cannot_show(results, tmp_path):
    shown = results.shown[gauges.FREE_OF_NOISE]
    with pytest.raises(DataError, match="no reading at theta_1"):
        figures.deformation(tmp_path / "a.png", results.readings, shown, shown, 1, 0.123)
    assert not (tmp_path / "a.png").exists()


def test_an_r_that_rounds_to_one_is_drawn(tmp_path):
    figures.network_comparison(tmp_path / "a.png", {"a": np.ones(2)}, {})
    assert (tmp_path / "a.png").exists()
