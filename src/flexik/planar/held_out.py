"""Errors of networks on samples that they never saw: where they put the tip, and where it was."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from flexik.datasets.parts import Part, Work, Writer, table, whole
from flexik.datasets.tables import Field, read_table
from flexik.machines.planar import PlanarMachine
from flexik.planar.fields import PAYLOAD, inputs, sample_fields
from flexik.planar.section import PlanarSection

FIELDS = (PAYLOAD, Field("error", "m", "distance of the predicted tip from that of the sample"))


def parts(section: PlanarSection) -> list[Part]:
    """`held_out/NETWORK` for every network of a tip, a deflection or a correction."""
    shared = {"machine": section.machine}
    samples = section.data / "samples/held_out.parquet"
    return [
        Part(
            f"held_out/{name}",
            prepare,
            {
                **shared,
                "deflects": network.learns == "deflection",
                "load": section.load_of(name),
            },
            {"samples": samples, "network": section.file_of(name)},
        )
        for name, network in section.networks.items()
        if network.learns in ("deflection", "tip", None)
    ]


def prepare(
    *,
    machine: PlanarMachine,
    deflects: bool,
    load: Callable[[Path], Any],
    samples: Path,
    network: Path,
) -> Work:
    """A table of FIELDS."""
    given = {"machine": machine, "deflects": deflects, "load": load}
    return whole(_errors, **given, samples=samples, network=network)


def _errors(
    machine: PlanarMachine,
    deflects: bool,
    load: Callable[[Path], Any],
    samples: Path,
    network: Path,
) -> dict[str, Writer]:
    frame = read_table(samples, sample_fields(machine))
    found = load(network)[0][0].predict(frame[inputs(machine)].to_numpy())
    if deflects:
        found = found + frame[["rigid_x", "rigid_y"]].to_numpy()
    error = np.hypot(*(found - frame[["tip_x", "tip_y"]].to_numpy()).T)
    print(f"{network.stem}: mean error {1e3 * error.mean():.3g} mm of {len(error)} held out")
    return {".parquet": table({"payload": frame["payload"].to_numpy(), "error": error}, FIELDS)}
