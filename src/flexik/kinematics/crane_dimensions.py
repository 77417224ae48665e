"""The dimensions of the crane by name, and a crane that differs in them."""

from dataclasses import replace

from flexik.kinematics.crane import Array, CraneGeometry

VECTORS = (
    *("lift_pivot", "lift_cylinder_base", "lift_cylinder_head", "jib_pivot"),
    *("rocker_pivot", "jib_cylinder_base", "coupler_pin", "extension_start"),
)
LENGTHS = ("lift_cylinder_length", "jib_cylinder_length", "rocker_length", "coupler_length")
DIMENSIONS = (*(f"{name}_{axis}" for name in VECTORS for axis in "xy"), *LENGTHS)


def corrected(geometry: CraneGeometry, offsets: Array) -> CraneGeometry:
    """`geometry` with the `offsets` (20,) of DIMENSIONS, in m, added."""
    vectors = offsets[: 2 * len(VECTORS)].reshape(-1, 2).tolist()
    changed: dict = {}
    for name, (x, y) in zip(VECTORS, vectors, strict=True):
        nominal = getattr(geometry, name)
        changed[name] = (nominal[0] + x, nominal[1] + y)
    for name, offset in zip(LENGTHS, offsets[2 * len(VECTORS) :].tolist(), strict=True):
        changed[name] = getattr(geometry, name) + offset
    return replace(geometry, **changed)
