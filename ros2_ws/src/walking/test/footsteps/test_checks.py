"""Refusals of footsteps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walking.errors import InvalidFootsteps
from walking.footsteps.checks import check_footsteps, sole_distances
from walking.footsteps.footstep import Footstep, Pose, Stance

GOOD = [Footstep("left", 0.1, 0.095, 0.0), Footstep("right", 0.2, -0.095, 0.0)]


@pytest.mark.parametrize(("change", "value", "limit"), [
    ({"x": 0.31}, 0.21, 0.20),  # too far ahead
    ({"y": -0.07}, 0.165, 0.17),  # too near
    ({"x": math.nan}, None, "a finite number"),
    ({"side": "left"}, "left", "right"),
])
def test_bad_footsteps_are_refused_with_value_and_limit(
    robot, half_sitting, change, value, limit
):
    """The error says which limit the second footstep breaks, and by which value."""
    with pytest.raises(InvalidFootsteps, match="footstep 2") as caught:
        check_footsteps(robot.config, half_sitting, [GOOD[0], replace(GOOD[1], **change)])
    assert value is None or caught.value.value == pytest.approx(value)
    assert caught.value.limit == (limit if isinstance(limit, str) else pytest.approx(limit))


def test_soles_that_would_meet_are_refused(robot):
    """Feet turned inwards come nearer than the clearance, although every other limit holds."""
    stance = Stance.around(Pose(0.0, 0.0, 0.0), 0.17)
    step = Footstep("left", 0.0, 0.085, -math.radians(20.0))
    with pytest.raises(InvalidFootsteps, match="distance between the soles"):
        check_footsteps(robot.config, stance, [step])


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3.2, 3.2))
def test_distance_of_soles_is_symmetric_and_negative_only_where_they_overlap(robot, x, y, yaw):
    """Points of one sole lie in the other one only where the distance is negative."""
    left, right = np.array([[x, y, yaw]]), np.zeros((1, 3))
    gap = sole_distances(robot.config, "left", left, right)[0]
    assert gap == pytest.approx(sole_distances(robot.config, "right", right, left)[0])
    low_x, high_x, low_y, high_y = robot.config.soles["left"]
    grid = np.stack(np.meshgrid(np.linspace(low_x, high_x, 24), np.linspace(low_y, high_y, 14)), -1)
    cos, sin = np.cos(yaw), np.sin(yaw)
    points = grid @ np.array([[cos, sin], [-sin, cos]]) + [x, y]
    x_min, x_max, y_min, y_max = robot.config.soles["right"]
    inside = ((points[..., 0] > x_min) & (points[..., 0] < x_max)
              & (points[..., 1] > y_min) & (points[..., 1] < y_max)).any()
    assert not (inside and gap >= 0.0)
    assert inside or gap > -0.01  # the grid's points are 10 mm apart
