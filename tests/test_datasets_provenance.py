"""Checksums: which parameters make which data."""

from pathlib import Path

import numpy as np
import pytest

from flexik.datasets.crane.provenance import (
    adaptation_checksum,
    budget_checksum,
    campaign_checksum,
    evaluation_checksum,
    fitting_checksum,
    grid_checksum,
    identification_checksum,
    network_checksum,
    selection_checksum,
    targets_checksum,
    tolerance_checksum,
    workspace_checksum,
)
from flexik.errors import ParameterError
from flexik.parameters import read_yaml, validate

ROOT = Path(__file__).parents[1]
SPRING = 8e6  # N m/rad

# Keys of params.yaml changed one at a time, and the checksums each must change
GRID, SELECTION, TARGETS = "grid", "selection", "targets"
FITTING, TOLERANCES, NONE = "fitting", "tolerances", "none"
CAMPAIGN, BUDGET, IDENTIFIED, ADAPTED = "campaign", "budget", "identified", "adapted"
MEASURED = {CAMPAIGN, BUDGET, IDENTIFIED, ADAPTED}
FIXED = {f"network {name}" for name in ("deflection", "direct", "rigid", "inverse", "modular")}
CHOSEN = {f"{name}_selected" for name in FIXED}


def raw():
    return read_yaml(ROOT / "params.yaml")


# Network of each method
BUILT_FROM = {label: method["network"] for label, method in raw()["crane"]["methods"].items()}


SECTIONS = [section for section in raw()["crane"] if section.endswith("networks")]


def users(trainer):
    """Networks that are trained or studied with `trainer`."""
    networks = {name: n for section in SECTIONS for name, n in raw()["crane"][section].items()}
    return [
        name
        for name, network in networks.items()
        if trainer in (network["trainer"], network.get("select", network)["trainer"])
    ]


def judged(*labels):
    """What two checksums stand for: the test conditions and the workspace."""
    found = {f"{place} {label}" for place in ("evaluation", "workspace") for label in labels}
    if "combined" in labels:
        found |= MEASURED
    if "combined_selected" in labels:  # what is adapted
        found |= {IDENTIFIED, ADAPTED}
    return found


def trained(*names):
    """These networks, and what is done with them."""
    after = judged(*(label for label, name in BUILT_FROM.items() if name in names))
    studied = {TOLERANCES} if {"direct", "modular"} & set(names) else set()
    return {f"network {name}" for name in names} | after | studied


NETWORKS = FIXED | CHOSEN
METHODS = judged(*BUILT_FROM)
EVALUATIONS = {name for name in METHODS | judged(NONE) if name.startswith("evaluation ")}
WORKSPACES = (METHODS | judged(NONE)) - EVALUATIONS - MEASURED
STUDIES = {FITTING, TOLERANCES}
EVERYTHING = {GRID, SELECTION, TARGETS} | MEASURED | NETWORKS | EVALUATIONS | WORKSPACES | STUDIES
COVERED = {
    "geometry.rocker_length": EVERYTHING,
    "structure.gravity": EVERYTHING,
    "structure.beams.jib.n_elements": EVERYTHING,
    "grid.lift.increment": {GRID} | NETWORKS | METHODS | STUDIES,
    "grid.minimum_tip_x": EVERYTHING - {"evaluation none"},
    "selection.seed": {SELECTION} | NETWORKS | METHODS | {TOLERANCES},
    "trainers.levenberg_marquardt.mu": trained(*users("levenberg_marquardt")),
    "trainers.accelerated.mu": trained(*users("accelerated")),
    "trainers.study.mu": {FITTING} | trained(*users("study")),
    "networks.deflection.n_hidden": trained("deflection"),
    "networks.direct.seed": trained("direct"),
    "networks.rigid.n_hidden": trained("rigid", "modular"),
    "networks.inverse.n_restarts": trained("inverse"),
    "modular_networks.modular.n_hidden": trained("modular"),
    "selected_networks.deflection_selected.seed": trained("deflection_selected"),
    "selected_networks.deflection_selected.select.n_hidden.maximum": trained("deflection_selected"),
    "selected_networks.rigid_selected.select.n_restarts": trained(
        "rigid_selected", "modular_selected"
    ),
    "selected_modular_networks.modular_selected.seed": trained("modular_selected"),
    "fitting.seed": {FITTING},
    "evaluation.payloads.0": EVALUATIONS | {TOLERANCES},
    "workspace.seed": WORKSPACES | {TARGETS},
    "workspace.n_targets": WORKSPACES | {TARGETS},
    "methods.combined.n_corrections": judged("combined"),
    "methods.combined_ga.n_corrections": judged("combined_ga"),
    "methods.combined_ga.genetic.seed": judged("combined_ga"),
    "methods.direct.inversion.learning_rate": judged("direct") | {TOLERANCES},
    "methods.modular_gauss_newton.inversion.damping": judged("modular_gauss_newton"),
    "tolerance_study.tolerances.1": {TOLERANCES},
    "measured.seed": {CAMPAIGN, BUDGET, IDENTIFIED},
    "measured.payloads.2": {CAMPAIGN, BUDGET, IDENTIFIED},
    "measured.noise": MEASURED,
    "measured.deviations.play": MEASURED,
    "measured.budget.n_cranes": {BUDGET},
    "measured.adaptation.n_targets": {ADAPTED},
    "measured.adaptation.n_corrections": {IDENTIFIED, ADAPTED},
    "measured.adaptation.expected.play": {IDENTIFIED, ADAPTED},
    "calibration.stiffness_range.0": set(),
    "mesh_study.seed": set(),
    "illustration.payload": set(),
}


