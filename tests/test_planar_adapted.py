"""Adaptation of any machine: derivatives, identification on twins, campaigns of a file."""

import contextlib
import functools

import numpy as np
import pandas as pd
import pytest
from planar_machines import FILES, ROOT, machine, rigid

from flexik.errors import DataError
from flexik.kinematics.loops import Linkage
from flexik.kinematics.machine_file import manipulator_of
from flexik.kinematics.status import REACHED
from flexik.machines.deviations import Expected, Magnitudes
from flexik.machines.planar import read_machine
from flexik.multibody.as_built import as_built_tips, draw_twin
from flexik.multibody.flexible import FlexibleMachine
from flexik.multibody.joint_forces import compliance, joint_forces, springs_of
from flexik.multibody.planar import tips
from flexik.planar.measured.adapted import Adapted, Measurements, Nominal, identify
from flexik.planar.measured.campaign_file import own_campaign
from flexik.planar.measured.nominal import asked
from flexik.planar.measured.offsets import corrected, dimensions_of, offsets_of
from flexik.positioning.combined import Combined

NAMES = ["concrete_pump", "crane", "elastic_arm", "excavator"]


@functools.cache
def flexible(name):
    with contextlib.chdir(ROOT):
        found = read_machine(FILES[name])
        known = FlexibleMachine(found.with_constants(dict.fromkeys(found.free, 8e6)))
        known.beams  # noqa: B018  they are read
        return known


def drawn(linkage, n, seed=0):
    return np.random.default_rng(seed).uniform(
        linkage.lower, linkage.upper, (n, len(linkage.lower))
    )


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_those_of_differences(name):
    nominal, step = flexible(name), 1e-6
    values = drawn(nominal.linkage, 30)
    found = compliance(nominal.machine, nominal.linkage.poses(values), np.full(30, 50.0))
    slopes = np.concatenate([found.point, found.coordinate], axis=2)
    offsets = dimensions_of(nominal.machine, Expected())
    assert slopes.shape == (30, 2, len(offsets))
    for k in range(len(offsets)):
        ahead, behind = (
            Linkage(corrected(nominal.machine, sign * step * np.eye(len(offsets))[k]))
            for sign in (1, -1)
        )
        moved = ahead.tip(ahead.poses(values))[0] - behind.tip(behind.poses(values))[0]
        assert slopes[:, :, k] == pytest.approx(moved / (2 * step), abs=1e-7), offsets[k].name


def test_what_may_be_off_is_read_from_the_file():
    names = [offset.name for offset in offsets_of(flexible("excavator").machine, Expected())]
    assert names == [
        *(f"{p}.{a}" for p in ("ground.boom_pivot", "boom.stick_pivot") for a in "xy"),
        *(f"ground.boom_cylinder_base.{a}" for a in "xy"),
        *(f"boom.{p}.{a}" for p in ("boom_cylinder_head", "stick_cylinder_base") for a in "xy"),
        *(f"stick.{p}.{a}" for p in ("stick_cylinder_head", "tip") for a in "xy"),
        *("drives.boom.retracted", "drives.stick.retracted"),
        *("joints.boom_pivot.play", "joints.stick_pivot.play"),
        *("drives.boom.play", "drives.stick.play", "deflection"),
    ]
    of_pump = {o.name: o.unit for o in offsets_of(flexible("concrete_pump").machine, Expected())}
    assert of_pump["drives.theta_3.zero"] == "rad"
    assert list(springs_of(flexible("crane").machine)) == ["joints.slew.springs.torsion"]


def test_springs_give_way_by_the_force_on_them():
    # an arm that stands on springs, turned by a tenth
    springs = {"x": 2e5, "y": 3e5, "torsion": 4e5}
    foot = {"kind": "fixed", "of": ["ground.a", "foot.a"], "springs": springs}
    given = machine(
        {"a": [0, 0]},
        {"foot": rigid(a=[0, 0], b=[0, 1.0]), "arm": rigid(0.3, b=[0, 0], c=[2.0, 0])},
        {"foot": foot, "b": {"kind": "pin", "of": ["foot.b", "arm.b"]}},
        {"turn": {"kind": "revolute", "joint": "b", "limits": [-0.5, 1.0]}},
        "arm.c",
    )
    linkage, payload = Linkage(given), np.array([100.0, 40.0])
    poses = linkage.poses(np.array([[0.1], [0.7]]))
    found = compliance(given, poses, payload).spring
    assert list(springs_of(given)) == [f"joints.foot.springs.{s}" for s in ("torsion", "x", "y")]
    load = -9.81 * payload[:, None] * [0.0, 1.0]
    moment = -joint_forces(given, poses, load)["joints.foot"][:, 2]
    tip = linkage.tip(poses)[0]
    weight = 9.81 * (payload + 2.0)  # the bodies weigh 1 kg each, at the foot's axis
    assert np.abs(moment) == pytest.approx(9.81 * payload * tip[:, 0])
    turned = -9.81 * payload * tip[:, 0] / springs["torsion"]
    expected = turned[:, None] * np.column_stack([-tip[:, 1], tip[:, 0]])
    assert found[:, :, 0] == pytest.approx(expected, rel=1e-9)
    assert found[:, :, 1] == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    assert found[:, :, 2] == pytest.approx(-weight[:, None] / springs["y"] * [0.0, 1.0])


