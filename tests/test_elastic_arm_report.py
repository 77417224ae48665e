"""All stages of the elastic arm in small, and its report against what can be counted by hand."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from elastic_arm import ROOT

from flexik.cases import case as cases
from flexik.cases.elastic_arm import report_results
from flexik.cases.elastic_arm.parts.arm import equilibria, flexible_arm
from flexik.cases.elastic_arm.parts.gauges import SHOWN
from flexik.cases.elastic_arm.parts.kinds import KINDS, learning_data
from flexik.cases.elastic_arm.report import report
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import make
from flexik.datasets.tables import read_table
from flexik.learning.storage import load_network, load_restarts
from flexik.parameters.reading import overlay, read_yaml

STAGES = ("generate", "select", "train", "evaluate", "study")
MAIN = "published_network"
SMALL = {"studies": {"splits": {"seeds": [2]}}}


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A folder with the results of all stages by the smoke profile, the current one."""
    folder = tmp_path_factory.mktemp("project")
    given, profile = read_yaml(ROOT / "params.yaml"), read_yaml(ROOT / "profiles/smoke.yaml")
    data = {
        "cases": {"elastic_arm": {"code": "elastic_arm"}},
        "trainers": overlay(given["trainers"], _known(profile["trainers"], given["trainers"])),
        "elastic_arm": overlay(overlay(given["elastic_arm"], profile["elastic_arm"]), SMALL),
    }
    (folder / "params.yaml").write_text(yaml.safe_dump(data, sort_keys=False))
    for name in ("machines", "reference"):
        shutil.copytree(ROOT / "data" / name, folder / "data" / name)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        section = cases.load("elastic_arm", folder / "params.yaml")
        cases.check(section)
        for stage in STAGES:
            parts = cases.parts(section, stage)
            make(section.data / cases.STAGES[stage], parts, ParallelSettings(n_workers=1))
        report(section)
        yield folder, section


def _known(changes, base):
    return {name: value for name, value in changes.items() if name in base}


@pytest.fixture
def page(project):
    return (project[0] / "reports/elastic_arm/README.md").read_text()


@pytest.fixture
def metrics(project):
    return json.loads((project[0] / "reports/elastic_arm/metrics.json").read_text())


def csv(project, name):
    return pd.read_csv(project[0] / f"reports/elastic_arm/{name}.csv")


def data(project, name):
    return read_table(project[0] / f"data/elastic_arm/{name}.parquet")


def test_metrics_are_flat_finite_numbers_of_all_networks_and_methods(project, metrics):
    section = project[1]
    assert all(np.isfinite(value) for value in metrics.values())
    for name in section.gauge_networks:
        assert -1.0 <= metrics[f"{name}.r_theta1"] <= 1.0
    for label in section.methods:
        error = 1e3 * data(project, f"errors/workspace/{label}")["error"]
        assert len(error) == 30
        assert metrics[f"{label}.mean_error_mm"] == pytest.approx(error.mean(), abs=1e-4)
        assert metrics[f"{label}.max_error_mm"] == pytest.approx(error.max(), abs=1e-4)
    assert metrics["select.selected_pair.n_hidden_2"] == 3
    assert sum(metrics[f"readings.n_{part}"] for part in ("training", "selection", "held_out")) == (
        len(data(project, "samples/readings"))
    )


def test_fit_and_sensitivity_are_those_of_the_held_out_readings(project, metrics):
    samples = project[0] / "data/elastic_arm/samples"
    readings = read_table(samples / "readings.parquet")
    held_out = readings[readings["part"] == "held_out"]
    paths = samples / "readings.parquet", samples / "readings.noise_free.parquet"
    inputs, angles = learning_data("gauges", *paths).of("held_out")
    arm = flexible_arm(project[1].machine)
    network, record = load_network(project[0] / f"data/elastic_arm/networks/{MAIN}.json")

    def tip_error(inputs):
        found = np.clip(network.predict(inputs), arm.geometry.lower, arm.geometry.upper)
        tip = equilibria(arm, found, held_out["payload"].to_numpy()).tip
        return 1e3 * np.linalg.norm(tip - held_out[["tip_x", "tip_y"]], axis=1)

    predicted = network.predict(inputs)
    for k in (0, 1):
        r = np.corrcoef(angles[:, k], predicted[:, k])[0, 1]
        assert metrics[f"{MAIN}.r_theta{k + 1}"] == pytest.approx(r, abs=1e-6)
    assert metrics[f"{MAIN}.held_out_mean_error_mm"] == pytest.approx(
        tip_error(inputs).mean(), abs=1e-3
    )
    table = csv(project, "sensitivity").set_index("input that is off")
    off = 1e-6 * table.loc["dx_2", "off by (um, urad)"] * (np.arange(8) == 4)
    assert KINDS["gauges"].inputs[4] == "dx_2"
    assert table.loc["dx_2", MAIN] == pytest.approx(tip_error(inputs + off).mean(), abs=1e-3)
    assert np.isnan(table.loc["dx_1", "published_network_without_dx"])
    # of every start, the chosen one among them
    starts = data(project, "studies/fit.restarts").query(f"network == '{MAIN}'")
    assert starts["restart"].tolist() == [0, 1]
    assert starts.set_index("restart").loc[record.restart, "chosen"] == 1


