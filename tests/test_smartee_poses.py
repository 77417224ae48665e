"""Poses of the SmartEE: the box, the images under leg permutations, and the section's checks."""

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from smartee_case import section, small

from flexik.cases.smartee.parts.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    LEG_PERMUTATIONS,
    POSE_FIELDS,
    actuated_of,
    centre_elbows,
    extent_of,
    geometry_of,
    images,
    inputs_of,
    reached,
    table,
    values,
)
from flexik.cases.smartee.section import Section, check
from flexik.errors import ParameterError
from flexik.kinematics.smartee import (
    closure,
    complete_direct,
    elbow_circles,
    leg_tips,
    rotation_zyz,
)

SMARTEE = small()
GEOMETRY = geometry_of(SMARTEE.machine)


def draw(smartee, name):
    poses = (smartee.samples.poses | smartee.conditions)[name]
    return reached(smartee.machine, smartee.samples.box, poses, name)


def rows(smartee, name):
    poses = (smartee.samples.poses | smartee.conditions)[name]
    return pd.DataFrame(table(smartee.machine, smartee.samples.box, poses, name))


def joints_in(found):
    elbows = values(found, ELBOW_FIELDS)[..., None]
    return np.concatenate([actuated_of(values(found, ACTUATED_FIELDS)), elbows], axis=2)


def closure_error(joints):
    tips = leg_tips(elbow_circles(GEOMETRY, joints[..., :2]), joints[..., 2])
    return np.abs(closure(tips, GEOMETRY.side)).max(axis=-1)


def test_every_row_with_permutations_satisfies_the_closure():
    found = rows(small(samples={"poses": {"training": {"n_poses": 167}}}), "training")
    assert len(found) == 6 * 167 == 1002
    assert closure_error(joints_in(found)).max() < 1e-15
    assert np.bincount(found["pose"]).tolist() == [6] * 167
    assert np.all(values(found, ELBOW_FIELDS) < 0.0)


def test_a_plain_exchange_of_legs_violates_the_closure_by_centimetres():
    _, joints = draw(SMARTEE, "random")
    wrong = []
    for legs, reflected in LEG_PERMUTATIONS:
        plain = closure_error(joints[:, legs, :]) / (2.0 * GEOMETRY.side)
        assert reflected or plain.max() < 1e-14
        wrong += [plain.max()] if reflected else []
    assert min(wrong) > 0.005


def test_images_turn_and_reflect_the_plate():
    """Cyclic ones turn the base by a third of a turn, exchanges reflect it in a vertical plane."""
    poses, joints = draw(SMARTEE, "random")
    for (legs, reflected), image in zip(LEG_PERMUTATIONS, images(joints), strict=True):
        position, _ = complete_direct(GEOMETRY, image[..., :2], image[..., 2])
        # the angle at which image leg 0 finds its origin
        angle = 2.0 * np.pi / 3.0 * legs[0]
        x, y, z = poses[:, :3].T
        c, s = np.cos(angle), np.sin(angle)
        expected = np.column_stack([c * x + s * y, c * y - s * x, z])
        if reflected:
            expected[:, 1] *= -1.0
        np.testing.assert_allclose(position, expected, atol=1e-15)


def test_sets_fill_their_boxes_and_agree_with_their_joints():
    smartee = small(conditions={"random": {"n_poses": 4000}})
    found = rows(smartee, "random")
    poses, joints, box = values(found, POSE_FIELDS), joints_in(found), smartee.samples.box
    half = np.array([*box.half_lengths, *box.half_angles])
    shares = (poses - [*box.centre, 0.0, 0.0, 0.0]) / half
    assert np.abs(shares).max() <= 1.0 and np.all(np.abs(shares).max(axis=0) > 0.99)
    assert np.all(np.abs(shares.mean(axis=0)) < 0.05)
    position, rotation = complete_direct(GEOMETRY, joints[..., :2], joints[..., 2])
    assert np.abs(position - poses[:, :3]).max() < 1e-12
    assert np.abs(rotation - rotation_zyz(poses[:, 3:])).max() < 1e-12


def test_queries_and_joints_are_the_same_angles():
    _, joints = draw(SMARTEE, "random")
    inputs = inputs_of(joints[..., :2])
    assert [field.name for field in ACTUATED_FIELDS][:4] == [
        *("theta1_leg1", "theta1_leg2", "theta1_leg3", "theta2_leg1")
    ]
    np.testing.assert_array_equal(inputs[:, 3], joints[:, 0, 1])
    np.testing.assert_array_equal(actuated_of(inputs), joints[..., :2])


def test_corners_are_those_of_the_box():
    poses, joints = draw(SMARTEE, "corners")
    assert poses.shape == (64, 6) and joints.shape == (64, 3, 3)
    assert len(np.unique(poses.round(9), axis=0)) == 64
    np.testing.assert_allclose(extent_of(SMARTEE.samples.box, poses), 1.0)
    np.testing.assert_allclose(np.abs(poses[:, 3:]), np.radians(10.0), rtol=1e-9)


