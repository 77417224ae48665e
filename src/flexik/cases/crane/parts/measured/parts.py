"""Studies of the measured crane as parts."""

from typing import Any

from flexik.cases.crane.parts.measured import adaptation, budget, campaign, identified
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part
from flexik.planar.constants import model_inputs
from flexik.planar.methods import method_settings


def measured_parts(section: Section) -> list[Part]:
    """`measured/campaign`, `measured/budget`, `measured/identified` and `measured/adaptation`."""
    measured, machine = section.studies.measured, section.machine
    # what stands in for a crane does not hang on whether there is one
    built = measured.campaign.model_copy(update={"file": None})
    model, trained_in = model_inputs(section), section.data / "networks"
    names = measured.methods
    methods = {name: method_settings(section, name)["method"] for name in names.values()}
    adapted, method = methods[names["adaptation"]], methods[names["campaign"]]
    trained = trained_in / f"{method.network}.json"
    # a genetic algorithm takes too long to be asked again with every network
    restarts = None if method.genetic else trained.with_suffix(".restarts.json")
    compensated = {"machine": machine, "campaign": built, "method": method}
    inputs = model | {"network": trained}
    made = Part("measured/campaign", campaign.prepare, compensated, inputs)
    if measured.campaign.file is not None:
        file = {"file": measured.campaign.file}
        made = Part("measured/campaign", campaign.prepare_own, {"machine": machine}, file)
    learning: dict[str, Any] = {
        "machine": machine,
        "method": adapted,
        "expected": measured.adaptation.expected,
        "n_corrections": measured.adaptation.n_corrections,
    }
    judging = {
        "machine": machine,
        "campaign": built,
        "adaptation": measured.adaptation,
        # the one that is adapted comes first
        "methods": {name: methods[name] for name in reversed(names.values())},
    }
    networks = {name: trained_in / f"{given.network}.json" for name, given in methods.items()}
    other = model | {
        "network": networks[names["adaptation"]],
        "campaign": section.data / "studies/measured/campaign.parquet",
    }
    every = inputs | ({} if restarts is None else {"restarts": restarts})
    return [
        made,
        Part("measured/budget", budget.prepare, compensated | {"budget": measured.budget}, every),
        Part("measured/identified", identified.prepare, learning, other),
        Part("measured/adaptation", adaptation.prepare, judging, model | {"networks": networks}),
    ]
