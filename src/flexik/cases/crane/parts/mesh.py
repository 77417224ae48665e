"""Study `mesh`: how far tip deflections depend on mesh and element."""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexik.cases.crane.parts.crane import FlexibleCrane, flexible
from flexik.cases.crane.section import MeshStudy, Section
from flexik.datasets.parts import Part, Work, Writer, table
from flexik.datasets.tables import Field
from flexik.errors import ParameterError
from flexik.kinematics.crane import forward
from flexik.machines.planar import PlanarMachine
from flexik.multibody.elements import ELEMENTS
from flexik.multibody.planar import tips
from flexik.planar.constants import model_inputs
from flexik.planar.samples import Samples, random_samples

FIELDS = (
    Field("n_samples", "1", "random strokes and payloads", "int64"),
    Field("element", "1", "one of multibody.elements.ELEMENTS", "string"),
    Field("refinement", "1", "every beam is cut into so many times its elements", "int64"),
    Field("mean_difference", "m", "of the tip, from the finest mesh"),
    Field("max_difference", "m", "of the tip, from the finest mesh"),
    Field("mean_relative", "1", "relative to the length of the deflection of each sample"),
    Field("max_relative", "1", "relative to the length of the deflection of each sample"),
)


def part(section: Section) -> Part:
    """A row for every refinement of every element that the axes of the machine allow."""
    settings = {
        "machine": section.machine,
        "study": section.studies.mesh,
        "payload": section.samples.selection.payload,
        "minimum_tip_x": section.samples.minimum_tip_x,
    }
    return Part("mesh", prepare, settings, model_inputs(section))


def prepare(
    *,
    machine: PlanarMachine,
    study: MeshStudy,
    payload: tuple[float, float],
    minimum_tip_x: float,
    constants: Path,
    sections: dict[str, Path],
) -> Work:
    """Tips of every variant; the last refinement of the machine's own element is the reference."""
    crane = flexible(machine, constants)
    samples = random_samples(machine, study.n_samples, payload, minimum_tip_x, study.seed)
    variants: list[tuple[str, int]] = [(machine.element, study.refinements[-1])]
    variants += [(element, n) for element in _possible(crane) for n in study.refinements]
    rigid = forward(crane.geometry, samples.values)

    def finish(results: list[Mapping[str, NDArray]]) -> Mapping[str, Writer]:
        reference, *others = (result["tip"] for result in results)
        deflection = np.linalg.norm(reference - rigid, axis=1)
        rows = []
        for (element, refinement), tip in zip(variants[1:], others, strict=True):
            difference = np.linalg.norm(tip - reference, axis=1)
            measures = [
                f(x) for x in (difference, difference / deflection) for f in (_mean, np.max)
            ]
            rows.append((study.n_samples, element, refinement, *measures))
        columns = zip(FIELDS, zip(*rows, strict=True), strict=True)
        return {".parquet": table({field.name: np.array(c) for field, c in columns}, FIELDS)}

    return Work(functools.partial(_tips, crane, samples), variants, finish)


def _tips(
    crane: FlexibleCrane, samples: Samples, variant: tuple[str, int]
) -> dict[str, NDArray[np.float64]]:
    machine = crane.machine.with_constants({"element": variant[0]})
    other = replace(crane, machine=machine, refinement=variant[1])
    return {"tip": tips(other, samples.values, samples.payload)}


def _possible(crane: FlexibleCrane) -> list[str]:
    """The ELEMENTS that the machine's axes allow; tells which they do not, and why."""
    found = []
    for element in ELEMENTS:
        try:
            replace(crane, machine=crane.machine.with_constants({"element": element}))
            found.append(element)
        except ParameterError as error:
            print(f"mesh study without {element}: {error}")
    return found


def _mean(values: NDArray[np.float64]) -> float:
    return float(values.mean())