class Exact:
    """Deflection of the flexible model itself; stands for a perfect network."""

    def __init__(self, nominal):
        self.nominal = nominal

    def predict(self, values):
        """Deflection, as a network gives it."""
        linkage, at = self.nominal.linkage, values[:, :-1]
        return tips(self.nominal, at, values[:, -1]) - linkage.tip(linkage.poses(at))[0]


# Standard deviations of what is off, the heaviest payload (kg), and the share the error falls to
TWINS = {
    "excavator": (Magnitudes(pivot=1e-3, length=1e-3, play=2e-4), 2e3, 0.25),
    "concrete_pump": (Magnitudes(pivot=2e-3, play=2e-4), 100.0, 0.3),
}


@pytest.mark.parametrize("name", TWINS)
def test_measurements_of_a_twin_lower_its_error(name):
    sizes, heaviest, share = TWINS[name]
    nominal, errors = flexible(name), []
    shared = sizes.model_dump(exclude={"play_spread"})
    given = Nominal(nominal, Exact(nominal), Expected(**shared, play_deviation=0.3 * sizes.play))
    before = Combined(manipulator_of(nominal.machine), given.network, 4)
    for seed in range(2):
        generator = np.random.default_rng(seed)
        twin = draw_twin(nominal, sizes, seed)
        lower, upper = nominal.linkage.lower, nominal.linkage.upper
        middle = lower + generator.uniform(0.3, 0.7, (27, len(lower))) * (upper - lower)
        targets = manipulator_of(nominal.machine).forward(middle)
        query = np.column_stack([targets, generator.uniform(0.0, heaviest, 27)])
        answer = asked(nominal.machine, before, query)
        assert (answer.status == REACHED).all()
        learnt, judged = slice(0, 12), slice(12, None)
        payload = query[:, 2]
        tip = as_built_tips(twin, answer.values[learnt], payload[learnt], generator)
        tip += generator.normal(0.0, given.expected.measurement, tip.shape)
        offsets = identify(given, Measurements(answer.values[learnt], payload[learnt], tip))
        assert (offsets.deviations <= given.prior.deviations * (1 + 1e-9)).all()
        adapted = asked(nominal.machine, Adapted(given, offsets, 4), query[judged])
        for values in (answer.values[judged], adapted.values):
            reached = as_built_tips(twin, values, payload[judged])
            errors.append(np.linalg.norm(reached - query[judged, :2], axis=1).mean())
    unadapted, after = np.reshape(errors, (2, 2)).mean(axis=0)
    assert unadapted > 4e-3
    assert after < share * unadapted


ROWS = {
    "excavator": (["boom_stroke_m", "stick_stroke_m"], [0.6, 0.8]),
    "concrete_pump": ([f"theta_{k}_angle_rad" for k in (1, 2, 3, 4)], [0.8, -0.5, -0.2, 0.1]),
}


def written(path, name, **changes):
    """A campaign of one measurement where the rigid machine has its tip."""
    columns, values = ROWS[name]
    x, y = manipulator_of(flexible(name).machine).forward(np.array([values]))[0]
    row = dict(zip(columns, values, strict=True))
    row |= {"payload_kg": 100.0, "measured_x_m": x, "measured_y_m": y} | changes
    pd.DataFrame([row]).to_csv(path, index=False)
    return path


@pytest.mark.parametrize("name", ROWS)
def test_a_campaign_has_the_coordinates_of_the_drives(name, tmp_path):
    columns, values = ROWS[name]
    table = own_campaign(written(tmp_path / "own.csv", name), flexible(name).machine)
    names = [column.rpartition("_")[0] for column in columns]
    assert table[names].to_numpy().tolist() == [values]
    assert table["payload"].tolist() == [100.0]


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("excavator", {"boom_stroke_m": 1.9}, "line 2: boom_stroke 1.9 m, expected 0 to 1.26 m"),
        (
            "excavator",
            {"measured_x_m": 4.0},
            "line 2: expected a point within 0.. m of where",
        ),
        ("excavator", {"boom_stroke_mm": 600.0}, "line 1: expected as column 'boom_stroke_m'"),
        ("excavator", {"lift_stroke_m": 0.6}, "line 1: expected as column one of .*boom_stroke_m"),
        ("concrete_pump", {"theta_1_angle_rad": 45.0}, "line 2: .* expected -10 to 10 rad, got 45"),
        ("concrete_pump", {"theta_1_angle_rad": 1.9}, "theta_1_angle 1.9 rad, expected 0.261799 t"),
        ("concrete_pump", {"theta_2_angle_deg": -30.0}, "'theta_2_angle_rad' .its unit in its na"),
    ],
)
def test_bad_campaigns_are_one_line(name, changes, message, tmp_path):
    with pytest.raises(DataError, match=message) as caught:
        own_campaign(written(tmp_path / "own.csv", name, **changes), flexible(name).machine)
    assert str(caught.value).startswith(str(tmp_path / "own.csv"))
    assert "\n" not in str(caught.value)
