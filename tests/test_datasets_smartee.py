"""Poses of the SmartEE: the box, the images under leg permutations, what files carry."""

import numpy as np
import pytest
from pydantic import ValidationError
from smartee_case import section, small

from flexik.datasets.smartee.poses import (
    ACTUATED_FIELDS,
    ELBOW_FIELDS,
    LEG_PERMUTATIONS,
    POSE_FIELDS,
    actuated_of,
    draw,
    generate,
    geometry_of,
    images,
    inputs_of,
    joints_in,
    path_poses,
    read_poses,
    values,
)
from flexik.datasets.smartee.provenance import evaluation_checksum
from flexik.errors import DataError, ParameterError
from flexik.kinematics.smartee import (
    closure,
    complete_direct,
    elbow_circles,
    leg_tips,
    rotation_zyz,
)
from flexik.parameters import SmartEE


def closure_error(smartee, joints):
    tips = leg_tips(elbow_circles(geometry_of(smartee), joints[..., :2]), joints[..., 2])
    return np.abs(closure(tips, geometry_of(smartee).side)).max(axis=-1)


def test_every_row_with_permutations_satisfies_the_closure(tmp_path):
    smartee = small(poses={"training": {"n_poses": 167}})
    n_rows = generate(tmp_path / "training.parquet", smartee, "training")
    table = read_poses(tmp_path, smartee, "training")
    assert n_rows == len(table) == 6 * 167 == 1002
    assert closure_error(smartee, joints_in(table)).max() < 1e-15
    assert np.bincount(table["pose"]).tolist() == [6] * 167
    assert np.all(values(table, ELBOW_FIELDS) < 0.0)


def test_a_plain_exchange_of_legs_violates_the_closure_by_centimetres():
    smartee = small()
    _, joints = draw(smartee, "random")
    side = geometry_of(smartee).side
    wrong = []
    for legs, reflected in LEG_PERMUTATIONS:
        plain = closure_error(smartee, joints[:, legs, :]) / (2.0 * side)
        assert reflected or plain.max() < 1e-14
        wrong += [plain.max()] if reflected else []
    assert min(wrong) > 0.005


def test_images_turn_and_reflect_the_plate():
    """Cyclic ones turn the base by a third of a turn, exchanges reflect it in a vertical plane."""
    smartee = small()
    geometry = geometry_of(smartee)
    poses, joints = draw(smartee, "random")
    for (legs, reflected), image in zip(LEG_PERMUTATIONS, images(joints), strict=True):
        position, _ = complete_direct(geometry, image[..., :2], image[..., 2])
        # the angle at which image leg 0 finds its origin
        angle = 2.0 * np.pi / 3.0 * legs[0]
        x, y, z = poses[:, :3].T
        c, s = np.cos(angle), np.sin(angle)
        expected = np.column_stack([c * x + s * y, c * y - s * x, z])
        if reflected:
            expected[:, 1] *= -1.0
        np.testing.assert_allclose(position, expected, atol=1e-15)


def test_sets_fill_their_boxes_and_agree_with_their_joints(tmp_path):
    smartee = small(poses={"random": {"n_poses": 4000}})
    generate(tmp_path / "random.parquet", smartee, "random")
    table = read_poses(tmp_path, smartee, "random")
    poses, joints = values(table, POSE_FIELDS), joints_in(table)
    space = smartee.workspace
    half = np.array([*space.half_lengths, *space.half_angles])
    shares = (poses - [*space.centre, 0.0, 0.0, 0.0]) / half
    assert np.abs(shares).max() <= 1.0 and np.all(np.abs(shares).max(axis=0) > 0.99)
    assert np.all(np.abs(shares.mean(axis=0)) < 0.05)
    position, rotation = complete_direct(geometry_of(smartee), joints[..., :2], joints[..., 2])
    assert np.abs(position - poses[:, :3]).max() < 1e-12
    assert np.abs(rotation - rotation_zyz(poses[:, 3:])).max() < 1e-12


def test_network_inputs_and_joints_are_the_same_angles():
    _, joints = draw(small(), "random")
    inputs = inputs_of(joints[..., :2])
    assert [field.name for field in ACTUATED_FIELDS][:4] == [
        *("theta1_leg1", "theta1_leg2", "theta1_leg3", "theta2_leg1")
    ]
    np.testing.assert_array_equal(inputs[:, 3], joints[:, 0, 1])
    np.testing.assert_array_equal(actuated_of(inputs), joints[..., :2])
    with pytest.raises(DataError, match=r"shape \(12, 5\)"):
        actuated_of(inputs[:, :5])


