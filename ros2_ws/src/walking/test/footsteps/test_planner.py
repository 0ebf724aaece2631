"""Footsteps to a goal."""

import itertools
import math

import numpy as np
import pytest
from hrp2_description.support import polygon_margin, sole_corners
from hypothesis import given
from hypothesis import strategies as st
from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import OUTWARD, Pose, Stance, other, stances
from walking.footsteps.planner import plan_footsteps

POSES = st.builds(Pose, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-7.0, 7.0))


def distance_of_soles(robot, stance):
    """Return the smallest distance from a corner or edge point of a sole to the other sole [m]."""
    soles = {side: sole_corners(robot.config.soles[side], stance.foot(side))
             for side in ("left", "right")}
    found = []
    for side, corners in soles.items():
        share = np.linspace(0.0, 1.0, 21)[:, None, None]
        edges = (corners + share * (np.roll(corners, 1, axis=0) - corners)).reshape(-1, 2)
        found.append(-polygon_margin(edges, soles[other(side)]).max())
    return min(found)


@given(POSES, POSES, st.booleans())
def test_every_goal_is_reached_exactly_within_every_limit(robot, begin, goal, keep_heading):
    """Any goal is met to rounding; sides alternate, limits hold, and soles keep their clearance."""
    limits = robot.config.footsteps
    stance = Stance.around(begin, limits.width)
    steps = plan_footsteps(robot.config, stance, goal, keep_heading=keep_heading)
    course = stances(stance, steps)
    for before, step, after in zip(course, steps, course[1:], strict=False):
        x, y, yaw = step.pose.seen_from(before.foot(other(step.side)))
        assert -limits.back - 1e-9 <= x <= limits.ahead + 1e-9
        assert limits.narrowest - 1e-9 <= OUTWARD[step.side] * y <= limits.widest + 1e-9
        assert abs(yaw) <= limits.turn + 1e-9
        assert distance_of_soles(robot, after) >= limits.clearance - 1e-9
    for one, two in itertools.pairwise(steps):
        assert one.side != two.side
    for side in ("left", "right"):
        wanted = Stance.around(goal, limits.width).foot(side)
        np.testing.assert_allclose(course[-1].foot(side).seen_from(wanted), 0.0, atol=1e-9)


@given(POSES)
def test_footsteps_do_not_depend_on_where_odom_is(robot, place):
    """A walk from another place is the same walk, displaced and turned."""
    width = robot.config.footsteps.width
    here, there = (Stance.around(pose, width) for pose in (Pose(0.0, 0.0, 0.0), place))
    goal = (0.7, -0.3, 0.9)
    at_origin = plan_footsteps(robot.config, here, Pose(*goal))
    elsewhere = plan_footsteps(robot.config, there, place.moved(*goal))
    assert [step.side for step in at_origin] == [step.side for step in elsewhere]
    for one, two in zip(at_origin, elsewhere, strict=True):
        np.testing.assert_allclose(two.pose.seen_from(place), one.pose, atol=1e-9)


@pytest.mark.parametrize(("goal", "count"), [
    ((2.0, 0.0, 0.0), 11), ((0.0, 0.3, 0.0), 4)])
def test_steps_are_as_few_as_the_limits_allow(robot, half_sitting, goal, count):
    """Ahead and back each step advances, sideways every other one, and one closes the feet."""
    x, y, yaw = goal
    steps = plan_footsteps(
        robot.config, half_sitting, Pose(x, y, math.radians(yaw)), keep_heading=True)
    assert len(steps) == count


def test_a_far_goal_to_the_side_is_walked_to_ahead_unless_the_heading_is_kept(robot, half_sitting):
    """Facing the way needs fewer steps than sidestepping over 3 m."""
    goal = Pose(0.0, 3.0, 0.0)
    ahead = plan_footsteps(robot.config, half_sitting, goal)
    aside = plan_footsteps(robot.config, half_sitting, goal, keep_heading=True)
    assert len(ahead) < len(aside)
    assert max(abs(step.yaw) for step in aside) == 0.0


@pytest.mark.parametrize(("goal", "value"), [
    (Pose(math.nan, 0.0, 0.0), None), (Pose(60.0, 0.0, 0.0), 60.0)])
def test_goals_that_are_no_numbers_or_too_far_are_refused(robot, half_sitting, goal, value):
    """A goal with NaN or 60 m away is an error with value and limit."""
    with pytest.raises(InvalidFootsteps) as caught:
        plan_footsteps(robot.config, half_sitting, goal)
    assert caught.value.limit is not None
    assert value is None or caught.value.value == value


def test_feet_that_stand_far_apart_come_together_first(robot):
    """From the widest and most turned stances every near goal is reached, with either foot."""
    stance = Stance(Pose(0.1, 0.17, 0.17), Pose(-0.1, -0.16, -0.17))
    for first in ("left", "right"):
        for goal in (Pose(0.0, 0.0, 0.0), Pose(0.05, -0.1, -0.3), Pose(-0.4, 0.3, 1.0)):
            steps = plan_footsteps(robot.config, stance, goal, first=first)
            last = stances(stance, steps)[-1]
            np.testing.assert_allclose(last.middle.seen_from(goal), 0.0, atol=1e-9)
