"""The SmartEE of params.yaml with sets of a few poses."""

from pathlib import Path

from flexik.cases.smartee.section import Section
from flexik.parameters.reading import overlay, read_yaml

ROOT = Path(__file__).parents[1]


def section() -> dict:
    given = read_yaml(ROOT / "params.yaml")
    machine = read_yaml(ROOT / "data/machines/smartee.yaml")
    names = {"name": "smartee", "code": "smartee"}
    return given["smartee"] | names | {"trainers": given["trainers"], "machine": machine}


def small(**changes) -> Section:
    few = {name: {"n_poses": 12} for name in ("training", "dense", "selection")}
    conditions = {"validation": 12, "random": 12, "outside": 300}
    counts = {name: {"n_poses": n} for name, n in conditions.items()}
    base = overlay(section(), {"samples": {"poses": few}, "conditions": counts})
    return Section.model_validate(overlay(base, changes))
