"""The report of the elastic arm, from results whose statistics are known."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from elastic_arm import ARM, GEOMETRY, MODEL

from flexik.datasets.elastic_arm import gauges
from flexik.datasets.elastic_arm.learning import EVALUATION_FIELDS, FIT_FIELDS
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
from flexik.mechanisms.elastic_arm import flexible_forward, forward
from flexik.multibody.elastic_arm.model import equilibria
from flexik.reporting.elastic_arm import figures
from flexik.reporting.elastic_arm.report import metrics, write_report
from flexik.reporting.elastic_arm.results import Results
from flexik.reporting.elastic_arm.tables import fit_notes, fit_table, positioning_notes, size_notes

NAMES = [name for name, network in ARM.all_networks.items() if network.kind == "gauges"]
WRONG_BY = dict(zip(NAMES, np.radians([0.1, 1.0, 0.01, 0.2, 0.3, 0.4, 0.02, 0.03]), strict=True))


def readings():
    angles, payload = poses(ARM.readings)
    rows = np.arange(0, len(payload), 7)
    angles, payload = angles[rows], payload[rows]
    found = equilibria(MODEL, angles, payload)
    part = divide(len(payload), 0.2, 0.2, 0)
    columns = [angles, payload, part, forward(GEOMETRY, angles), *found]
    shown = {}
    for name in (gauges.FREE_OF_NOISE, gauges.NOISY):
        read = gauges.read(gauges_of(ARM), *found[1:], noise_generator(ARM, name, 0))
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


def errors(scale, seed):
    generator = np.random.default_rng(seed)
    n = 60
    error = scale * generator.standard_normal((n, 2))
    targets = generator.uniform([0.6, 0.0], [1.1, 0.8], (n, 2))
    payload = np.where(np.arange(n) % 2, 1.0, generator.uniform(1.2, 1.8, n))
    columns = [np.arange(n), targets, payload, targets, targets - error, error]
    columns += [np.linalg.norm(error, axis=1), np.zeros(n, dtype=np.int64)]
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
    return Results(
        arm=ARM,
        readings=table,
        shown=shown,
        fit=pd.concat([fit(table, shown, name) for name in NAMES], ignore_index=True),
        layers=layers,
        training=pd.DataFrame(training),
        studies={"selected_pair": (by_size(study), (10, 8))},
        errors={label: errors(s, k) for k, (label, s) in enumerate(scales.items())},
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
    published, layers = fit_notes(results)
    assert published.startswith("Published R reached on held-out readings by `published_network`")
    assert layers.endswith("more layers are better.")
    missed = replace(results, published=results.published.assign(r_theta_1=0.9999999))
    assert fit_notes(missed)[0].startswith("Published R missed")
    swapped = results.fit.copy()
    names = {"published_network": "one_layer_15", "one_layer_15": "published_network"}
    swapped["network"] = swapped["network"].replace(names)
    others = {"network_12_40": "one_layer_28", "one_layer_28": "network_12_40"}
    swapped["network"] = swapped["network"].replace(others)
    assert fit_notes(replace(results, fit=swapped))[1].endswith("more layers are no better.")
    notes = positioning_notes(results)
    assert sum("on held-out readings" in note for note in notes) == 3
    near = results.errors["published_network"].query("payload == 1.0")["error"].mean()
    assert f"{1e3 * near:.2f} mm at the 30 targets" in notes[0]


def test_a_choice_on_the_border_is_told(results):
    sizes, _ = results.studies["selected_pair"]
    assert len(size_notes(sizes, (10, 8))) == 2
    assert size_notes(sizes, (5, 3)) == []


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
        figures.deformation(tmp_path / "a.png", results.readings, shown, 1, 0.123)
    with pytest.raises(DataError, match="less than 1"):
        figures.network_comparison(tmp_path / "a.png", {"a": np.ones(2)}, {})
    assert not (tmp_path / "a.png").exists()
