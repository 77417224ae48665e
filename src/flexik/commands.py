"""What the command `flexik` does: begin a machine, check it, run its case."""

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np

from flexik.cases import case as cases
from flexik.cases.general.section import Section
from flexik.errors import ParameterError
from flexik.files import write_text
from flexik.kinematics.machine_file import manipulator_of
from flexik.machines.bodies import NAME
from flexik.machines.planar import PlanarMachine
from flexik.parameters.conditions import RandomTargets
from flexik.parameters.describe import commented
from flexik.parameters.reading import PARAMETERS_FILE
from flexik.parameters.section import DATA, MACHINES
from flexik.planar.machine import flexible
from flexik.planar.picture import moved, picture
from flexik.planar.section import PlanarSection, share_reached
from flexik.planar.shape import drawn
from flexik.reporting.style import write_png

# Random poses whose tips show the reach
N_TIPS = 4000


def new(name: str, like: str) -> list[str]:
    """Begin the machine `name` as a copy of the case `like`: its file, its section and its entry.

    Returns what to do next; raises ParameterError if the name is taken or none.
    """
    known = cases.entries()
    if not re.fullmatch(NAME, name):
        raise ParameterError(f"{name}: a name is small letters, digits and _, the first a letter")
    if like not in known or known[like].code != "general":
        models = ", ".join(other for other, entry in known.items() if entry.code == "general")
        raise ParameterError(f"--like {like}: expected one of {models}")
    file, text = MACHINES / f"{name}.yaml", Path(PARAMETERS_FILE).read_text(encoding="utf-8")
    if name in known or file.exists() or re.search(rf"(?m)^{name}:", text):
        raise ParameterError(
            f"{name}: there is such a machine already, {file} or {PARAMETERS_FILE}"
        )
    section = re.search(rf"(?ms)^{like}:\n.*?(?=^\S|\Z)", text)
    entries = re.search(r"(?m)^cases:\n(?:[ #].*\n)*", text)
    if section is None or entries is None:
        raise ParameterError(f"{PARAMETERS_FILE}: expected a block `cases:` and a section {like}")
    body = section.group().rstrip().split("\n", 1)[1]
    entry = f"  {name}: {{code: general}}\n"
    changed = text[: entries.end()] + entry + text[entries.end() :].rstrip()
    # what the comments of the model tell, sources and reasons, is not true of the new machine
    begun, keys = f"(begun as {like})", "what the keys mean: docs"
    machine = commented((MACHINES / f"{like}.yaml").read_text(encoding="utf-8"), PlanarMachine)
    machine = re.sub(r"(?m)^title: .*$", f"title: {name} {begun}", machine)
    machine = re.sub(r"(?m)^notes:.*\n([ -].*\n)*", "", machine)
    write_text(file, f"# {name} {begun}; {keys}/machine_file.md\n{machine}")
    body = textwrap.indent(commented(textwrap.dedent(body), Section), "  ")
    write_text(PARAMETERS_FILE, f"{changed}\n\n# {name} {begun}; {keys}/params.md\n{name}:\n{body}")
    return [
        f"{file}: bodies, joints, drives; describe your machine here (docs/machine_file.md)",
        f"{PARAMETERS_FILE}: section {name}; grid, payloads and targets within its limits "
        "(docs/params.md)",
        f"then `flexik check {name}` and `flexik run {name}`",
    ]


def check(name: str) -> list[str]:
    """Find what is wrong with the machine `name`, and draw it.

    Returns what it is, a line each; raises ParameterError, one line a mistake.
    """
    section = cases.load(name)
    machine = section.machine
    if not isinstance(machine, PlanarMachine):
        raise ParameterError(f"{section.machine_file}: describes no planar flexible machine")
    cases.check(section)
    manipulator = manipulator_of(machine)
    share = np.random.default_rng(0).random((N_TIPS, len(machine.drives)))
    tips = manipulator.forward(manipulator.lower + share * (manipulator.upper - manipulator.lower))
    low, high = tips.min(axis=0), tips.max(axis=0)
    reach = " m, ".join(f"{n} {a:.2f} to {b:.2f}" for n, a, b in zip("xy", low, high, strict=True))
    lines = [*_totals(machine), f"reach: {reach} m", *_targets(section)]
    constants = section.data / "constants/constants.json"
    if machine.free and not constants.is_file():
        return [*lines, f"not drawn: {', '.join(machine.free)} are fitted by `flexik run {name}`"]
    middle = (manipulator.lower + manipulator.upper) / 2
    solved = flexible(machine, constants if machine.free else None)
    shape = drawn(solved, middle, section.largest_payload)
    drawing, path = picture(machine, shape, tips), DATA / name / "check.png"
    write_png(path, drawing.func, *drawing.args, **drawing.keywords)
    loaded = f"in the middle of all limits {moved(shape)}"
    return [*lines, loaded, f"drawn: {path}"]


def run(name: str) -> int:
    """Run the case `name` through DVC, and say where its report is; the exit status."""
    section = cases.load(name)
    cases.check(section)
    # quiet: DVC warns of every empty folder, as of constants where none is fitted
    command = [sys.executable, "-m", "dvc", "repro", f"report@{name}"]
    status = subprocess.run([*command, "--quiet"]).returncode
    if status:
        print(f"not done; `dvc repro report@{name}` tells more", file=sys.stderr)
    else:
        print(f"report: {section.report / 'README.md'}")
    return status


def _targets(section: PlanarSection) -> list[str]:
    """How much of the areas of random targets is reached."""
    return [
        f"conditions.{name}: the rigid machine reaches {share_reached(section, given):.0%} of "
        "x, y; targets are drawn from that share"
        for name, given in section.conditions.items()
        if isinstance(given, RandomTargets)
    ]


def _totals(machine: PlanarMachine) -> list[str]:
    masses = machine.masses().values()
    drives = [
        f"{name} ({drive.kind}, {drive.limits[0]:g} to {drive.limits[1]:g} "
        f"{'rad' if drive.kind == 'revolute' else 'm'})"
        for name, drive in machine.drives.items()
    ]
    return [
        f"{machine.title}: {len(machine.bodies)} bodies, of which {len(machine.beams)} bend; "
        f"{sum(mass for _, _, mass in masses):.1f} kg",
        f"drives, as many as degrees of freedom: {', '.join(drives)}",
        f"free constants: {', '.join(machine.free) or 'none'}",
    ]
