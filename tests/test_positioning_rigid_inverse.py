"""Initial positions and the closed-form rigid inverse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexik.errors import UnreachableError
from flexik.kinematics import crane
from flexik.kinematics.crane_manipulator import CraneManipulator
from flexik.kinematics.status import OUT_OF_REACH, REACHED
from flexik.positioning.method import PositioningError, rigid_inverse

# away from the corners of the working area, where round-off decides
fractions = st.tuples(*[st.floats(0.001, 0.999)] * 3).map(np.array)
FAR = [9.0, 9.0]


def reaching(geometry, target, extensions):
    return crane.inverse(geometry, np.tile(target, (len(extensions), 1)), extensions).reached


def test_initial_positions_are_full_centimetres_near_the_inverse(geometry, points):
    strokes = CraneManipulator(geometry).initial_positions(points)
    exact = crane.inverse_with_smallest_extension(geometry, points).values
    assert np.allclose(100 * strokes, np.round(100 * strokes), atol=1e-10)
    assert np.abs(strokes - exact).max() <= 0.005 + 1e-9
    assert (strokes >= 0).all() and (strokes <= geometry.stroke_maximum).all()


def test_initial_positions_stay_within_a_limit_between_two_centimetres(geometry):
    longer = replace(geometry, stroke_maximum=(0.538, 0.78, 1.6))
    at_limit = crane.forward(longer, np.array([[0.537, 0.3, 0.0]]))
    assert CraneManipulator(longer).initial_positions(at_limit)[0] == pytest.approx(
        [0.53, 0.3, 0.0], abs=1e-12
    )


def test_initial_positions_name_the_unreachable_target(geometry, points):
    with pytest.raises(UnreachableError, match=r"\(9, 9\)"):
        CraneManipulator(geometry).initial_positions(np.vstack([points, FAR]))


@settings(deadline=None)
@given(fraction=fractions)
def test_closed_form_reaches_with_the_smallest_extension(geometry, fraction):
    # any tip the strokes make is a reachable target
    target = crane.forward(geometry, fraction * geometry.stroke_maximum)
    strokes, status, _ = CraneManipulator(geometry).inverse(target, np.zeros((1, 3)))
    assert status[0] == REACHED
    assert np.abs(crane.forward(geometry, strokes) - target).max() < 1e-6
    assert (strokes >= 0).all() and (strokes <= geometry.stroke_maximum).all()
    # brute force: no clearly smaller extension reaches
    smaller = np.arange(0.0, strokes[0, 2] - 1e-6, 0.01)
    assert not reaching(geometry, target[0], smaller).any()


@settings(deadline=None)
@given(fraction=fractions, dx=st.floats(-0.1, 0.1), dy=st.floats(-0.1, 0.1))
def test_closed_form_keeps_the_extension_of_the_original_target(geometry, fraction, dx, dy):
    original = crane.forward(geometry, fraction * geometry.stroke_maximum)
    corrected = original + np.array([dx, dy])
    current = np.full((1, 3), 0.1)
    kept = crane.smallest_extension(geometry, original)[0]
    strokes, status, _ = CraneManipulator(geometry).inverse(corrected, current, original)
    grid = np.arange(0.0, 1.6001, 0.01)
    possible = reaching(geometry, corrected[0], grid)
    if status[0] != REACHED:
        assert not possible.any()
        assert (strokes == current).all()
    elif reaching(geometry, corrected[0], np.array([kept]))[0]:
        assert strokes[0, 2] == kept
    elif strokes[0, 2] > kept:
        assert not possible[(grid >= kept) & (grid < strokes[0, 2] - 1e-6)].any()
    else:
        assert not possible[grid >= kept].any()
        assert not possible[grid < strokes[0, 2] - 1e-6].any()


def test_closed_form_shortens_an_extension_that_reaches_no_more(geometry):
    # at the top border, lift fully out, a longer extension only reaches farther
    original = np.array([[1.13, 7.04]])
    corrected = np.array([[1.13, 6.95]])
    needed = crane.smallest_extension(geometry, corrected)
    kept = crane.smallest_extension(geometry, original)
    assert not reaching(geometry, corrected[0], np.arange(kept[0], 1.6001, 0.01)).any()
    strokes, status, _ = CraneManipulator(geometry).inverse(corrected, np.zeros((1, 3)), original)
    assert status[0] == REACHED
    assert strokes[0, 2] == needed[0]


def test_closed_form_flags_unreachable_targets_and_stays(geometry):
    current = np.array([[0.1, 0.2, 0.3], [0.2, 0.2, 0.2]])
    strokes, status, _ = CraneManipulator(geometry).inverse(np.array([FAR, [4.0, 1.0]]), current)
    assert status.tolist() == [OUT_OF_REACH, REACHED]
    assert strokes[0].tolist() == current[0].tolist()


def test_the_branch_is_the_extension(geometry):
    assert CraneManipulator(geometry).branch(np.array([[0.1, 0.2, 0.3]])).tolist() == [[0.3]]


def test_current_strokes_of_another_number_are_told(geometry):
    with pytest.raises(PositioningError, match="current coordinates: expected shape"):
        rigid_inverse(CraneManipulator(geometry), np.array([[4.0, 1.0]]), np.zeros((1, 2)))
