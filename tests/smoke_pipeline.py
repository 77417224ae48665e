"""Running the pipeline, or a stage of it, and looking at what it left."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import yaml

from flexik.parameters.reading import PARAMETERS_FILE, overlay, read_yaml

ROOT = Path(__file__).parents[1]
PROFILE = ROOT / "profiles/smoke.yaml"
PARAMETERS = overlay(read_yaml(ROOT / PARAMETERS_FILE), read_yaml(PROFILE))


def environment(**more):
    """As a user of the Makefile has it."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("FLEXIK_")}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return kept | {"PATH": path, "DVC_NO_ANALYTICS": "1"} | more


def call(project, *command, **more):
    return subprocess.run(
        command,
        cwd=project,
        env=environment(**more),
        capture_output=True,
        text=True,
        check=False,
    )


def stage(project, name, *case, **more):
    return call(project, sys.executable, f"stages/{name}.py", *case, **more)


def reproduce(project, *stages):
    return call(project, "dvc", "repro", *stages)


def stages_run(done):
    lines = [line for line in done.stdout.splitlines() if line.startswith("Running stage '")]
    return {line.split("'")[1] for line in lines}


def edit(project, **values):
    """Set dotted keys (with __ for the dot) of params.yaml."""
    data = read_yaml(project / PARAMETERS_FILE)
    for key, value in values.items():
        *path, last = key.split("__")
        section = data
        for name in path:
            section = section[name]
        section[last] = value
    (project / PARAMETERS_FILE).write_text(yaml.safe_dump(data, sort_keys=False))


def snapshot(project, *folders):
    """Bytes and time of change of all files (of `folders`) but what dvc and git keep."""
    return {
        path.relative_to(project).as_posix(): (
            hashlib.sha256(path.read_bytes()).hexdigest(),
            path.stat().st_mtime_ns,
        )
        for path in sorted(project.rglob("*"))
        if path.is_file()
        and path.relative_to(project).parts[0] not in {".git", ".dvc"}
        and "__pycache__" not in path.parts
        and (not folders or path.relative_to(project).as_posix().startswith(folders))
    }


def changed(before, after):
    """Names of files that another run wrote, removed or added."""
    return {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}


def one_error(done):
    """The line beginning with `error: `, alone of its kind and without a traceback."""
    text = done.stdout + done.stderr
    assert "Traceback" not in text, text
    (line,) = (line for line in text.splitlines() if line.startswith("error: "))
    return line
