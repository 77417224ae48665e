"""The readings of the experiment: poses, payloads, what the model has there, and their division."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexik.cases.elastic_arm.section import DegreeAxis, Samples
from flexik.datasets.tables import Field
from flexik.kinematics.elastic_arm import DEFORMATION

Array = NDArray[np.float64]

TRAINING, SELECTION, HELD_OUT = "training", "selection", "held_out"
ANGLES = ("theta_1", "theta_2")


def deformation_fields(source: str) -> tuple[Field, ...]:
    """Fields of DEFORMATION, told by `source`."""
    meanings = 2 * ("deflection across", "displacement along", "rotation of")
    return tuple(
        Field(name, "rad" if "phi" in name else "m", f"{of} the end of link {name[-1]}, {source}")
        for name, of in zip(DEFORMATION, meanings, strict=True)
    )


PAYLOAD = Field("payload", "kg", "point mass at the tip")
# What methods are asked for
QUERY = (
    Field("target_x", "m", "target, forward"),
    Field("target_y", "m", "target, upward"),
    PAYLOAD,
)
FIELDS = (
    Field("theta_1", "rad", "angle of joint 1"),
    Field("theta_2", "rad", "angle of joint 2"),
    PAYLOAD,
    Field("part", "1", "training, selection or held_out", "string"),
    Field("rigid_x", "m", "tip of the rigid arm, forward"),
    Field("rigid_y", "m", "tip of the rigid arm, upward"),
    Field("tip_x", "m", "tip of the flexible model, forward"),
    Field("tip_y", "m", "tip of the flexible model, upward"),
    *deformation_fields("by the model"),
    Field("station_deflection_1", "m", "deflection at gauge 3 of link 1"),
    Field("station_deflection_2", "m", "deflection at gauge 3 of link 2"),
    Field("axial_strain_1", "1", "at the pair of gauges of link 1"),
    Field("axial_strain_2", "1", "at the pair of gauges of link 2"),
)


def degree_axis(axis: DegreeAxis) -> Array:
    """Angles (k,) in rad, both ends included."""
    return np.radians(np.linspace(axis.minimum, axis.maximum, axis.n_values))


def poses(samples: Samples) -> tuple[Array, Array]:
    """Angles (n, 2) in rad and payload (n,) in kg of all readings.

    As in the experiment: theta_2 runs first, then theta_1, then the payload.
    """
    payload, theta_1, theta_2 = np.meshgrid(
        samples.payloads,
        degree_axis(samples.theta_1_degrees),
        degree_axis(samples.theta_2_degrees),
        indexing="ij",
    )
    return np.column_stack([theta_1.ravel(), theta_2.ravel()]), payload.ravel()


def divide(n: int, selection_share: float, held_out_share: float, seed: int) -> NDArray[np.str_]:
    """Part (n,) of every reading: shares drawn at random, rounded to whole readings."""
    order = np.random.default_rng(seed).permutation(n)
    n_held_out, n_selection = round(held_out_share * n), round(selection_share * n)
    part = np.full(n, TRAINING, dtype="<U9")
    part[order[:n_held_out]] = HELD_OUT
    part[order[n_held_out : n_held_out + n_selection]] = SELECTION
    return part


def columns_of(arrays: Sequence[NDArray], fields: Sequence[Field]) -> Mapping[str, NDArray]:
    """Columns by name of `arrays`, each (n,) or (n, k), in the order of `fields`."""
    flat = [column for array in arrays for column in (array.T if array.ndim == 2 else [array])]
    return {field.name: column for field, column in zip(fields, flat, strict=True)}
