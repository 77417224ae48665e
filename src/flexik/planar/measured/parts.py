"""Studies of the measured machine as parts."""

from typing import Any

from flexik.datasets.parts import Part
from flexik.planar.constants import model_inputs
from flexik.planar.measured import adaptation, budget, campaign, identified
from flexik.planar.measured.section import Measured
from flexik.planar.methods import method_inputs, method_settings
from flexik.planar.section import PlanarSection


def measured_parts(section: PlanarSection, measured: Measured) -> list[Part]:
    """`measured/campaign`, `measured/identified`, `measured/adaptation` and `measured/budget`."""
    machine = section.machine
    # what stands in for a machine does not hang on whether there is one
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
    # the one that is adapted comes first
    judged = list(dict.fromkeys([*reversed(names.values()), *measured.adaptation.others]))
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
        "methods": {name: method_settings(section, name) for name in judged},
    }
    read = {name: method_inputs(section, name) for name in judged}
    other = model | {
        "network": trained_in / f"{adapted.network}.json",
        "campaign": section.data / "studies/measured/campaign.parquet",
    }
    found = [
        made,
        Part("measured/identified", identified.prepare, learning, other),
        Part("measured/adaptation", adaptation.prepare, judging, model | {"built_from": read}),
    ]
    if measured.budget is not None:
        every = inputs | ({} if restarts is None else {"restarts": restarts})
        of_budget = compensated | {"budget": measured.budget}
        found.append(Part("measured/budget", budget.prepare, of_budget, every))
    return found
