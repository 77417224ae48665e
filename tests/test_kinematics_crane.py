"""Rigid crane: against the MATLAB code of the source, round trips, reach, smallest extension."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexik.kinematics.crane import (
    forward,
    inverse,
    inverse_with_smallest_extension,
    pose,
    smallest_extension,
)
from flexik.kinematics.status import ACTUATOR_LIMIT, OUT_OF_REACH, REACHED, STATUS_MEANING

LIFT_PIVOT = np.array([-0.09, 1.115])
LIFT_ARM = np.hypot(2.88, 0.024)  # |BG|
TIP_START, TIP_HEIGHT = 2.046, 0.248  # tip at zero extension in the jib frame

# The code's own output
PUBLISHED = [
    ((0.0, 0.0, 0.0), (4.279384, -1.176467)),
    ((0.3, 0.3, 0.5), (4.831467, 1.656896)),
    ((0.535, 0.1, 1.6), (1.677064, 7.338008)),
    ((0.1, 0.7, 0.4), (0.556642, -0.330875)),
]


def mitpatu(s1, s2, s3, n4=0.2581):
    """Appendix A of Rouvinen 1999, line by line: homogeneous transforms of the MATLAB function."""
    a11, b11, a12, b12 = 0.260, 1.040, 0.105, 0.3025
    a21, b21, a23, b23 = 0.203, 1.4165, 0.015, 0.19
    n1, n3 = 0.45, 0.48
    n11, n12 = np.sqrt(a11**2 + b11**2), np.sqrt(a12**2 + b12**2)
    epsi1, epsi2 = np.arctan(a11 / b11), np.arctan(a12 / b12)
    n5, n2 = np.sqrt(a21**2 + b21**2), np.sqrt(a23**2 + b23**2)
    epsi3, epsi8, epsi4 = np.arctan(a21 / b21), np.arctan(a23 / b23), np.arctan(0.095 / 0.24)
    nisku, tisku = s1 + 0.8, s2 + 1.037
    nkulma = np.arccos((nisku**2 - n11**2 - n12**2) / (-2 * n11 * n12)) + epsi1 + epsi2 - np.pi / 2
    epsi6 = np.arccos((tisku**2 - n5**2 - n1**2) / (-2 * n5 * n1))
    beta = np.pi - epsi3 - epsi6 - epsi8
    xxx = np.sqrt(n1**2 + n2**2 - 2 * n1 * n2 * np.cos(beta))
    epsi7 = np.arccos((n1**2 - xxx**2 - n2**2) / (-2 * xxx * n2))
    epsi5 = np.arccos((n3**2 - xxx**2 - n4**2) / (-2 * xxx * n4))
    tkulma = -np.pi / 2 - epsi8 + epsi7 + epsi5 + epsi4

    def joint(angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0, 0], [0, 0, 1, 0], [-s, -c, 0, 0], [0, 0, 0, 1]])

    t01 = np.array([[1, 0, 0, -0.09], [0, 0, -1, 1.115], [0, 1, 0, 0], [0, 0, 0, 1]])
    t23 = np.array([[1, 0, 0, 2.88], [0, 0, -1, -0.024], [0, 1, 0, 0], [0, 0, 0, 1]])
    t45 = np.array([[1, 0, 0, -0.095], [0, 0, -1, 0.24], [0, 1, 0, 0], [0, 0, 0, 1]])
    t56 = np.array([[1, 0, 0, 2.141], [0, 1, 0, 0], [0, 0, 1, -0.008], [0, 0, 0, 1]])
    t67 = np.array([[1, 0, 0, s3], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    p4 = t01 @ joint(nkulma) @ t23 @ joint(-tkulma) @ t45 @ t56 @ t67
    return p4[:2, 3]


def table_4_1():
    axes = np.linspace(0, 0.535, 9), np.linspace(0, 0.78, 9), np.linspace(0, 1.6, 5)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def random_strokes(geometry, n, seed=0):
    return np.random.default_rng(seed).uniform(0, geometry.stroke_maximum, (n, 3))


def fold(found):
    """Twice the area of B, G, tip: negative between the stretched and the folded arm."""
    a, b = found.jib_pivot - found.lift_pivot, found.tip - found.jib_pivot
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def polar(radius, angle):
    return LIFT_PIVOT + np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@pytest.mark.parametrize(("strokes", "tip"), PUBLISHED)
def test_the_transcription_gives_the_reference_values(strokes, tip):
    assert mitpatu(*strokes) == pytest.approx(tip, abs=1e-6)


def test_forward_agrees_with_the_source(geometry):
    strokes = table_4_1()
    found = forward(geometry, strokes)
    rounded = np.array([mitpatu(*s) for s in strokes])
    exact = np.array([mitpatu(*s, n4=np.sqrt(0.095**2 + 0.24**2)) for s in strokes])
    assert np.abs(found - exact).max() < 1e-12
    difference = np.linalg.norm(found - rounded, axis=1)
    # the code rounds |GI| to 0.1 mm; what that moves the tip by grows towards the folded arm
    assert 1e-5 < difference.max() < 5e-4
    assert difference[(strokes[:, 1] <= 0.585) & (strokes[:, 2] <= 0.4)].max() < 2e-4


def test_grid_of_table_4_1_keeps_3670_of_4050(geometry):
    tip = forward(geometry, table_4_1())
    assert 10 * len(tip) == 4050
    assert 10 * (tip[:, 0] >= 0).sum() == 3670


def unit_stroke():
    return st.floats(0, 1)


@given(unit_stroke(), unit_stroke(), unit_stroke())
def test_links_keep_their_length(geometry, a, b, c):
    strokes = np.array([[a, b, c]]) * geometry.stroke_maximum
    found = pose(geometry, strokes)

    def between(first, second):
        return np.linalg.norm(getattr(found, second)[0] - getattr(found, first)[0])

    s1, s2, s3 = strokes[0]
    expected = {
        ("lift_cylinder_base", "lift_cylinder_head"): 0.8 + s1,
        ("jib_cylinder_base", "rocker_head"): 1.037 + s2,
        ("rocker_pivot", "rocker_head"): 0.45,
        ("rocker_head", "coupler_pin"): 0.48,
        ("lift_pivot", "jib_pivot"): LIFT_ARM,
        ("lift_pivot", "lift_cylinder_head"): np.hypot(0.3025, 0.105),
        ("jib_pivot", "rocker_pivot"): np.hypot(0.19, 0.015),
        ("rocker_pivot", "jib_cylinder_base"): np.hypot(1.4165, 0.203),
        ("jib_pivot", "coupler_pin"): np.hypot(0.095, 0.24),
        ("coupler_pin", "extension_start"): np.hypot(2.141, 0.008),
        ("extension_start", "tip"): s3,
        ("jib_pivot", "tip"): np.hypot(TIP_START + s3, TIP_HEIGHT),
    }
    for pins, length in expected.items():
        assert between(*pins) == pytest.approx(length, abs=1e-12), pins
    assert found.lift_pivot[0] == pytest.approx(LIFT_PIVOT)
    assert found.lift_cylinder_base[0] == pytest.approx([0.17, 0.075])
    # angles are those of the arms
    along = np.array([np.cos(found.jib_angle[0]), np.sin(found.jib_angle[0])])
    assert found.tip[0] - found.extension_start[0] == pytest.approx(s3 * along, abs=1e-12)
    # H lies above the arm, as the code assembles it
    arm = found.jib_pivot[0] - found.lift_pivot[0]
    head = found.rocker_head[0] - found.lift_pivot[0]
    assert arm[0] * head[1] - arm[1] * head[0] > 0


def test_strokes_beyond_the_linkage_give_nan(geometry):
    found = forward(geometry, [[0.9, 0.1, 0.1], [0.1, 1.5, 0.1], [0.1, 0.1, 0.1]])
    assert np.isnan(found).all(axis=1).tolist() == [True, True, False]


def test_round_trip_over_random_strokes(geometry):
    strokes = random_strokes(geometry, 100_000, seed=1)
    found = pose(geometry, strokes)
    solution = inverse(geometry, found.tip, strokes[:, 2])
    assert solution.reached.all()
    assert np.abs(forward(geometry, solution.values) - found.tip).max() < 1e-9
    assert np.array_equal(solution.values[:, 2], strokes[:, 2])
    # between the folds there is one answer, and it is well determined away from them
    inside = fold(found) < -0.05
    assert 0.8 < inside.mean() < 1
    assert np.abs(solution.values - strokes)[inside].max() < 1e-6


def test_corners_of_the_strokes_are_reached(geometry):
    corners = np.array(np.meshgrid(*[(0, m) for m in geometry.stroke_maximum])).reshape(3, -1).T
    tip = forward(geometry, corners)
    solution = inverse(geometry, tip, corners[:, 2])
    assert solution.reached.all()
    assert forward(geometry, solution.values) == pytest.approx(tip, abs=1e-9)
    # limits are kept to the last digit
    assert (solution.values >= 0).all()
    assert (solution.values <= geometry.stroke_maximum).all()
    corner = forward(geometry, [[0.535, 0.0, 1.6]])
    # the arm is stretched past its fold there, so a shorter extension may do as well
    assert inverse_with_smallest_extension(geometry, corner).reached.all()


def test_jib_strokes_beyond_the_folds_are_found_where_the_first_branch_has_none(geometry):
    n = 2000
    strokes = random_strokes(geometry, n, seed=2)
    strokes[: n // 2, 1] *= 0.02 / 0.78  # near the stretched arm
    strokes[n // 2 :, 1] = 0.78 - strokes[n // 2 :, 1] * 0.01 / 0.78
    found = pose(geometry, strokes)
    beyond = fold(found) > 0
    assert beyond[: n // 2].any() and beyond[n // 2 :].any()
    solution = inverse(geometry, found.tip, strokes[:, 2])
    assert solution.reached.all()
    assert np.abs(forward(geometry, solution.values) - found.tip).max() < 1e-9
    # the other branch is taken only where the first is not within the cylinders
    chosen = fold(pose(geometry, solution.values)) > 1e-6
    assert chosen.any()
    assert not chosen[~beyond].any()


def test_unreachable_targets_are_flagged(geometry):
    targets = np.array([[9.0, 1.0], [-0.09, 1.2], [0.0, 5.0], [4.0, 1.0], [-3.0, 1.0]])
    solution = inverse(geometry, targets, 0.0)
    assert solution.status.tolist() == [
        *(OUT_OF_REACH, OUT_OF_REACH, ACTUATOR_LIMIT, REACHED, ACTUATOR_LIMIT)
    ]
    assert solution.reached.tolist() == [False, False, False, True, False]
    assert {REACHED, OUT_OF_REACH, ACTUATOR_LIMIT} < set(STATUS_MEANING)


def test_nan_stands_for_out_of_reach_and_for_nothing_else(geometry):
    rng = np.random.default_rng(3)
    targets, extension = rng.uniform(-9, 9, (5000, 2)), rng.uniform(0, 1.6, 5000)
    solution = inverse(geometry, targets, extension)
    assert set(solution.status) == {REACHED, OUT_OF_REACH, ACTUATOR_LIMIT}
    nan = np.isnan(solution.values)
    assert np.array_equal(nan.all(axis=1), solution.status == OUT_OF_REACH)
    assert np.array_equal(nan.any(axis=1), nan.all(axis=1))
    limit = np.array(geometry.stroke_maximum)
    within = ((solution.values >= 0) & (solution.values <= limit)).all(axis=1)
    assert np.array_equal(within, solution.reached)
    # the radius alone tells what no stroke of lift and jib could reach
    radius = np.linalg.norm(targets - LIFT_PIVOT, axis=1)
    outer = np.hypot(TIP_START + extension, TIP_HEIGHT)
    far = (radius > LIFT_ARM + outer) | (radius < np.abs(LIFT_ARM - outer))
    assert (solution.status[far] == OUT_OF_REACH).all()
    # needed strokes put the tip there where the linkage can follow
    needed = solution.status == ACTUATOR_LIMIT
    tip = forward(geometry, solution.values[needed])
    follows = np.isfinite(tip).all(axis=1) & (solution.values[needed] > -0.3).all(axis=1)
    assert np.abs(tip - targets[needed])[follows].max() < 1e-6


def test_an_extension_outside_its_cylinder_is_flagged(geometry):
    tip = forward(geometry, [[0.2, 0.3, 1.8]])
    assert inverse(geometry, tip, 1.8).status.tolist() == [ACTUATOR_LIMIT]
    assert inverse(geometry, forward(geometry, [[0.2, 0.3, 0.0]]), -0.1).status[0] != REACHED


def test_no_smaller_extension_reaches(geometry):
    strokes = random_strokes(geometry, 300, seed=4)
    targets = forward(geometry, strokes)
    smallest = smallest_extension(geometry, targets)
    assert (smallest <= strokes[:, 2] + 1e-9).all()
    assert (smallest == 0).any() and (smallest > 0.1).any()
    assert inverse(geometry, targets, smallest).reached.all()
    for share in np.append(np.linspace(0, 0.999, 400), 1 - 1e-6):
        shorter = smallest > 1e-6
        found = inverse(geometry, targets[shorter], share * smallest[shorter])
        assert not found.reached.any(), (share, targets[shorter][found.reached])


def test_no_extension_where_the_scan_finds_none(geometry):
    rng = np.random.default_rng(5)
    targets = rng.uniform([-2, -5], [7.5, 8], (300, 2))
    reachable = np.zeros(300, dtype=bool)
    for extension in np.linspace(0, 1.6, 801):
        reachable |= inverse(geometry, targets, extension).reached
    smallest = smallest_extension(geometry, targets)
    assert 50 < reachable.sum() < 250
    assert np.array_equal(np.isfinite(smallest), reachable)
    solution = inverse_with_smallest_extension(geometry, targets)
    assert np.array_equal(solution.reached, reachable)
    assert np.abs(forward(geometry, solution.values[reachable]) - targets[reachable]).max() < 1e-9


def test_retracted_crane_needs_no_extension(geometry):
    strokes = random_strokes(geometry, 500, seed=6) * [1, 1, 0]
    targets = forward(geometry, strokes)
    assert (smallest_extension(geometry, targets) == 0).all()


def test_stretched_arm_outside_the_reach_of_the_retracted_crane(geometry):
    # appendix B, outer circle: the tip beyond |BG| + |G tip|, closed form from the offset of J
    extension = np.linspace(0.01, 1.59, 40)
    radius = LIFT_ARM + np.hypot(TIP_START + extension, TIP_HEIGHT)
    targets = polar(radius, np.linspace(-0.3, 0.8, 40))
    expected = np.sqrt((radius - LIFT_ARM) ** 2 - TIP_HEIGHT**2) - TIP_START
    assert expected == pytest.approx(extension)
    assert smallest_extension(geometry, targets) == pytest.approx(expected, abs=1e-9)


def test_folded_arm_inside_the_smallest_circle(geometry):
    # appendix B, "area outside circle 1": nearer than the folded crane with its extension in
    extension = np.linspace(0.01, 0.5, 20)
    radius = LIFT_ARM - np.hypot(TIP_START + extension, TIP_HEIGHT)
    # directions in which the folded arm lies for middle strokes of the lift cylinder
    angle = pose(geometry, np.tile([0.25, 0.4, 0.0], (20, 1))).lift_angle - np.arctan2(0.024, 2.88)
    targets = polar(radius, angle)
    assert smallest_extension(geometry, targets) == pytest.approx(extension, abs=1e-8)
    assert smallest_extension(geometry, polar(np.array([0.8192]), angle[:1]))[0] == 0


def test_smallest_extension_respects_its_lower_bound(geometry):
    strokes = random_strokes(geometry, 300, seed=7)
    targets = forward(geometry, strokes)
    at_least = strokes[:, 2] * np.random.default_rng(8).uniform(0, 1, 300)
    found = smallest_extension(geometry, targets, at_least)
    assert (found >= at_least).all()
    assert (found <= strokes[:, 2] + 1e-9).all()
    assert np.array_equal(found == at_least, inverse(geometry, targets, at_least).reached)
    solution = inverse_with_smallest_extension(geometry, targets, at_least)
    assert solution.reached.all()
    assert np.array_equal(solution.values[:, 2], found)
    # one bound for all; above the longest stroke nothing is left
    assert (smallest_extension(geometry, targets[strokes[:, 2] > 0.5], 0.5) >= 0.5).all()
    assert np.isnan(smallest_extension(geometry, targets, 1.7)).all()