def test_tables_hold_ours_beside_the_published_and_the_restarts(project):
    fit = csv(project, "fit").set_index("network")
    assert fit.loc[MAIN, "R theta_1, published"] == 0.999742
    assert np.isnan(fit.loc["network_12_40", "R theta_1, published"])
    assert fit.loc["network_12_40", "hidden"] == "3-5"
    errors = csv(project, "positioning_errors").set_index("method")
    networks = project[0] / "data/elastic_arm/networks"
    for label, method in project[1].methods.items():
        n = len(load_restarts(networks / f"{method.network}.restarts.json")) if method.needs else 0
        shown = errors.loc[label, "mean by restart (mm)"]
        assert (0 if shown != shown else len(str(shown).split(", "))) == n
    assert csv(project, "splits")["division"].tolist() == [
        *("main", "other", "median", "largest - least", "published")
    ]


def test_sentences_follow_the_data(project, page, monkeypatch, tmp_path):
    assert f"Published R missed on held-out readings by `{MAIN}`" in page
    assert "No controller knows that" in page and "`combined`" in page
    assert "one layer `one_layer_" in page and "several `" in page
    assert page.count("on held-out readings, whose payloads it learnt from") == 6
    assert page.count("told 0.05 kg more than there is") == 5
    assert "over its 1 restarts" not in page
    assert "Layer 2: the choice is the largest that was tried." in page
    assert (
        "With one input off by what the assumed gauges leave uncertain it depends most on" in page
    )
    easy = tmp_path / "fit.csv"
    easy.write_text(f"network,r_theta_1,r_theta_2\n{MAIN},-1.0,0.9999999\n")
    monkeypatch.setattr(report_results, "PUBLISHED", easy)
    monkeypatch.setattr("flexik.parameters.section.REPORTS", tmp_path)
    report(project[1])
    page = (tmp_path / "elastic_arm/README.md").read_text()
    assert "Published R of theta_1, -1.000000: reached by the main division" in page
    assert "reached in 2 of 2" in page and "reached in 0 of 2" in page


def test_a_mean_stands_beside_its_range_over_the_restarts(project, monkeypatch, tmp_path):
    of, name = report_results.Results.of, "errors/workspace/combined_iterated.restarts"

    def of_two(self, which):
        found = of(self, which)
        if which == name:
            other = found.assign(mean_error=0.00025, restart=1, chosen=0)
            return pd.concat([found, other], ignore_index=True)
        return found

    monkeypatch.setattr(report_results.Results, "of", of_two)
    monkeypatch.setattr("flexik.parameters.section.REPORTS", tmp_path)
    report(project[1])
    page = (tmp_path / "elastic_arm/README.md").read_text()
    own = 1e3 * data(project, name)["mean_error"].iloc[0]
    least, largest = sorted([own, 0.25])
    assert (
        f"in place of {own:.3f} mm ({least:.3f} mm to {largest:.3f} mm over its 2 restarts)."
        in page
    )


def test_report_is_whole_and_the_same_again(project):
    folder = project[0] / "reports/elastic_arm"
    files = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*.*")}
    assert sum(path.suffix == ".png" for path in files) == 6
    assert {"README.md", "metrics.json", "fit.csv", "gauges.md"} <= {str(path) for path in files}
    shutil.rmtree(folder)
    report(project[1])
    assert files == {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*.*")}


def test_held_out_readings_on_the_border_are_counted(project):
    readings = data(project, "samples/readings").query("part == 'held_out'")
    theta = np.degrees(readings[["theta_1", "theta_2"]]).round()
    on = theta["theta_1"].isin([0, 30]) | theta["theta_2"].isin([-35, 60])
    assert report_results.Results(project[1]).on_border() == int(on.sum())


def test_noise_costs_of_the_page_are_of_all_three_gauges(project, page):
    given = {network.readings for network in project[1].networks.values() if network.has_gauges}
    assert given == set(SHOWN)
    assert "Noise in the voltages alone changes the mean tip error by" in page
