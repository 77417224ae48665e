"""Rooms import only downwards, heavy libraries have one home, DVC watches what its stages use."""

import ast
import re
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "flexik"
ROOMS = (
    *("kinematics", "multibody", "datasets", "learning"),
    *("positioning", "evaluation", "reporting"),
)
# Shared modules and what they may import of flexik
SHARED = {
    "errors": set(),
    "files": {"errors"},
    "parameters": {"errors", "files"},
    "stage": {"errors"},
}
HOMES = {
    "exudyn": "multibody",
    "torch": "learning",
    "matplotlib": "reporting",
    "pyarrow": "datasets",
    "joblib": "datasets",
    "dask": "datasets",
    "distributed": "datasets",
    "pymoo": "positioning",
}
PICKLES = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "shelve", "marshal"}
# No dependency of any stage: the values of params.yaml are watched themselves, and these modules
# only check them, report errors and write files
UNWATCHED = {"__init__", *SHARED}
MAXIMUM_MAIN = 60

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
    assert {room(path) for path in MODULES} == {*ROOMS, *SHARED, "__init__"}


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_rooms_import_only_downwards(path):
    own = room(path)
    if own in ROOMS:
        allowed = {*ROOMS[: ROOMS.index(own) + 1], *SHARED} - {"stage"}
    else:
        allowed = {own, *SHARED.get(own, set())}
    assert rooms_of(path) <= allowed
    assert "flexik" not in imports(path)


@pytest.mark.parametrize("path", EVERYTHING, ids=relative)
def test_heavy_libraries_have_one_home(path):
    for library in libraries(path) & HOMES.keys():
        home = SOURCE / HOMES[library]
        # benchmarks compare the homes with other libraries
        assert path.is_relative_to(home) or path.parent.name == "benchmarks", library


@pytest.mark.parametrize("path", sorted((SOURCE / "kinematics").glob("*.py")), ids=relative)
def test_mechanisms_need_only_numpy(path):
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


def modules_named(name):
    """Files that `import name` runs: its packages, and itself where it is a module."""
    parts, files = name.split("."), []
    for n in range(1, len(parts) + 1):
        stem = ROOT.joinpath("src", *parts[:n])
        files += [f for f in (stem / "__init__.py", stem.with_suffix(".py")) if f.is_file()]
    return files


def is_empty(path):
    """Whether nothing but a docstring stands in an __init__.py."""
    return path.name == "__init__.py" and len(ast.parse(path.read_text()).body) == 1


def closure(script):
    """Files of this repository that run when `script` runs."""
    found, waiting = set(), [script]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += [file for name in imports(path) for file in modules_named(name)]
    return found


def filled(value, key, item):
    """`value` of dvc.yaml with ${key}, ${item.x.y} and ${a.parameter} put in."""
    if isinstance(value, dict):
        return {filled(k, key, item): filled(v, key, item) for k, v in value.items()}
    if isinstance(value, list):
        return [filled(v, key, item) for v in value]
    if not isinstance(value, str):
        return value
    value = value.replace("${key}", key)
    value = re.sub(r"\$\{item\.([\w.]+)\}", lambda found: str(lookup(item, found[1])), value)
    return re.sub(r"\$\{([\w.]+)\}", lambda found: str(lookup(PARAMETERS, found[1])), value)


def lookup(data, dotted):
    for name in dotted.split("."):
        data = data[name]
    return data


PARAMETERS = yaml.safe_load((ROOT / "params.yaml").read_text())
PIPELINE = yaml.safe_load((ROOT / "dvc.yaml").read_text())["stages"]


def stages():
    """All stages of dvc.yaml by name, foreach put in."""
    found = {}
    for name, stage in PIPELINE.items():
        if "foreach" not in stage:
            found[name] = filled(stage, "", {})
            continue
        for key, item in lookup(PARAMETERS, stage["foreach"][2:-1]).items():
            found[f"{name}@{key}"] = filled(stage["do"], key, item)
    return found


STAGES = stages()
each_stage = pytest.mark.parametrize("name", STAGES)


def script_of(stage):
    python, script, *_ = stage["cmd"].split()
    assert python == "python"
    return ROOT / script


