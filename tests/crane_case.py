"""The crane as the project describes it, on a spring of its own."""

import contextlib
import functools
from dataclasses import replace
from pathlib import Path

import pandas as pd

from flexik.cases.case import load
from flexik.cases.crane.parts.crane import FlexibleCrane
from flexik.cases.crane.section import SPRING as SPRING_KEY
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.machines.deviations import Magnitudes
from flexik.planar.fields import inputs, sample_fields, target_fields
from flexik.planar.learning import kind_of

ROOT = Path(__file__).parents[1]
SPRING = 8e6  # N m/rad


@functools.cache
def section():
    """Section `crane` of params.yaml."""
    with contextlib.chdir(ROOT):
        return load("crane")


@functools.cache
def crane(stiffness=SPRING):
    """The flexible crane."""
    with contextlib.chdir(ROOT):  # sections are named relative to the project
        found = FlexibleCrane(section().machine.with_constants({SPRING_KEY: stiffness}))
        found.beams  # noqa: B018  they are read
        return found


def upright(crane, element):
    """`crane` of other elements, its pillar upright: the axes of some must be straight."""
    straight = {"axis": ((0.0, -0.311), (0.0, 1.115)), "mass_span": (0.03, 1.115)}
    changes = {f"bodies.pillar.{key}": value for key, value in straight.items()}
    machine = crane.machine.with_constants({"element": element} | changes)
    return replace(crane, machine=machine)


def samples(columns):
    """Table of samples with the `columns` of SAMPLE_FIELDS."""
    return pd.DataFrame({f.name: column for f, column in zip(SAMPLE_FIELDS, columns, strict=True)})


MANIPULATOR = CraneManipulator(section().geometry)
MACHINE = section().machine
SAMPLE_FIELDS, TARGET_FIELDS = sample_fields(MACHINE), target_fields(MACHINE)
INPUTS = inputs(MACHINE)
NAMES = ("deflection", "tip", "rigid_tip", "correction", "coordinates")
KINDS = {name: kind_of(MACHINE, name) for name in NAMES}


SIZES = (
    *("pivot", "length", "play", "play_spread", "stroke_offset"),
    *("repeatability", "section", "spring"),
)


def magnitudes(*sizes):
    """How far a crane may be off, whatever the sizes."""
    given = dict(zip(SIZES, sizes, strict=True))
    return Magnitudes.model_construct(**given, angle_offset=0.0, angle_repeatability=0.0)
