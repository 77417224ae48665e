"""The SmartEE of params.yaml with sets of a few poses."""

from pathlib import Path

from flexik.parameters import SmartEE, overlay, read_yaml

ROOT = Path(__file__).parents[1]


def section() -> dict:
    return read_yaml(ROOT / "params.yaml")["smartee"]


def small(**changes) -> SmartEE:
    sizes = {name: {"n_poses": 12} for name in section()["poses"]}
    base = overlay(section(), {"poses": sizes, "outside": {"n_poses": 300}})
    return SmartEE.model_validate(overlay(base, changes))
