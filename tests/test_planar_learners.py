"""Regressors and modules in place of networks, through all stages; errors by number of samples."""

import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from planar_machines import ROOT

from flexik.cases import case as cases
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import is_current, make
from flexik.datasets.tables import read_table
from flexik.errors import ParameterError
from flexik.learning.regressor import load_regressor
from flexik.planar.fields import deflection, inputs, kept
from flexik.planar.learning_curves import with_levels

POLYNOMIAL = {
    "name": "Pipeline",
    "steps": [{"name": "PolynomialFeatures", "degree": 4}, {"name": "Ridge", "alpha": 1e-9}],
}
LAYERS = {"n_hidden": [8], "activation": "Tanh"}
EXCAVATOR = {
    "samples": {
        "grid": {
            "boom": {"minimum": 0.2, "maximum": 1.0, "increment": 0.1},
            "stick": {"minimum": 0.2, "maximum": 1.2, "increment": 0.1},
            "payload": {"minimum": 0.0, "maximum": 3000.0, "increment": 1000.0},
        },
        "selection": {"n_samples": 60, "payload": [0.0, 3000.0], "seed": 11},
    },
    "networks": {
        "few": {"learns": "deflection", "n_hidden": 3, "n_restarts": 2},
        "many": {"learns": "deflection", "n_hidden": 40, "n_restarts": 1},
        "polynomial": {"learns": "deflection", "regressor": POLYNOMIAL},
        "remainder": {"learns": "remainder", "regressor": POLYNOMIAL},
        "layers": {
            "learns": "deflection",
            "module": LAYERS,
            "n_restarts": 2,
            "trainers": ["torch_lbfgs"],
        },
    },
    "conditions": {
        "workspace": {
            "n_targets": 40,
            "x": [4.0, 7.5],
            "y": [-1.0, 5.0],
            "payload": [0.0, 3000.0],
            "seed": 21,
        },
        "few_points": {"points": [[6.0, 1.0], [5.0, 2.0]], "payloads": [500.0, 2500.0]},
    },
    "methods": {
        "none": {},
        "polynomial": {"method": "combined", "network": "polynomial", "n_corrections": 20},
        "layers": {"method": "combined", "network": "layers", "n_corrections": 20},
        "beam_network": {"network": "remainder"},
    },
    "studies": {
        "learning_curves": {
            "networks": ["few", "many", "polynomial", "remainder", "layers"],
            "n_samples": [30, 200],
            "n_levels": [2, 4],
            "n_judged": 50,
            "outside": [4000.0],
        },
        "physics": {
            "variants": {
                "same": {"title": "another name"},
                "softer": {"bodies.boom.youngs_modulus": 150.0e9},
            },
            "methods": ["none", "beam_network"],
            "n_targets": 20,
        },
    },
}
STAGES = ("generate", "train", "evaluate", "study")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """Parameters by file, of an excavator with few samples, in a folder of its own."""
    folder = tmp_path_factory.mktemp("project")
    shutil.copytree(ROOT / "data/machines", folder / "data/machines")
    given = yaml.safe_load((ROOT / "params.yaml").read_text())
    given["excavator"] = EXCAVATOR
    given["trainers"]["torch_lbfgs"] = {"kind": "lbfgs", "n_iterations": 150}
    files = {"params.yaml": given}
    for file in (ROOT / "data/machines").glob("*.yaml"):
        files[f"data/machines/{file.name}"] = yaml.safe_load(file.read_text())
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(cases, "_read", lambda path: files[str(path)])
        yield files


@pytest.fixture(scope="module")
def section(project):
    """The excavator after all stages."""
    found = cases.load("excavator")
    cases.check(found)
    for stage in STAGES:
        folder = found.data / cases.STAGES[stage]
        make(folder, cases.parts(found, stage), ParallelSettings(n_workers=1))
    return found


def curve(section, name):
    return read_table(section.data / f"studies/learning_curves/{name}.parquet")


def test_each_compensates(section):
    for conditions in ("workspace", "few_points"):
        mean = {
            name: read_table(section.data / f"errors/{conditions}/{name}.parquet")["error"].mean()
            for name in section.methods
        }
        for name in ("polynomial", "layers", "beam_network"):
            assert mean[name] < 0.1 * mean["none"], name
        assert mean["beam_network"] < mean["polynomial"]
    # starts of a module are judged as those of networks; a regressor has one
    spread = read_table(section.data / "errors/few_points/layers.spread.parquet")
    assert spread["restart"].tolist() == [0, 1]
    assert not (section.data / "errors/few_points/polynomial.spread.parquet").exists()


