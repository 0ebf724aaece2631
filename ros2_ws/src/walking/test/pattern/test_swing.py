"""Courses of the swing foot."""

import math

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from walking.footsteps.checks import sole_distances
from walking.footsteps.footstep import Footstep, Pose, Stance
from walking.pattern.settings import WalkSettings
from walking.pattern.swing import feet_courses, swing
from walking.pattern.timing import schedule

ANGLES = st.floats(-math.radians(20.0), math.radians(20.0))


@given(st.tuples(*[st.floats(-0.4, 0.4)] * 3), st.floats(0.3, 2.0))
def test_the_foot_rests_at_both_ends_and_is_above_the_floor_between(end, duration):
    """No speed and no acceleration at lift-off and touchdown; the highest point is the lift."""
    share = np.linspace(0.0, 1.0, 201)
    course = swing(np.zeros(3), np.array(end), np.zeros(2), 0.05, share * duration, 0.04)
    for rows in (course.speed, course.acceleration):
        np.testing.assert_allclose(rows[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(course.value[-1], [end[0], end[1], 0.0, end[2]], atol=1e-12)
    assert (course.value[1:-1, 2] > 0.0).all()
    assert course.value[:, 2].max() <= 0.05 + 1e-12
    np.testing.assert_allclose(
        np.gradient(course.value, share * duration, axis=0)[1:-1], course.speed[1:-1],
        atol=0.01 / duration)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), ANGLES, ANGLES, ANGLES)
def test_the_swing_foot_goes_around_the_standing_one(robot, before, after, yaw, stood, turned):
    """Whatever the headings, the soles come no nearer than their clearance or their own ends."""
    stance = Stance(Pose(before, 0.11, yaw), Pose(0.0, -0.1, stood))
    step = Footstep("left", after, 0.11, turned)
    plan = schedule(stance, [step], WalkSettings(), at_rest=True)
    course = feet_courses(robot.config, plan, [step], stance, 0.045)["left"].value[:, [0, 1, 3]]
    right = np.tile([0.0, -0.1, stood], (len(course), 1))
    gap = sole_distances(robot.config, "left", course, right)
    assume(min(gap[0], gap[-1]) > 0.0)
    required = min(robot.config.footsteps.clearance, gap[0], gap[-1])
    assert gap.min() >= required - 2e-4
