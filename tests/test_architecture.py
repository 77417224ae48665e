"""Rooms import only downwards, stages know no case, and DVC watches what its stages use."""

import ast
import re
import sys
from pathlib import Path

import pytest
import yaml

from flexik.cases.case import STAGES, codes
from flexik.datasets import code

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "flexik"
ROOMS = (
    *("machines", "kinematics", "multibody", "datasets", "learning"),
    *("positioning", "evaluation", "reporting", "planar", "cases"),
)
# Shared modules and what they may import of flexik
SHARED = {
    "errors": set(),
    "kernels": set(),
    "files": {"errors"},
    "parameters": {"errors", "files"},
    "stage": {"errors", "kernels", "cases", "datasets"},
    "__main__": {"kernels", "stage", "commands"},
    "docs": {"files", "parameters", "machines", "planar", "reporting", "cases"},
    "commands": {
        *(
            "errors",
            "files",
            "parameters",
            "machines",
            "kinematics",
            "planar",
            "reporting",
            "cases",
        ),
    },
}
HOMES = {
    "exudyn": "multibody",
    "torch": "learning",
    "sklearn": "learning",
    "matplotlib": "reporting",
    "jinja2": "reporting",
    "pyarrow": "datasets",
    "joblib": "datasets",
    "dask": "datasets",
    "distributed": "datasets",
    "pymoo": "positioning",
}
PICKLES = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "shelve", "marshal"}
LONGEST = {"file": 400, "function": 60, "script": 60}

CASES = codes()
MODULES = sorted(SOURCE.rglob("*.py"))
SCRIPTS = sorted((ROOT / "stages").glob("*.py"))
EVERYTHING = [*MODULES, *SCRIPTS, *(ROOT / "profiles").glob("*.py"), *ROOT.glob("benchmarks/*.py")]


def relative(path):
    return path.relative_to(ROOT).as_posix()