def test_paths_begin_at_the_centre_and_stay_in_the_box():
    poses, joints = draw(SMARTEE, "path_1000")
    box = SMARTEE.samples.box
    np.testing.assert_allclose(poses[0], [*box.centre, 0, 0, 0], atol=1e-15)
    half = np.array([*box.half_lengths, *box.half_angles])
    assert np.abs(poses - poses[0]).max(axis=0) == pytest.approx(half, rel=1e-2)
    assert np.abs(np.diff(joints, axis=0)).max() < 0.1


def test_outside_poses_have_a_uniform_extent_and_those_beyond_reach_are_left_out():
    smartee = small(conditions={"outside": {"n_poses": 4000}})
    found = rows(smartee, "outside")
    extents = extent_of(smartee.samples.box, values(found, POSE_FIELDS))
    np.testing.assert_allclose(np.histogram(extents, 4, (0.0, 2.0))[0], 1000, atol=120)
    # a box that the legs do not span any more
    far = rows(small(conditions={"outside": {"n_poses": 4000, "extent": 12.0}}), "outside")
    assert 0 < len(far) < 4000 and np.isfinite(joints_in(far)).all()
    assert far["pose"].max() > len(far)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"centre": [0.0, 0.0, 0.178]}, r"samples\.poses\.\w+: the legs do not reach \d+ of"),
        ({"half_angles": [0.17, 1.2, 0.17]}, "the legs do not reach"),
        ({"centre": [0.0, 0.0, 0.4]}, r"smartee\.samples\.box\.centre: the legs do not reach it"),
    ],
)
def test_poses_out_of_reach_are_named(changes, message):
    check(SMARTEE)
    with pytest.raises(ParameterError, match=message):
        check(small(samples={"box": changes}))


def test_elbows_at_the_centre_are_equal():
    elbows = centre_elbows(SMARTEE.machine, SMARTEE.samples.box)
    np.testing.assert_allclose(elbows, elbows[0], rtol=1e-12)


STUDIES = ("studies", "starts")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (("networks", "network", "trainer"), "nobody", "there is no trainer 'nobody'"),
        (("networks", "network", "learns"), "nothing", "there is no samples.poses 'nothing'"),
        (("networks", "best", "learns"), "selection", "selection is kept from training"),
        (("networks", "network", "n_hidden"), 1000, "expected numbers up to 300"),
        (("networks", "centre"), {"learns": "dense", "n_hidden": 3, "n_restarts": 1}, "taken"),
        (("networks", "best"), None, r"best"),
        (("samples", "poses", "selection"), None, r"selection"),
        (("samples", "poses", "dense", "seed"), 1, r"poses\.dense\.seed: 1 is that of samples"),
        (("conditions", "validation", "seed"), 3, r"validation\.seed: 3 is that of samples\.poses"),
        (("conditions", "random", "permutations"), "legs", "expected none"),
        (("conditions", "random", "n_poses"), 10**12, "less than or equal to 1000000"),
        (("conditions", "corners", "kind"), "path", "Field required"),
        (("conditions", "outside", "extent"), 1.0, "greater than 1"),
        (("conditions", "path_100", "cycles"), [1, 2, 3], "at least 6 items"),
        (("conditions", "restarts"), {"kind": "corners"}, "the name is taken"),
        (("methods", "network", "start"), "nobody", "there is no networks 'nobody'"),
        (("methods", "centre", "conditions"), ["nowhere"], r"centre\.conditions: there is no"),
        (("methods", "best", "n_steps"), [101], "less than or equal to 100"),
        (("machine", "plate_radius"), -0.05, "greater than 0"),
        ((*STUDIES, "trainers"), ["lbfgs", "lbfgs"], "lbfgs is there twice"),
        ((*STUDIES, "spreads"), {}, "at least 1 item"),
        ((*STUDIES, "tuned"), ["nobody"], "tuned: there is no studies.starts.trainers"),
        (("studies", "sensitivity", "trainer"), "lbfgs", "expected one of kind regularised_cg"),
        (("studies", "sensitivity", "spread"), "wide", "there is no studies.starts.spreads 'wide'"),
        (("studies", "sizes", "poses"), ["random"], "there is no samples.poses 'random'"),
        (("studies", "sizes", "n_hidden", "maximum"), 1000, "less than or equal to 300"),
    ],
)
def test_wrong_parameters_are_named(key, value, message):
    data = small().model_dump(exclude_unset=True)
    Section.model_validate(data)
    inner = data
    for name in key[:-1]:
        inner = inner[name]
    if value is None:
        del inner[key[-1]]
    else:
        inner[key[-1]] = value
    with pytest.raises(ValidationError, match=message):
        Section.model_validate(data)


def test_times_belong_to_what_determines_them():
    other = small(studies={"starts": {"n_hidden": 39}}, machine={"plate_radius": 0.051})
    assert (
        other.query_key != SMARTEE.query_key == small(conditions={"random": {"seed": 9}}).query_key
    )
    assert other.training_key("lbfgs") != SMARTEE.training_key("lbfgs")
    assert SMARTEE.training_key("lbfgs") != SMARTEE.training_key("regularised_cg")
    assert section()["studies"]["starts"]["n_hidden"] == SMARTEE.studies.starts.n_hidden