def test_selection_errors_stand_beside_those_of_networks(section):
    folder = section.data / "networks"
    table = {name: pd.read_csv(folder / f"{name}.restarts.csv") for name in section.networks}
    assert [len(table[name]) for name in ("few", "polynomial", "layers")] == [2, 1, 2]
    assert len({tuple(frame.columns) for frame in table.values()}) == 1
    # the selection error of the regressor, from its file
    ((found, _),) = load_regressor(folder / "polynomial.skops")
    samples = kept(read_table(section.data / "samples/selection.parquet"))
    learnt = deflection(kept(read_table(section.data / "samples/grid.parquet")))
    missed = found.predict(samples[inputs(section.machine)].to_numpy()) - deflection(samples)
    expected = np.sqrt(np.mean((2.0 * missed / np.ptp(learnt, axis=0)) ** 2))
    assert table["polynomial"]["selection_error"][0] == pytest.approx(expected, rel=1e-9)


def test_all_payloads_give_the_network_of_the_pipeline(section):
    ((found, _),) = load_regressor(section.data / "networks/polynomial.skops")
    table = curve(section, "polynomial")
    whole = table[table["n_levels"] == 4]
    assert whole["n_samples"].tolist() == [9 * 11 * 4] * 2
    for number, row in enumerate(whole.itertuples()):
        judged = read_table(section.data / f"studies/learning_curves/judged_{number}.parquet")
        predicted = found.predict(judged[inputs(section.machine)].to_numpy())
        error = np.hypot(*(predicted - deflection(judged)).T)
        expected = error.mean(), np.quantile(error, 0.99), error.max()
        assert (row.mean_error, row.p99_error, row.max_error) == pytest.approx(expected, rel=1e-9)
    # judged by the same poses, with other payloads
    inside, outside = (
        read_table(section.data / f"studies/learning_curves/judged_{k}.parquet") for k in (0, 1)
    )
    assert inside["boom_stroke"].equals(outside["boom_stroke"])
    assert (outside["payload"] == 4000.0).all() and inside["payload"].max() <= 3000.0


def test_more_samples_give_smaller_errors(section):
    for name in ("few", "polynomial", "remainder", "layers"):
        table = curve(section, name)
        inside = table[table["payload"].isna()]
        few, more = inside[inside["design"] == "random"]["mean_error"]
        assert more < few, name
        assert inside["n_samples"].tolist() == [30, 200, 198, 396]
    # 40 neurons have more weights than 30 samples have numbers
    table = curve(section, "many").query("design == 'random'")
    assert table["mean_error"].isna().tolist() == [True, True, False, False]


def test_a_variant_that_is_the_same_changes_nothing(section):
    table = physics(section, "same")
    assert table.loc["tip", "nominal"]["max_error"] < 1e-9
    for theory in ("nominal", "variant"):
        found = table.loc["beam_network", theory]
        assert found["mean_error"] == pytest.approx(beam_network(section).mean(), rel=1e-3)


def test_a_softer_boom_moves_the_tip_and_a_network_repairs_its_theory(section):
    table = physics(section, "softer")
    values = table.loc["tip", "nominal"], table.loc["beam_network", "nominal"]
    moved, trusted = (found["mean_error"] for found in values)
    sag = np.linalg.norm(
        deflection(kept(read_table(section.data / "samples/selection.parquet"))), axis=1
    )
    assert 0.05 < moved / sag.mean() < 210 / 150 - 1  # of the boom's share of the deflection
    # what beam theory and network of the machine do not know of the variant stays as the error
    assert trusted == pytest.approx(moved, rel=0.5)
    assert table.loc["beam_network", "variant"]["mean_error"] < 0.1 * trusted
    assert table.loc["none", "nominal"]["mean_error"] > sag.mean()


def physics(section, variant):
    table = read_table(section.data / "studies/physics.parquet")
    assert set(table["constants"]) == {"kept"} and (table["n_failed"] == 0).all()
    return table[table["variant"] == variant].set_index(["subject", "theory"])


