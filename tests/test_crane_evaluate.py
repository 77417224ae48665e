"""Errors of the crane's methods as parts: what each is made of, and the spread over restarts."""

import shutil

import crane_case
import numpy as np
import pytest
from crane_case import KINDS, SAMPLE_FIELDS, TARGET_FIELDS

from flexik.cases.crane.parts import tolerance
from flexik.cases.crane.section import SPRING
from flexik.datasets.parallel import ParallelSettings
from flexik.datasets.parts import key, make
from flexik.datasets.tables import read_table, write_table
from flexik.errors import ParameterError
from flexik.evaluation.errors import statistics
from flexik.files import write_json
from flexik.learning.perceptron import Network, Normalisation, quantities
from flexik.learning.stopping import StopReason
from flexik.learning.storage import network_file
from flexik.learning.training import TrainingRecord
from flexik.planar import evaluate
from flexik.planar.methods import method_of
from flexik.planar.network_section import PlanarNetwork
from flexik.positioning.combined import Combined
from flexik.positioning.inversion import GaussNewton

SETTINGS = ParallelSettings(n_workers=1)
RANGES = {"payload": (0.0, 500.0), "tip_x": (0.0, 6.5), "tip_y": (-4.5, 8.0)} | {
    name: (0.0, most)
    for name, most in zip(
        ("lift_stroke", "jib_stroke", "extension_stroke"), (0.535, 0.78, 1.6), strict=True
    )
}


def network_of(learns, seed):
    """Two hidden units, of which `seed` makes small or large deflections, tips or strokes."""
    kind = KINDS["tip" if learns == "correction" else learns]
    low, high = zip(*(RANGES[field.name] for field in kind.inputs), strict=True)
    scale = 0.01 * seed if learns == "deflection" else 1.0
    ends = [RANGES.get(field.name, (-scale, scale)) for field in kind.outputs]
    generator = np.random.default_rng(seed)
    first, last = generator.normal(size=(2, len(low) + 1)), generator.normal(size=(2, 3))
    return Network(
        (first, last),
        "tanh",
        Normalisation(np.array(low), np.array(high)),
        Normalisation(*np.array(ends).T),
        tuple(quantities(kind.inputs)),
        tuple(quantities(kind.outputs)),
    )