def checksums(data, spring=SPRING):
    crane = validate(data).crane
    of_labels = {"evaluation": evaluation_checksum, "workspace": workspace_checksum}
    return {
        GRID: grid_checksum(crane, spring),
        SELECTION: selection_checksum(crane, spring),
        TARGETS: targets_checksum(crane, spring),
        FITTING: fitting_checksum(crane, spring),
        TOLERANCES: tolerance_checksum(crane, spring),
        CAMPAIGN: campaign_checksum(crane, spring),
        BUDGET: budget_checksum(crane, spring),
        IDENTIFIED: identification_checksum(crane, spring),
        ADAPTED: adaptation_checksum(crane, spring),
        **{f"network {name}": network_checksum(crane, spring, name) for name in crane.all_networks},
        **{
            f"{place} {label}": made_with(crane, spring, label)
            for place, made_with in of_labels.items()
            for label in (NONE, *crane.methods)
        },
    }


@pytest.mark.parametrize("key", COVERED)
def test_checksums_change_exactly_with_what_they_cover(key):
    data = raw()
    before = checksums(data)
    assert set(before) == EVERYTHING
    *path, last = key.split(".")
    section = data["crane"]
    for name in path:
        section = section[name]
    last = int(last) if isinstance(section, list) else last
    section[last] = section[last] * 2 if last != "increment" else section[last] / 2
    if key == "grid.minimum_tip_x":
        section[last] = 0.5
    after = checksums(data)
    assert {name for name in after if after[name] != before[name]} == COVERED[key]


def test_every_section_of_the_crane_is_covered_or_stands_apart():
    assert {key.partition(".")[0] for key in COVERED} == set(raw()["crane"])


def test_all_checksums_cover_the_spring_and_differ():
    before, after = checksums(raw()), checksums(raw(), np.nextafter(SPRING, 0))
    assert all(before[name] != after[name] for name in before)
    assert len(set(before.values())) == len(before)


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("networks.inverse.trainer", "study", trained("inverse")),
        ("networks.rigid.trainer", "study", trained("rigid", "modular")),
        ("modular_networks.modular.rigid", "rigid_selected", trained("modular")),
        (
            "selected_networks.direct_selected.select.trainer",
            "accelerated",
            trained("direct_selected"),
        ),
        ("methods.direct.network", "direct_selected", judged("direct") | {TOLERANCES}),
        ("fitting.trainer", "accelerated", {FITTING}),
        ("tolerance_study.methods", ["direct_selected"], {TOLERANCES}),
    ],
)
def test_checksums_change_with_the_names_they_follow(key, value, expected):
    data = raw()
    before = checksums(data)
    *path, last = key.split(".")
    section = data["crane"]
    for name in path:
        section = section[name]
    section[last] = value
    after = checksums(data)
    assert {name for name in after if after[name] != before[name]} == expected


def test_the_tolerance_study_follows_the_methods_it_has():
    data = raw()
    data["crane"]["tolerance_study"]["methods"] = ["direct_selected"]
    before = checksums(data)
    data["crane"]["networks"]["direct"]["seed"] += 1
    assert checksums(data)[TOLERANCES] == before[TOLERANCES]
    data["crane"]["selected_networks"]["direct_selected"]["seed"] += 1
    assert checksums(data)[TOLERANCES] != before[TOLERANCES]


def test_a_network_that_is_not_there_is_told():
    with pytest.raises(ParameterError, match=r"no network 'other' \(deflection, direct, "):
        network_checksum(validate(raw()).crane, SPRING, "other")


def test_the_order_of_keys_does_not_matter():
    data = raw()
    data["crane"] = dict(reversed(data["crane"].items()))
    data["crane"]["grid"] = dict(reversed(data["crane"]["grid"].items()))
    assert checksums(data) == checksums(raw())