def beam_network(section):
    return read_table(section.data / "errors/workspace/beam_network.parquet")["error"][:20]


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ({"methods": ["no"]}, "studies.physics.methods.0: there is no method 'no'"),
        ({"conditions": "few_points"}, "physics.conditions: no random targets 'few_points'"),
        (
            {"variants": {"wrong": {"bodies.bom.mass": 1.0}}},
            "physics.variants.wrong: bodies.bom.mass: the machine has no such key",
        ),
        (
            {"variants": {"wrong": {"bodies.boom.youngs_modulus": -1.0}}},
            "physics.variants.wrong: bodies.boom.*youngs_modulus",
        ),
    ],
)
def test_wrong_variants_are_told(project, study, message):
    studies = {"physics": EXCAVATOR["studies"]["physics"] | study}
    project["params.yaml"]["excavator"] = EXCAVATOR | {"studies": studies}
    try:
        with pytest.raises(ParameterError, match=message):
            cases.load("excavator")
    finally:
        project["params.yaml"]["excavator"] = EXCAVATOR


def test_the_report_tells_of_all(section):
    cases.module("general", "report").report(section)
    page = (section.report / "README.md").read_text()
    assert "## Samples that it takes" in page and "## What the model leaves open" in page
    assert "beam_network, theory of the variant" in (section.report / "physics.md").read_text()
    for name in ("networks", "learning_curves"):
        rows = (section.report / f"{name}.md").read_text()
        assert all(network in rows for network in ("many", "polynomial", "remainder", "layers"))


def test_only_what_changed_is_learnt_again(section, project):
    before = {part.name: part for part in cases.parts(section, "train")}
    other = {**POLYNOMIAL, "steps": [{"name": "PolynomialFeatures"}, POLYNOMIAL["steps"][1]]}
    networks = EXCAVATOR["networks"]
    changed = {
        "polynomial": {**networks["polynomial"], "regressor": other},
        "layers": {**networks["layers"], "module": {**LAYERS, "activation": "SiLU"}},
    }
    project["params.yaml"]["excavator"] = {**EXCAVATOR, "networks": networks | changed}
    after = {part.name: part for part in cases.parts(cases.load("excavator"), "train")}
    project["params.yaml"]["excavator"] = EXCAVATOR
    folder = section.data / "networks"
    assert all(is_current(folder, part) for part in before.values())
    current = {name for name, part in after.items() if is_current(folder, part)}
    assert current == networks.keys() - changed.keys()


def test_levels_are_as_evenly_spaced_as_the_grid_has_them():
    table = pd.DataFrame({"payload": np.repeat(np.arange(50.0, 501.0, 50.0), 3)})
    for n, expected in (
        (2, [50.0, 500.0]),
        (3, [50.0, 250.0, 500.0]),
        (10, np.arange(50.0, 501.0, 50.0)),
        (99, np.arange(50.0, 501.0, 50.0)),
    ):
        found = with_levels(table, n)
        assert np.array_equal(np.unique(found["payload"]), expected)
        assert len(found) == 3 * len(expected)


@pytest.mark.parametrize(
    ("networks", "methods", "message"),
    [
        (
            {"polynomial": {"learns": "tip", "regressor": POLYNOMIAL}},
            {"direct": {"network": "polynomial"}},
            "methods.direct.network: expected one of n_hidden units",
        ),
        (
            {"polynomial": {"learns": "tip", "regressor": POLYNOMIAL}},
            {"combined": {"network": "polynomial"}},
            "'polynomial' learns tip, combined needs deflection",
        ),
        (
            {"polynomial": {"learns": "deflection", "regressor": {"name": "Ridgy"}}},
            {},
            "excavator.networks.polynomial: scikit-learn has no 'Ridgy'",
        ),
        (
            {"layers": {"learns": "tip", "module": LAYERS, "n_restarts": 1, "trainers": ["study"]}},
            {},
            "networks.layers.trainers.0: expected a trainer of kind adam or lbfgs, got 'study'",
        ),
        (
            {"layers": {"learns": "tip", "module": {"name": "no.such:Module"}, "n_restarts": 1}},
            {},
            "excavator.networks.layers: module no.such: there is none",
        ),
        (
            {"layers": {"learns": "tip", "module": LAYERS, "trainer": "study", "n_restarts": 1}},
            {},
            "networks.layers.trainer: there is no such key",
        ),
        (
            {"few": {"learns": "tip", "n_hidden": 3, "n_restarts": 1}},
            {},
            "learning_curves.networks.0: expected a network of given size that learns deflection",
        ),
    ],
)
def test_wrong_entries_are_told(project, networks, methods, message):
    given = {**EXCAVATOR, "networks": networks, "methods": {"none": {}, **methods}}
    if "few" not in networks:
        given.pop("studies")
    project["params.yaml"]["excavator"] = given
    try:
        with pytest.raises(ParameterError, match=message):
            cases.check(cases.load("excavator"))
    finally:
        project["params.yaml"]["excavator"] = EXCAVATOR