def paths(entries):
    return [next(iter(entry)) if isinstance(entry, dict) else entry for entry in entries]


def outputs(stage):
    return paths([*stage.get("outs", []), *stage.get("metrics", []), *stage.get("plots", [])])


def covers(dependency, path):
    return path == dependency or path.startswith(f"{dependency}/")


def test_dvc_yaml_holds_the_stages_of_the_case():
    assert {name.partition("@")[0] for name in STAGES} == set(PIPELINE)
    assert {"crane_train@deflection", "fanuc_train@config1"} <= set(STAGES)
    assert "${" not in str(STAGES)


@each_stage
def test_every_module_a_stage_imports_is_its_dependency(name):
    stage = STAGES[name]
    files = closure(script_of(stage))
    used = {
        relative(path)
        for path in files
        if not (path.is_relative_to(SOURCE) and (room(path) in UNWATCHED or is_empty(path)))
    }
    missing = {p for p in used if not any(covers(d, p) for d in stage["deps"])}
    assert not missing


@each_stage
def test_every_source_dependency_of_a_stage_is_imported(name):
    stage = STAGES[name]
    used = {relative(path) for path in closure(script_of(stage))}
    source = [d for d in stage["deps"] if d.startswith(("src/", "stages/"))]
    assert not [d for d in source if not any(covers(d, path) for path in used)]


@each_stage
def test_every_file_a_stage_depends_on_is_there_or_is_made(name):
    made = [path for stage in STAGES.values() for path in outputs(stage)]
    for dependency in STAGES[name]["deps"]:
        by_stage = any(covers(dependency, path) or covers(path, dependency) for path in made)
        assert by_stage or (ROOT / dependency).exists(), dependency
        assert not Path(dependency).is_absolute()


@each_stage
def test_every_parameter_of_a_stage_exists(name):
    for key in STAGES[name].get("params", []):
        lookup(PARAMETERS, key)


# What files say of the parameters that made them, by their checksum: see datasets/*/provenance.py
CARRIED = {
    "data/crane/calibration.json": ("crane.geometry", "crane.structure", "crane.evaluation"),
    "data/crane/grid.parquet": ("crane.grid",),
    "data/crane/selection.parquet": ("crane.selection",),
    "data/crane/networks": ("crane.grid", "crane.selection"),
    "data/crane/targets.parquet": ("crane.workspace", "crane.grid"),
    "data/elastic_arm/readings.parquet": (
        *("elastic_arm.geometry", "elastic_arm.structure"),
        *("elastic_arm.gauges", "elastic_arm.readings"),
    ),
    "data/fanuc/path.parquet": ("fanuc.joints", "fanuc.path"),
}
# What a script mentions for other methods than that of the stage
OTHER_METHODS = {"crane_evaluate_none": {"methods"}}
# Section of params.yaml by the name it has in scripts
SECTIONS = {case: case for case in PARAMETERS if case != "parallel"} | {"arm": "elastic_arm"}


@each_stage
def test_every_section_a_script_mentions_is_a_parameter_of_its_stage(name):
    """Sections named as CASE.SECTION in the script; how many workers compute decides nothing."""
    tree = ast.parse(script_of(STAGES[name]).read_text())
    mentioned = {
        (SECTIONS[node.value.id], node.attr)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and name.startswith(SECTIONS.get(node.value.id, " "))
        and node.attr in PARAMETERS[SECTIONS[node.value.id]]
    }
    watched, deps = STAGES[name].get("params", []), STAGES[name]["deps"]
    if "params.yaml" in deps:
        return
    sections = {tuple(key.split(".")[:2]) for key in watched}
    for file, keys in CARRIED.items():
        if any(covers(file, dependency) for dependency in deps):
            sections |= {tuple(key.split(".")) for key in keys}
    others = OTHER_METHODS.get(name.partition("@")[0], set())
    needed = {(case, section) for case, section in mentioned if case not in watched}
    assert needed - {("crane", section) for section in others} <= sections


NETWORKS = {
    name: (section, network)
    for section, networks in PARAMETERS["crane"].items()
    if section.endswith("networks")
    for name, network in networks.items()
}


