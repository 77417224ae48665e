"""Poses of the SmartEE to learn from and to judge by."""

from typing import Any

from flexik.cases.smartee.parts.poses import FIELDS, table
from flexik.cases.smartee.section import Box, Machine, Poses, Section
from flexik.datasets import parts as engine
from flexik.datasets.parts import Part, Work, Writer, whole


def parts(section: Section) -> list[Part]:
    """A part a set of poses, of the samples and of the conditions."""
    shared = {"machine": section.machine, "box": section.samples.box, "case": section.name}
    return [
        Part(key.rpartition(".")[2], prepare, {**shared, "poses": poses, "key": key})
        for key, poses in section.sets.items()
    ]


def prepare(**settings: Any) -> Work:
    """Draw the poses and compute their joint angles."""
    return whole(draw, **settings)


def draw(machine: Machine, box: Box, case: str, poses: Poses, key: str) -> dict[str, Writer]:
    """The file of a set of poses."""
    columns = table(machine, box, poses, f"{case}.{key}")
    print(f"{key.rpartition('.')[2]}: {len(columns['pose'])} rows")
    return {".parquet": engine.table(columns, FIELDS)}
