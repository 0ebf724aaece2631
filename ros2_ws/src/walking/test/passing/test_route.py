"""Footsteps through a doorway."""

import math

import numpy as np
import pytest
from walking.errors import PassageInfeasible
from walking.footsteps.checks import check_footsteps
from walking.footsteps.footstep import Pose, Stance, as_array, other, stances
from walking.passing.route import plan_route, step_limits, swaying
from walking.passing.settings import PassageSettings

SHOULDER = np.array([0.0, -0.25])
STANCE = Stance(Pose(0.0, 0.095, 0.0), Pose(0.0, -0.30, 0.0))
SETTINGS = PassageSettings()


@pytest.mark.parametrize("angle_deg", [70, 80])
@pytest.mark.parametrize("width", [0.8, 1.0])
def test_every_footstep_keeps_the_limits_and_the_body_its_distance(
        robot, doorway, width, angle_deg):
    """The body meets neither wall nor leaf after any step, and is clear of both after the last."""
    door = doorway(width)
    route = plan_route(robot.config, door, STANCE, math.radians(15), math.radians(angle_deg),
                       SHOULDER, SETTINGS)
    check_footsteps(robot.config, STANCE, route.footsteps, step_limits(robot.config))
    after = stances(STANCE, route.footsteps)[1:]
    middle = np.array([0.5 * (np.array(s.left) + np.array(s.right)) for s in after])
    before = np.vstack([0.5 * (np.array(STANCE.left) + np.array(STANCE.right)), middle[:-1]])
    still = np.array([s.foot(other(step.side)) for s, step in zip(
        after, route.footsteps, strict=True)])
    swayed = swaying(before, middle, still)
    leaf = np.array([math.radians(15), *route.leaf])
    gap = np.min([
        door.wall_gaps(SETTINGS.body, middle), door.wall_gaps(SETTINGS.body, swayed),
        door.leaf_gaps(SETTINGS.body, middle, route.leaf),
        door.leaf_gaps(SETTINGS.body, swayed, 0.5 * (leaf[:-1] + leaf[1:]))], axis=0)
    assert gap.min() == pytest.approx(route.gap)
    assert route.gap > 0.0
    assert door.clear_by(SETTINGS.body, middle)[-1] >= SETTINGS.gap
    soles = np.array([step.pose for step in route.footsteps])
    for side in ("left", "right"):
        mine = soles[[step.side == side for step in route.footsteps]]
        assert door.wall_gaps(robot.config.soles[side], mine).min() >= SETTINGS.foot_gap
    assert (np.diff([math.radians(15), *route.leaf]) >= 0.0).all()
    assert route.leaf[-1] == pytest.approx(math.radians(angle_deg))


def test_the_paper_s_door_is_passed_in_nine_footsteps(robot, doorway):
    """With single steps of 0.20 m the way of 1.5 m alone takes eight."""
    route = plan_route(robot.config, doorway(), STANCE, math.radians(15), math.radians(65),
                       SHOULDER, SETTINGS)
    assert len(route.footsteps) <= 9


def test_an_opening_that_is_too_narrow_is_refused_with_its_width(robot, doorway):
    with pytest.raises(PassageInfeasible, match=r"opening of 0\.654 m") as error:
        plan_route(robot.config, doorway(0.65), STANCE, math.radians(15), math.radians(65),
                   SHOULDER, SETTINGS)
    assert error.value.value < error.value.limit


def test_a_leaf_that_opens_too_little_is_refused(robot, doorway):
    with pytest.raises(PassageInfeasible):
        plan_route(robot.config, doorway(), STANCE, math.radians(15), math.radians(35),
                   SHOULDER, SETTINGS)


def test_the_body_sways_as_far_as_in_the_planned_walk(robot, passage):
    """Halfway through each step the planned waist is within 30 mm of where the search put it."""
    plan = passage.walk
    after = stances(plan.schedule.phases[0].stance, plan.footsteps)
    for i, step in enumerate(plan.footsteps):
        if abs(step.yaw - after[i].foot(step.side).yaw) > math.radians(15):
            continue  # in a turn the waist's course is bent
        middles = np.array([[*as_array(s.middle)] for s in after[i:i + 2]])
        still = as_array(after[i].foot(other(step.side)))[None]
        found = swaying(middles[:1], middles[1:], still)[0]
        time = 0.5 * (plan.begin_of(i) + plan.touchdown_of(i))
        waist = plan.motion.base[np.searchsorted(plan.motion.time, time)]
        aside = np.array([-math.sin(found[2]), math.cos(found[2])])
        assert abs(aside @ (waist[:2] - found[:2])) < 0.03