@pytest.mark.parametrize("name", NETWORKS)
def test_stages_of_a_network_watch_its_trainers_and_the_network_it_corrects(name):
    section, network = NETWORKS[name]
    folder, of_network = "data/crane/networks", [s for s in STAGES if s.endswith(f"@{name}")]
    stages = [s for s in of_network if s.startswith(("crane_train", "crane_select"))]
    assert len(stages) == (2 if "select" in network else 1)
    assert [s for s in stages if f"{folder}/{name}.json" in outputs(STAGES[s])] == stages[-1:]
    trainers = {network["trainer"], network.get("select", network)["trainer"]}
    for stage in (STAGES[s] for s in stages):
        params = set(stage["params"])
        assert f"crane.{section}.{name}" in params
        assert {key for key in params if key.startswith("crane.trainers")} == {
            f"crane.trainers.{trainer}" for trainer in trainers
        }
        networks = [path for path in stage["deps"] if path.startswith(folder)]
        assert networks == ([f"{folder}/{network['rigid']}.json"] if "rigid" in network else [])


ARM_NETWORKS = {
    name: (section, network)
    for section in ("networks", "selected_networks")
    for name, network in PARAMETERS["elastic_arm"][section].items()
}


@pytest.mark.parametrize("name", ARM_NETWORKS)
def test_stages_of_a_network_of_the_arm_watch_its_trainers(name):
    section, network = ARM_NETWORKS[name]
    prefixes = ("elastic_arm_train", "elastic_arm_select")
    of_network = [s for s in STAGES if s.endswith(f"@{name}") and s.startswith(prefixes)]
    assert len(of_network) == (2 if "select" in network else 1)
    trainers = {network["trainer"], network.get("select", network)["trainer"]}
    for stage in of_network:
        params = set(STAGES[stage]["params"])
        assert f"elastic_arm.{section}.{name}" in params
        assert {key for key in params if key.startswith("elastic_arm.trainers")} == {
            f"elastic_arm.trainers.{trainer}" for trainer in trainers
        }


@each_stage
def test_every_stage_tells_what_it_does(name):
    assert STAGES[name]["desc"].endswith(".")
    assert "parallel" not in STAGES[name].get("params", [])


def test_no_output_is_made_twice():
    made = [path for stage in STAGES.values() for path in outputs(stage)]
    assert len(made) == len(set(made))


def test_every_script_is_a_stage():
    assert {script_of(stage) for stage in STAGES.values()} == set(SCRIPTS)


@pytest.mark.parametrize("path", SCRIPTS, ids=relative)
def test_scripts_are_thin(path):
    (main,) = (
        node
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef) and node.name == "main"
    )
    assert main.end_lineno - main.lineno < MAXIMUM_MAIN
    assert path.read_text().endswith('if __name__ == "__main__":\n    stage.run(main)\n')


@pytest.mark.parametrize("path", SCRIPTS, ids=relative)
def test_docstrings_name_the_outputs(path):
    text = ast.get_docstring(ast.parse(path.read_text()))
    written = text[text.lower().index("writes") :] if "writes" in text.lower() else ""
    for stage in PIPELINE.values():
        stage = stage.get("do", stage)
        if script_of(stage) != path:
            continue
        for output in outputs(stage):
            # the name of a foreach stands in capitals, as in NETWORK.json
            name = re.escape(Path(output).name).replace(re.escape("${key}"), "[A-Z]+")
            stem = re.escape(Path(output).stem)
            known = re.search(name, written) or re.search(rf"\b{stem}\b", written)
            method = f"{Path(output).parent.name}/METHOD.parquet"
            assert known or (path.stem == "crane_evaluate" and method in written), output


@pytest.mark.parametrize("path", SCRIPTS, ids=relative)
def test_docstrings_name_the_parameters(path):
    text = ast.get_docstring(ast.parse(path.read_text()))
    for stage in PIPELINE.values():
        stage = stage.get("do", stage)
        if script_of(stage) != path:
            continue
        for key in stage.get("params", []):
            plain = re.sub(r"\.\$\{[^}]+\}", "", key)
            # a section that is named stands for its keys
            section = re.escape(".".join(plain.split(".")[:2])) + r"(?![.\w])"
            assert plain in text or re.search(section, text), f"{plain} is not mentioned"