def of_thesis():
    """The crane with networks of the kinds of the thesis, and methods that need no others."""
    section = crane_case.section()
    networks = {
        name: given
        for name, given in section.networks.items()
        if isinstance(given, PlanarNetwork) and (given.learns or "correction") in KINDS
    }
    methods = {k: m for k, m in section.methods.items() if m.network in {None, *networks}}
    return section.model_copy(update={"networks": networks, "methods": methods})


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Folder with targets and networks that never learnt anything, and few conditions."""
    shutil.copytree(crane_case.ROOT / "data/reference/crane", tmp_path / "data/reference/crane")
    write_json(tmp_path / "data/crane/constants/constants.json", {"constants": {SPRING: 8e6}})
    targets = np.array([[4.0, 1.0, 100.0], [3.0, 2.0, 300.0], [5.0, 0.0, 50.0]])
    columns = dict(
        zip((f.name for f in TARGET_FIELDS), [*targets.T, *np.zeros((3, 3))], strict=True)
    )
    grid = {f.name: np.zeros(1, dtype=f.dtype) for f in SAMPLE_FIELDS}
    write_table(tmp_path / "data/crane/samples/grid.parquet", grid, SAMPLE_FIELDS)
    write_table(tmp_path / "data/crane/samples/workspace.parquet", columns, TARGET_FIELDS)
    for name, given in of_thesis().networks.items():
        made = [
            (
                network_of(given.learns or "correction", seed),
                TrainingRecord("adam", 1, seed, StopReason("goal"), (0.1,), 0, 0.1 * seed),
            )
            for seed in (1, 2)
        ]
        folder = tmp_path / "data/crane/networks"
        folder.mkdir(exist_ok=True, parents=True)
        network_file(made[:1])(folder / f"{name}.json")
        network_file(made)(folder / f"{name}.restarts.json")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def section():
    section = of_thesis()
    points = section.conditions["published"].model_copy(
        update={"points": [(4.0, 1.0), (2.0, 2.0)], "payloads": [30.0, 470.0]}
    )
    return section.model_copy(update={"conditions": {**section.conditions, "published": points}})


def with_method(section, name, **changes):
    method = section.methods[name].model_copy(update=changes)
    return section.model_copy(update={"methods": {**section.methods, name: method}})


def keys(section):
    return {part.name: key(part) for part in evaluate.parts(section)}


def test_a_part_changes_with_its_own_method_alone(project, section):
    before = keys(section)
    assert set(before) == {
        f"{conditions}/{name}" for conditions in section.conditions for name in section.methods
    }

    def changed(other):
        return {name for name, found in keys(other).items() if found != before[name]}

    both = {"published/combined", "workspace/combined"}
    assert changed(with_method(section, "combined", n_corrections=2)) == both
    assert changed(with_method(section, "combined", n_targets=2)) == {"workspace/combined"}
    direct = {f"{conditions}/direct" for conditions in section.conditions}
    assert changed(with_method(section, "direct", inversion=GaussNewton())) == direct


def test_errors_and_their_spread_over_restarts(project, section):
    parts = {part.name: part for part in evaluate.parts(section)}
    names = ["published/none", "published/combined", "published/combined_ga", "workspace/combined"]
    make("errors", [parts[name] for name in names], SETTINGS)
    tables = {name: read_table(f"errors/{name}.parquet") for name in names}
    assert [len(table) for table in tables.values()] == [4, 4, 4, 3]
    assert tables["published/combined"]["payload"].tolist() == [30, 470, 30, 470]
    assert tables["workspace/combined"]["target_x"].tolist() == [4, 3, 5]
    spread = read_table("errors/published/combined.spread.parquet")
    assert spread["restart"].tolist() == [1, 2]
    assert spread["selection_error"].tolist() == pytest.approx([0.1, 0.2])
    # the method's own network is the first of the restarts
    own = statistics(tables["published/combined"])
    assert spread["mean_error"][0] == pytest.approx(own["mean_error"], abs=1e-7)
    assert spread["max_error"][0] == pytest.approx(own["max_error"], abs=1e-7)
    assert spread["mean_error"][1] != pytest.approx(own["mean_error"], rel=0.01)
    assert not (project / "errors/published/none.spread.parquet").exists()
    assert not (project / "errors/workspace/combined.spread.parquet").exists()


def test_pieces_and_workers_decide_nothing(project, section, monkeypatch):
    (part,) = (p for p in evaluate.parts(section) if p.name == "workspace/direct")
    make("one", [part], SETTINGS)
    monkeypatch.setattr(evaluate, "ROWS", 2)
    make("two", [part], ParallelSettings(n_workers=2))
    one, two = (read_table(f"{folder}/workspace/direct.parquet") for folder in ("one", "two"))
    assert np.allclose(one, two, rtol=0.0, atol=1e-7)
    few = with_method(section, "direct", n_targets=2)
    (part,) = (p for p in evaluate.parts(few) if p.name == "workspace/direct")
    make("few", [part], SETTINGS)
    assert len(read_table("few/workspace/direct.parquet")) == 2


def test_tolerances_are_those_of_the_study(project, section):
    make("studies", [tolerance.part(section)], SETTINGS)
    table = read_table("studies/tolerance.parquet")
    given = section.studies.tolerance
    assert table["method"].tolist() == [m for m in given.methods for _ in given.tolerances]
    assert table["tolerance"].tolist() == given.tolerances * len(given.methods)


def test_a_method_of_params_yaml_is_there_for_others(project, section):
    method = method_of(section, "combined")
    assert isinstance(method, Combined)
    assert np.array_equal(method.network.weights[0], network_of("deflection", 1).weights[0])
    with pytest.raises(ParameterError, match=r"there is no 'nothing' \(none, combined"):
        method_of(section, "nothing")
