"""Studies of the measured crane as parts."""

from typing import Any

from flexik.cases.crane.parts.crane import DATA, model_inputs
from flexik.cases.crane.parts.measured import adaptation, budget, campaign, identified
from flexik.cases.crane.section import Section
from flexik.datasets.parts import Part

CAMPAIGN = DATA / "studies/measured/campaign.parquet"


def measured_parts(section: Section) -> list[Part]:
    """`measured/campaign`, `measured/budget`, `measured/identified` and `measured/adaptation`."""
    measured, machine = section.studies.measured, section.machine
    # what stands in for a crane does not hang on whether there is one
    built = measured.campaign.model_copy(update={"file": None})
    model = model_inputs(section)
    method, adapted = (section.methods[name] for name in measured.methods.values())
    networks = {
        name: DATA / f"networks/{section.methods[name].network}.json"
        for name in reversed(measured.methods.values())
    }
    compensated = {"machine": machine, "campaign": built, "method": method}
    inputs = model | {"network": networks[measured.campaign.method]}
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
        "methods": {name: section.methods[name] for name in networks},
    }
    other = model | {"network": networks[measured.adaptation.method], "campaign": CAMPAIGN}
    return [
        made,
        Part("measured/budget", budget.prepare, compensated | {"budget": measured.budget}, inputs),
        Part("measured/identified", identified.prepare, learning, other),
        Part("measured/adaptation", adaptation.prepare, judging, model | {"networks": networks}),
    ]
