"""Planar machines for tests: those of data/machines, and small ones made here."""

import functools
from pathlib import Path

from flexik.kinematics.planar import PlanarManipulator
from flexik.machines.planar import PlanarMachine, read_machine

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "data/machines"
NAMES = ["concrete_pump", "crane", "elastic_arm", "excavator"]
FILES = {name: FOLDER / f"{name}.yaml" for name in NAMES}


@functools.cache
def general(name):
    """The general manipulator of a machine of data/machines."""
    return PlanarManipulator(read_machine(FILES[name]))


def rigid(angle=0.0, **points):
    """A rigid body of 1 kg."""
    return {
        "kind": "rigid",
        "points": points,
        "angle": angle,
        "mass": 1.0,
        "centre": [0.0, 0.0],
    }


def pin(*of):
    return {"kind": "pin", "of": list(of)}


def machine(ground, bodies, joints, drives, payload, **more):
    """A machine of these parts."""
    return PlanarMachine.model_validate(
        {
            "title": "a machine",
            "gravity": 9.81,
            "ground": ground,
            "bodies": bodies,
            "joints": joints,
            "drives": drives,
            "payload": payload,
            **more,
        }
    )


def serial(n, length=1.0):
    """An arm of `n` revolute drives."""
    bodies = {f"arm_{k}": rigid(a=[0, 0], b=[length, 0]) for k in range(n)}
    ends = ["ground.a", *(f"arm_{k}.b" for k in range(n))]
    joints = {f"joint_{k}": pin(ends[k], f"arm_{k}.a") for k in range(n)}
    drives = {
        f"drive_{k}": {"kind": "revolute", "joint": f"joint_{k}", "limits": [-1.0, 1.5]}
        for k in range(n)
    }
    return machine({"a": [0, 0]}, bodies, joints, drives, ends[-1])


def four_bar(
    crank=0.3, coupler=1.0, rocker=0.8, base=1.0, limits=(-3.0, 3.0), angles=(0.8, 1.4), **more
):
    """A crank turned by a drive, a coupler that carries the payload at a side, and a rocker."""
    return machine(
        {"a": [0, 0], "d": [base, 0]},
        {
            "crank": rigid(a=[0, 0], b=[crank, 0]),
            "coupler": rigid(angles[0], b=[0, 0], c=[coupler, 0], tip=[coupler / 2, 0.4]),
            "rocker": rigid(angles[1], d=[0, 0], c=[rocker, 0]),
            **more.get("bodies", {}),
        },
        {
            "a": pin("ground.a", "crank.a"),
            "b": pin("crank.b", "coupler.b"),
            "c": pin("rocker.c", "coupler.c"),
            "d": pin("ground.d", "rocker.d"),
            **more.get("joints", {}),
        },
        {"turn": {"kind": "revolute", "joint": "a", "limits": list(limits)}},
        "coupler.tip",
    )
