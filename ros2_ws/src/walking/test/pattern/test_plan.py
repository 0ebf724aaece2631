"""Properties of planned walks."""

import math

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from hrp2_description.support import polygon_margin, sole_corners, support_polygon
from humanoid_motion.errors import JointLimit, PostureUnreachable
from hypothesis import given
from hypothesis import strategies as st
from walking.errors import WalkInfeasible
from walking.footsteps.footstep import Footstep, Pose, Stance, wrapped
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import resting, standing

GOALS = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1.5, 1.5))
ROUGH = WalkSettings(required_margin=-1.0, friction=9.0, speed_share=9.0, torque_share=9.0)


def soles_at(robot, joints, base, yaw):
    """Return x, y, z and yaw of the soles in odom by forward kinematics, by side, (4,)."""
    q = robot.configuration(base, joints, yaw)
    found = {}
    for side in SIDES:
        place, turn = robot.frame_pose(q, robot.feet[side].frame)
        np.testing.assert_allclose(turn[2], [0.0, 0.0, 1.0], atol=1e-9)  # level
        found[side] = np.append(place, math.atan2(turn[1, 0], turn[0, 0]))
    return found


@given(GOALS)
def test_the_zmp_stays_in_the_soles_and_planned_soles_stand_still(robot, half_sitting, goal):
    """Margin of the whole body's ZMP, and soles at their footsteps to a nanometre, at any walk."""
    steps = plan_footsteps(robot.config, half_sitting, Pose(*goal))
    plan = plan_walk(robot, standing(robot, half_sitting), steps)
    for phase in plan.schedule.phases:
        rows = np.arange(phase.first, phase.last + 1)
        hull = support_polygon(*(
            sole_corners(robot.config.soles[side], phase.stance.foot(side))
            for side in phase.sides))
        assert polygon_margin(plan.zmp[rows], hull).min() > 0.045
        for row in rows[:: max(1, len(rows) // 3)]:
            soles = soles_at(robot, plan.motion.joints[row], plan.motion.base[row],
                             plan.motion.base_yaw.angle[row])
            for side in phase.sides:
                x, y, z, yaw = soles[side]
                pose = phase.stance.foot(side)
                np.testing.assert_allclose([x, y, z], [pose.x, pose.y, 0.0], atol=1e-9)
                assert abs(wrapped(yaw - pose.yaw)) < 1e-9


def test_between_the_knots_the_standing_soles_move_by_micrometres(robot, arc):
    """The driver's spline keeps the distance and the angle of two standing soles."""
    knots = arc.knots
    worst = 0.0
    for phase in arc.schedule.phases:
        if phase.kind == "single":
            continue
        apart = []
        for time in np.linspace(knots.time[phase.first], knots.time[phase.last], 12):
            soles = soles_at(robot, knots.at(time)[0][0], np.zeros(3), 0.0)
            left, right = soles["left"], soles["right"]
            apart.append([*Pose(right[0], right[1], right[3]).seen_from(
                Pose(left[0], left[1], left[3])), right[2] - left[2]])
        worst = max(worst, float(np.ptp(np.array(apart), axis=0).max()))
    assert worst < 2e-6


def test_knots_are_a_motion_whose_derivatives_agree(arc):
    """Velocities and accelerations are the derivatives of the positions."""
    motion, step = arc.motion, arc.schedule.period
    for position, speed, acceleration in (
        (motion.joints, motion.joint_speed, motion.joint_acceleration),
        (motion.base, motion.base_speed, motion.base_acceleration),
        (motion.base_yaw.angle, motion.base_yaw.speed, motion.base_yaw.acceleration),
    ):
        # The trapezoidal rule, corrected by the derivatives at both ends.
        moved = position[1:] - position[:-1]
        mean = 0.5 * (speed[1:] + speed[:-1])
        bend = step**2 / 12.0 * (acceleration[1:] - acceleration[:-1])
        np.testing.assert_allclose(moved, step * mean - bend, atol=1e-5)
        np.testing.assert_allclose(
            speed[1:] - speed[:-1], 0.5 * step * (acceleration[1:] + acceleration[:-1]), atol=5e-3)


def test_a_walk_ends_at_rest_in_half_sitting(robot, arc):
    """The next hit can begin where a walk ends."""
    np.testing.assert_allclose(arc.knots.position[-1], robot.config.half_sitting, atol=1e-9)
    assert np.abs(arc.knots.velocity[-1]).max() < 1e-6
    assert np.abs(arc.knots.acceleration[-1]).max() < 1e-3
    assert arc.final.at_rest


def test_a_walk_does_not_depend_on_where_odom_is(robot, arc, half_sitting):
    """Displaced and turned footsteps give the same motion of the joints."""
    place = Pose(3.0, -2.0, 2.5)
    stance = Stance(*(place.moved(*half_sitting.foot(side)) for side in ("left", "right")))
    steps = [Footstep(step.side, *place.moved(*step.pose)) for step in arc.footsteps]
    moved = plan_walk(robot, standing(robot, stance), steps)
    np.testing.assert_allclose(moved.knots.position, arc.knots.position, atol=1e-7)
    np.testing.assert_allclose(moved.knots.acceleration, arc.knots.acceleration, atol=1e-3)
    np.testing.assert_allclose(moved.checks.margin, arc.checks.margin, atol=1e-6)


@given(st.integers(0, 6))
def test_replanning_at_a_step_gives_the_same_motion(robot, arc, step):
    """A plan from the beginning of a step continues the earlier plan with its own footsteps."""
    again = plan_walk(robot, arc.boundaries[step], arc.footsteps[step:])
    first = round(arc.begin_of(step) / arc.schedule.period)
    for name, tolerance in (("position", 1e-7), ("velocity", 1e-6), ("acceleration", 1e-4)):
        np.testing.assert_allclose(
            getattr(again.knots, name), getattr(arc.knots, name)[first:], atol=tolerance)


@given(st.integers(1, 4), st.integers(0, 2), GOALS)
def test_replanning_with_other_footsteps_begins_on_the_old_reference(robot, arc, at, kept, goal):
    """Position, velocity and acceleration go on, whatever comes after the next steps."""
    state = arc.boundaries[at]
    steps = list(arc.footsteps[at : at + kept])
    stance = state.stance
    for step in steps:
        stance = stance.after(step)
    side = arc.footsteps[at + kept].side
    steps += plan_footsteps(robot.config, stance, stance.middle.moved(*goal), first=side)
    new = plan_walk(robot, state, steps, ROUGH, clearance=False)
    first = round(arc.begin_of(at) / arc.schedule.period)
    for name, tolerance in (("position", 1e-8), ("velocity", 1e-6), ("acceleration", 1e-4)):
        np.testing.assert_allclose(
            getattr(new.knots, name)[0], getattr(arc.knots, name)[first], atol=tolerance)


@pytest.mark.parametrize("kept", [0, 1])
def test_a_walk_can_stop_at_any_step(robot, arc, kept):
    """Without further steps, or with the next one only, the robot comes to rest in its soles."""
    for at in (1, 2, len(arc.footsteps) - 1):
        stopped = plan_walk(robot, arc.boundaries[at], arc.footsteps[at : at + kept])
        assert stopped.checks.margin.min() > 0.02
        assert np.abs(stopped.knots.velocity[-1]).max() < 1e-6


def test_a_walk_begins_in_any_posture_at_rest(robot, half_sitting, arc):
    """From a low waist and a CoM elsewhere the first knot is the posture in which it stands."""
    from humanoid_motion.whole_body import solve

    feet = {side: np.array([*half_sitting.foot(side)[:2], 0.0]) for side in SIDES}
    upper = robot.config.posture(robot.config.braced_posture)
    joints, _ = solve(robot, upper=upper, com_xy=np.array([0.02, 0.04]), waist_z=0.57, feet=feet)
    state = resting(robot, half_sitting, joints[0], WalkSettings())
    plan = plan_walk(robot, state, arc.footsteps)
    np.testing.assert_allclose(plan.knots.position[0], joints[0], atol=1e-7)
    assert np.abs(plan.knots.velocity[0]).max() < 1e-6
    turned = Stance(half_sitting.left, Pose(0.0, -0.1, 0.0))
    with pytest.raises(WalkInfeasible, match="does not fit"):
        resting(robot, turned, joints[0], WalkSettings())


@pytest.mark.parametrize(("settings", "error", "limit"), [
    (WalkSettings(required_margin=0.07), WalkInfeasible, 0.07),
    (WalkSettings(speed_share=0.2), JointLimit, None),
    (WalkSettings(waist_height=0.70), PostureUnreachable, 0.6),
])
def test_limits_are_refused_with_value_and_limit(robot, half_sitting, arc, settings, error, limit):
    """Each check raises its own error, and the value is beyond the limit."""
    with pytest.raises(error) as caught:
        plan_walk(robot, standing(robot, half_sitting), arc.footsteps, settings)
    assert caught.value.value is not None
    assert limit is None or caught.value.limit == pytest.approx(limit)


def test_the_chest_takes_up_most_of_the_legs_yaw_moment(robot, walk_to, half_sitting):
    """Walking ahead, the floor's yaw moment is less than half of that with a still chest."""
    from humanoid_motion.dynamics import inverse_dynamics

    plan = walk_to(1.0, 0.0, 0.0)
    still = plan_walk(robot, standing(robot, half_sitting), plan.footsteps,
                      WalkSettings(chest_swing=0.0))
    swung, unswung = (
        np.sqrt(np.mean(inverse_dynamics(robot, each.motion).moment_z**2))
        for each in (plan, still))
    assert swung < 0.5 * unswung