def imports(path):
    """Full names imported anywhere in `path`, functions included; `from a import b` gives a.b."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import in line {node.lineno}"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def libraries(path):
    return {name.partition(".")[0] for name in imports(path)}


def rooms_of(path):
    """Rooms and shared modules of flexik that `path` imports."""
    return {name.split(".")[1] for name in imports(path) if name.startswith("flexik.")}


def room(path):
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


def test_every_module_is_in_a_known_room():
    assert {room(path) for path in MODULES} <= {*ROOMS, *SHARED, "__init__"}


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_rooms_import_only_downwards(path):
    own = room(path)
    if own in ROOMS:
        allowed = {*ROOMS[: ROOMS.index(own) + 1], *SHARED} - {"stage"}
    else:
        allowed = {own, *SHARED.get(own, set())}
    assert rooms_of(path) <= allowed


@pytest.mark.parametrize("path", sorted((SOURCE / "cases").rglob("*.py")), ids=relative)
def test_cases_do_not_import_each_other(path):
    own = path.relative_to(SOURCE / "cases").parts[0]
    others = {name.split(".")[2] for name in imports(path) if name.startswith("flexik.cases.")}
    assert others <= {own, "case"}


@pytest.mark.parametrize("path", EVERYTHING, ids=relative)
def test_heavy_libraries_have_one_home(path):
    for library in libraries(path) & HOMES.keys():
        home = SOURCE / HOMES[library]
        # benchmarks compare the homes with other libraries
        assert path.is_relative_to(home) or path.parent.name == "benchmarks", library


@pytest.mark.parametrize("path", sorted((SOURCE / "kinematics").glob("*.py")), ids=relative)
def test_kinematics_needs_only_numpy(path):
    assert libraries(path) <= {"numpy", "flexik", *sys.stdlib_module_names}


@pytest.mark.parametrize("path", EVERYTHING, ids=relative)
def test_nothing_is_pickled(path):
    assert not libraries(path) & PICKLES
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.keyword):
            assert node.arg != "allow_pickle" or (
                isinstance(node.value, ast.Constant) and node.value.value is False
            )
        if isinstance(node, ast.Attribute):
            assert node.attr not in {"to_pickle", "read_pickle"}


@pytest.mark.parametrize("path", EVERYTHING, ids=relative)
def test_nothing_is_long(path):
    text = path.read_text()
    assert text.count("\n") <= LONGEST["script" if path in SCRIPTS else "file"]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno < LONGEST["function"], node.name


@pytest.mark.parametrize("path", [*SCRIPTS, SOURCE / "stage.py"], ids=relative)
def test_stages_know_no_case(path):
    assert not [case for case in CASES if case in path.read_text()]


def test_dvc_yaml_names_cases_in_lists_alone():
    text = (ROOT / "dvc.yaml").read_text()
    lists = re.sub(r"\[[^\[\]]*\]", "", text[text.index("  readme:") :])
    rest = text[: text.index("  readme:")] + lists
    assert not [case for case in CASES if case in rest]


PARAMETERS = yaml.safe_load((ROOT / "params.yaml").read_text())
PIPELINE = yaml.safe_load((ROOT / "dvc.yaml").read_text())


def stages():
    """All stages of dvc.yaml by name and case, foreach put in."""
    found = {}
    for name, stage in PIPELINE["stages"].items():
        if "foreach" not in stage:
            found[name, ""] = stage
            continue
        assert stage["foreach"] == "${cases}"
        for case, entry in PARAMETERS["cases"].items():
            found[name, case] = filled(stage["do"], case, entry["code"])
    return found


def filled(value, case, code):
    if isinstance(value, dict):
        return {filled(k, case, code): filled(v, case, code) for k, v in value.items()}
    if isinstance(value, list):
        return [filled(v, case, code) for v in value]
    if not isinstance(value, str):
        return value
    return value.replace("${key}", case).replace("${item.code}", code)


FILLED = stages()
each_stage = pytest.mark.parametrize("name", FILLED, ids="@".join)


def outputs(stage):
    return [next(iter(e)) if isinstance(e, dict) else e for e in stage.get("outs", [])]


def covers(dependency, path):
    return path == dependency or path.startswith(f"{dependency}/")


def test_every_case_runs_every_stage():
    assert {entry["code"] for entry in PARAMETERS["cases"].values()} == set(CASES)
    assert all((ROOT / f"data/machines/{name}.yaml").is_file() for name in PARAMETERS["cases"])
    by_case = [name for name, stage in PIPELINE["stages"].items() if "foreach" in stage]
    assert by_case == [*STAGES, "report"]
    scripts = {stage["cmd"].split()[1] for stage in FILLED.values()}
    assert scripts == {relative(path) for path in SCRIPTS} - {"stages/start.py"}


@pytest.mark.parametrize("case", CASES)
def test_every_case_is_a_folder_of_the_same_files(case):
    folder = SOURCE / "cases" / case
    for name in ("section.py", "report.py", "page.md.j2", "parts/generate.py", "parts/train.py"):
        assert (folder / name).is_file()
    known = {path.stem for path in (folder / "parts").glob("*.py")}
    assert {"evaluate", "study"} <= known
    assert (ROOT / "data/reference" / case).is_dir() == (case != "general")


@each_stage
def test_every_module_a_stage_uses_is_its_dependency(name):
    stage, case = name
    where = "report" if stage == "report" else f"parts.{stage}"
    folder = PARAMETERS["cases"][case]["code"] if case else ""
    module = f"flexik.cases.{folder}.{where}"
    if not case or code.module_file(module) is None:
        return
    files = {relative(path) for path in code.closure(module) if path.name != "__init__.py"}
    assert files
    deps = FILLED[name]["deps"]
    assert not {path for path in files if not any(covers(d, path) for d in deps)}


@each_stage
def test_every_file_a_stage_depends_on_is_there_or_is_made(name):
    made = [path for stage in FILLED.values() for path in outputs(stage)]
    for dependency in FILLED[name].get("deps", []):
        by_stage = any(covers(dependency, path) or covers(path, dependency) for path in made)
        assert by_stage or (ROOT / dependency).exists(), dependency


@each_stage
def test_every_validated_file_a_stage_depends_on_is_a_key_of_its_section(name):
    """DVC would read params.yaml again for every stage that lists a key of it."""
    stage, case = name
    assert "params" not in FILLED[name]
    keys = {d for d in FILLED[name].get("deps", []) if d.startswith(f"data/validated/{case}/")}
    known = {*PARAMETERS.get(case, ()), "calibration", "files", "studies"}  # they have defaults
    assert {Path(key).stem for key in keys} <= known
    assert keys or stage in ("validate", "report", "readme")


@each_stage
def test_outputs_are_kept_until_they_are_replaced(name):
    assert FILLED[name]["desc"].endswith(".")
    for output in FILLED[name]["outs"]:
        assert next(iter(output.values()))["persist"] is True
