"""Measuring on a machine as built: it is drawn, approached and measured."""

from collections.abc import Hashable, Mapping
from typing import TypeVar

import numpy as np

from flexik.machines.deviations import Magnitudes
from flexik.multibody.as_built import AsBuilt, actual_strokes, draw_twin, settled_tips
from flexik.multibody.flexible import FlexibleMachine
from flexik.positioning.method import Array

Generator = np.random.Generator
Name = TypeVar("Name", bound=Hashable)


def twin_and_generator(
    nominal: FlexibleMachine, magnitudes: Magnitudes, seed: int
) -> tuple[AsBuilt, Generator]:
    """The machine that `seed` draws around the `nominal` one, and what draws its approaches."""
    return draw_twin(nominal, magnitudes, seed), np.random.default_rng((seed, 1))


def measured_tips(
    twin: AsBuilt,
    strokes: Mapping[Name, Array],
    payload: Array,
    noise: float | None,
    generator: Generator,
) -> dict[Name, Array]:
    """Measured tips (n, 2) in m by method, at commanded `strokes` (n, k) by method.

    payload : (n,) in kg.
    noise : standard deviation of a measured coordinate, m; None: the tips themselves.
    """
    actual, error = {}, {}
    for name, commanded in strokes.items():
        actual[name] = actual_strokes(twin, commanded, generator)
        error[name] = 0.0 if noise is None else noise * generator.standard_normal((len(payload), 2))
    # together, so that rows of all methods share systems
    tips = settled_tips(twin, np.concatenate(list(actual.values())), np.tile(payload, len(actual)))
    return {
        name: tip + error[name]
        for name, tip in zip(strokes, np.split(tips, len(actual)), strict=True)
    }
