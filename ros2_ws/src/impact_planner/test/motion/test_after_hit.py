"""Motion after the hit, also for a door that does not stand where it was reported."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import inverse_dynamics
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.zmp import margins
from impact_planner.hit.posture import LegDemands, capable, waist_per_com
from impact_planner.hit.stance import stance_for_step
from impact_planner.motion.post import continue_from
from impact_planner.plan import plan_impact
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import PlannerSettings
from scipy.interpolate import make_interp_spline

TARGET = math.radians(25.0)


def test_legs_that_do_not_reach_far_enough_to_stop_are_named(robot, known):
    """The refusal names distance and reach, not an infinite margin."""
    request = PlanRequest(math.radians(26.0), restitution=0.0, run_up="zmp_limited")
    with pytest.raises(PostureUnreachable, match="mm past the nominal contact") as caught:
        plan_impact(request, known, robot, PlannerSettings(
            post_duration=2.0, com_inside_edge=0.01, missed_reserve=-1.0))
    assert caught.value.quantity == "way to rest [m]"
    assert caught.value.value > caught.value.limit > 0.0


def test_an_uncertain_door_costs_margin(robot, known):
    """A nearer door leaves more margin and a farther one less; uncertainty increases the effect.

    The margin of a missed contact does not depend on the uncertainty.
    """
    found = [
        plan_impact(
            PlanRequest(TARGET), known, robot, PlannerSettings(door_uncertainty=way)).branches
        for way in (0.005, 0.02)
    ]
    for branches in found:
        assert branches.early_margin > branches.late_margin >= 0.02
    assert found[0].late_margin > found[1].late_margin
    assert found[0].early_margin < found[1].early_margin
    assert found[0].missed_margin == pytest.approx(found[1].missed_margin, abs=1e-9)


@pytest.mark.parametrize("run_up", ["mcv50", "zmp_limited"])
def test_a_stop_begun_before_the_point_of_no_return_keeps_balance_and_the_leaf(
    robot, known, run_up
):
    """A stop begun in time keeps ZMP and leaf clear; one begun 40 ms later does not."""
    plan = plan_impact(PlanRequest(TARGET, run_up=run_up), known, robot)
    cam, contact = plan.phase("cam").knots, plan.contact_point[1]
    feet = {"left": plan.left_foot, "right": plan.right_foot}
    for late, good in ((-0.05, True), (0.0, True), (0.04, False)):
        start = plan.contact_time - plan.point_of_no_return + late
        knots = continue_from(cam, start, 1.0, plan.stop_duration)
        time = np.arange(0.0, plan.stop_duration, 0.005)
        joints, speed, acceleration = knots.at(time)
        base = plan.left_foot - robot.leg_chains["left"].place(joints, np.zeros((len(time), 3))).end
        spline = make_interp_spline(time, base, k=5)
        motion = Motion(
            time, joints, speed, acceleration, base, spline(time, 1), spline(time, 2))
        margin = margins(robot, inverse_dynamics(robot, motion).zmp, feet, SIDES)[4:-4].min()
        q = robot.configuration(base[-1], joints[-1])
        gap = robot.contact_position(q)[1] - robot.config.contact_radius - contact
        assert bool(margin > 0.018 and gap > 0.009) is good


def demands(robot, v_rb, stance):
    """The demands of a speed of B [m/s] on the legs."""
    speed = v_rb / waist_per_com(robot, stance.posture, stance.feet)
    return LegDemands(speed=speed, joint_speed=0.9 * robot.speed_limit)


def test_a_faster_hit_lowers_the_waist_as_far_as_the_knee_asks(robot, stance):
    """Eq. (5) is met at 0.5 m/s; at 0.62 the waist is just low enough, at 1.5 none is."""
    calm = stance_for_step(robot, stance.step, 0.01, demands(robot, 0.5, stance))
    assert calm.posture.percussion_error == pytest.approx(0.0, abs=1e-5)
    fast = demands(robot, 0.62, stance)
    assert not capable(robot, stance.posture, stance.feet, fast)
    lower = stance_for_step(robot, stance.step, 0.01, fast)
    assert lower.posture.waist_height < stance.posture.waist_height - 0.001
    assert lower.posture.percussion_error < -1e-4
    assert capable(robot, lower.posture, lower.feet, fast)
    assert not capable(
        robot, lower.posture, lower.feet, replace(fast, speed=1.01 * fast.speed))
    with pytest.raises(JointLimit, match="LLEG_JOINT3") as caught:
        stance_for_step(robot, stance.step, 0.01, demands(robot, 1.5, stance))
    assert caught.value.value > caught.value.limit