def test_a_file_of_other_parameters_is_refused(tmp_path):
    generate(tmp_path / "random.parquet", small(), "random")
    with pytest.raises(DataError, match=r"random\.parquet: made with other parameters"):
        read_poses(tmp_path, small(geometry={"plate_radius": 0.051}), "random")
    # another set's size is none of its business
    read_poses(tmp_path, small(poses={"dense": {"n_poses": 13}}), "random")


def test_poses_out_of_reach_are_counted_and_named():
    smartee = small(workspace={"centre": [0.0, 0.0, 0.178]})
    with pytest.raises(ParameterError, match=r"poses\.random: the legs do not reach \d+ of"):
        draw(smartee, "random")
    with pytest.raises(ParameterError, match=r"smartee\.path: the legs do not reach"):
        path_poses(smartee, 50)


def test_paths_begin_at_the_centre_and_stay_in_the_box():
    smartee = small()
    poses, joints = path_poses(smartee, 200)
    np.testing.assert_allclose(poses[0], [*smartee.workspace.centre, 0, 0, 0], atol=1e-15)
    half = np.array([*smartee.workspace.half_lengths, *smartee.workspace.half_angles])
    assert np.abs(poses - poses[0]).max(axis=0) == pytest.approx(half, rel=1e-2)
    assert np.abs(np.diff(joints, axis=0)).max() < 0.1


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (("networks", "network", "trainer"), "nobody", "there is no trainer 'nobody'"),
        (("networks", "network", "poses"), "nothing", "there is no data set 'nothing'"),
        (("networks", "best", "poses"), "validation", "validation is kept from training"),
        (("starts", "trainers"), ["lbfgs", "lbfgs"], "lbfgs is there twice"),
        (("starts", "spreads"), {}, "expected at least one"),
        (("poses", "random", "permutations"), "legs", "expected none"),
        (("poses", "random", "n_poses"), 0, "greater than or equal to 1"),
        (("geometry", "plate_radius"), -0.05, "greater than 0"),
        (("outside", "extent"), 1.0, "greater than 1"),
        (("trainers", "published", "penalty_decrease"), 1.0, "less than 1"),
        (("poses", "validation", "seed"), 3, r"poses\.validation\.seed: 3 is that of poses\.sel"),
        (("poses", "random", "seed"), 1, r"poses\.random\.seed: 1 is that of poses\.training"),
        (("poses", "random", "n_poses"), 10**12, "less than or equal to 1000000"),
        (("outside", "extent"), 1e6, "less than or equal to 100"),
        (
            ("networks", "network", "n_hidden"),
            1000,
            r"networks\.network\.n_hidden: expected at most",
        ),
        (("sizes", "n_hidden", "maximum"), 1000, r"sizes\.n_hidden\.maximum: expected at most 300"),
        (("path", "n_samples"), [100, 100], r"n_samples\.1: 100 is there twice"),
        (("path", "cycles"), [1, 2, 3], r"path\.cycles\n.*at least 6 items"),
        (("newton", "network_steps"), 1, "greater than or equal to 2"),
        (("starts", "tuned"), ["nobody"], r"starts\.tuned\.0: nobody is not in starts\.trainers"),
        (("starts", "sensitivity", "trainer"), "lbfgs", "lbfgs is lbfgs, expected regularised_cg"),
        (("starts", "sensitivity", "spread"), "wide", "there is no spread 'wide'"),
        (("sizes", "beside"), "random", r"sizes\.beside: random is kept from training"),
    ],
)
def test_wrong_parameters_are_named(key, value, message):
    data = section()
    inner = data
    for name in key[:-1]:
        inner = inner[name]
    inner[key[-1]] = value
    with pytest.raises(ValidationError, match=message):
        SmartEE.model_validate(data)


@pytest.mark.parametrize(
    "changes",
    [
        {"newton": {"accepted": 1e-5}},
        {"path": {"n_samples": [30]}},
        {"outside": {"seed": 9}},
        {"poses": {"validation": {"seed": 9}}},
        {"poses": {"random": {"seed": 9}}},
        {"networks": {"best": {"seed": 9}}},
        {"trainers": {"published": {"penalty": 0.1}}},
        {"workspace": {"centre": [0.0, 0.0, 0.139]}},
    ],
    ids=str,
)
def test_errors_belong_to_all_that_determines_them(changes):
    assert evaluation_checksum(small(**changes)) != evaluation_checksum(small())
    assert evaluation_checksum(small(starts={"seed": 9})) == evaluation_checksum(small())


@pytest.mark.parametrize("name", ["validation", "network", "centre"])
def test_names_that_stages_need_are_there_and_are_their_own(name):
    data = section()
    if name == "centre":
        data["networks"]["centre"] = data["networks"]["best"]
    else:
        data["poses" if name == "validation" else "networks"].pop(name)
    with pytest.raises(ValidationError, match=name):
        SmartEE.model_validate(data)
