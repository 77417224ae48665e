"""Run the pipeline with a profile, in a copy of the project that is removed afterwards.

Usage: profiles/run.py PROFILE.yaml [FOLDER]. With FOLDER the copy is made there and kept.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "src"))

from flexik import stage  # noqa: E402
from flexik.errors import DataError, FlexikError  # noqa: E402
from flexik.files import write_text  # noqa: E402
from flexik.parameters.reading import PARAMETERS_FILE, overlay, read_yaml  # noqa: E402


def main() -> None:
    """Copy, overlay, reproduce."""
    if len(sys.argv) not in (2, 3):
        raise FlexikError("usage: profiles/run.py PROFILE.yaml [FOLDER]")
    profile = Path(sys.argv[1])
    if len(sys.argv) == 3:
        run(profile, Path(sys.argv[2]))
        return
    with tempfile.TemporaryDirectory() as folder:
        run(profile, Path(folder))


def run(profile: Path, folder: Path) -> None:
    """Copy the project to `folder` with `profile` laid over params.yaml, and run the pipeline."""
    copy_project(folder)
    values = overlay(read_yaml(folder / PARAMETERS_FILE), read_yaml(profile))
    write_text(folder / PARAMETERS_FILE, yaml.safe_dump(values, sort_keys=False))
    # the stages' `python` is the one that runs this file
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "DVC_NO_ANALYTICS": "1"}
    done = subprocess.run(["dvc", "repro"], cwd=folder, env=environment, check=False)
    if done.returncode:
        raise FlexikError(f"profile {profile}: the pipeline failed in {folder}")


def copy_project(folder: Path) -> None:
    """Copy what git tracks or would track, as it stands in the work tree, to a new git checkout."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        raise DataError(f"{ROOT}: expected a git checkout ({listed.stderr.strip()})")
    if folder.exists() and any(folder.iterdir()):
        raise DataError(f"{folder}: expected an empty or a new folder")
    for name in listed.stdout.splitlines():
        source, target = ROOT / name, folder / name
        # lock and reports are of other parameters; a tracked file may be deleted in the tree
        made = name == "dvc.lock" or re.match("reports/(?!benchmarks/)", name)
        if source.is_file() and not made:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    subprocess.run(["git", "init", "--quiet"], cwd=folder, check=True)


if __name__ == "__main__":
    stage.run(main)
