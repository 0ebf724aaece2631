"""Where a hit begins, and the door as it is seen from where the soles are."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walking.errors import BadDoorPose, NotReached
from walking.footsteps.footstep import ORIGIN, Pose
from walking.passing.approach import (
    FARTHEST,
    FOUND,
    NEAR,
    ROOM,
    arrived,
    hit_start,
    require_found,
    require_way,
)

SURVEY = Pose(-0.4056, -0.715, 0.0)
poses = st.builds(Pose, *[st.floats(-3.0, 3.0)] * 3)
offs = st.builds(Pose, *[st.floats(-0.014, 0.014)] * 3)


@given(poses, poses)
def test_from_where_a_hit_begins_the_door_is_seen_as_surveyed(door, survey):
    assert door.seen_from(hit_start(door, survey)) == pytest.approx(survey, abs=1e-9)
    assert hit_start(SURVEY, SURVEY) == ORIGIN


@given(poses, offs)
def test_b_lies_on_the_leaf_wherever_the_soles_are(door, off):
    """From the hinge l_B along the leaf leads to the same point as from the soles to B."""
    start = hit_start(door, SURVEY)
    site = arrived(start, start.moved(*off), SURVEY, 0.01)
    assert site.soles == pytest.approx(off, abs=1e-9)
    distance, l_b = site.seen
    b = start.moved(*off).moved(0.01, -distance)
    assert b[:2] == pytest.approx(door.moved(l_b, 0.0)[:2], abs=1e-9)
    assert arrived(start, start, SURVEY, 0.01).seen == pytest.approx((0.715, 0.4156))


def test_a_robot_beside_the_start_has_not_arrived():
    for off in ((NEAR[0] + 1e-6, 0.0, 0.0), (0.0, 0.0, NEAR[1] + 1e-6), (math.nan, 0.0, 0.0)):
        with pytest.raises(NotReached):
            arrived(ORIGIN, Pose(*off), SURVEY, 0.01)


@given(st.floats(-3.0, 3.0), st.integers(0, 9999))
def test_the_uncertainty_that_counts_is_that_of_the_leafs_distance(yaw, seed):
    """It is the one of small errors of the pose, whatever they do along the leaf."""
    errors = 1e-3 * np.random.default_rng(seed).normal(size=(500, 3))
    at = Pose(0.0, 0.0, yaw)
    across = [Pose(*(np.array(at) + each)).moved(0.4, 0.0).seen_from(at).y for each in errors]
    covariance = errors.T @ errors
    scale = (FOUND / np.linalg.norm(across))**2
    require_found(0.98 * scale * covariance, yaw, 0.4)
    for refused in (1.02 * scale * covariance, -covariance, math.nan * covariance):
        with pytest.raises(BadDoorPose):
            require_found(refused, yaw, 0.4)


def test_doors_out_of_reach_are_refused():
    """Too far away, with the robot at the wall or beyond it, or nowhere."""
    door = Pose(1.0, 2.0, 0.7)
    start = hit_start(door, SURVEY)
    require_way(start.moved(0.0, FARTHEST - 1e-6), start, door)
    require_way(door.moved(0.4, ROOM + 1e-6), start, door)
    for middle in (start.moved(0.0, FARTHEST + 1e-6), door.moved(0.4, ROOM - 1e-6),
                   door.moved(0.4, -1.0), Pose(math.nan, 0.0, 0.0)):
        with pytest.raises(BadDoorPose):
            require_way(middle, start, door)
