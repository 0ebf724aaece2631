"""Recovery from a push, without a simulation: measurements are made from the plan itself."""

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.kinematics import planar_pose
from humanoid_motion.samples import ImuSample, Measured
from walking.footsteps.checks import fits
from walking.footsteps.footstep import other
from walking.recovery.adaptation import Swing, landings, step_limits
from walking.recovery.estimate import com_over_sole, reference_at, watch
from walking.recovery.recovery import recover

TILTS = [(math.cos(a), math.sin(a)) for a in np.arange(3) * math.tau / 3.0]
STEPS = (1, 2)


@pytest.fixture(scope="module")
def ahead(walk_to):
    """A walk ahead, whose second and third steps are those of the right and the left foot."""
    return walk_to(0.8, 0.0, 0.0)


@pytest.fixture(scope="module")
def far(robot):
    """The robot's description with the limits of recovery steps."""
    return replace(robot.config, footsteps=step_limits(robot.config))


def middle_of(plan, step):
    """Return the time of the middle of a single support [s]."""
    phase = next(p for p in plan.schedule.phases if p.kind == "single" and p.step == step)
    return 0.5 * (phase.first + phase.last) * plan.schedule.period


def measured_at(robot, plan, time, velocity=(0.0, 0.0)):
    """What a robot measures whose body turns about its sole so that the CoM has a speed more."""
    phase = plan.phase_at(time)
    position, speed, _ = (rows[0] for rows in plan.knots.at(time))
    q = robot.configuration(np.zeros(3), position)
    frame = robot.config.imu_frame
    _, turn = robot.frame_pose(q, frame)
    side = phase.sides[0]
    sole = phase.stance.foot(side)
    com = com_over_sole(robot, side, sole, position, speed, None)
    rate = np.array([-velocity[1], velocity[0], 0.0]) / com.height
    _, yaw = robot.frame_pose(q, robot.feet[side].frame)
    heading = sole.yaw - math.atan2(yaw[1, 0], yaw[0, 0])
    about = planar_pose(0.0, 0.0, heading)[:3, :3]
    world = about @ turn
    # The plan's own turn about the vertical.
    ahead, back = (reference_at(robot, plan, time + dt, 0.75) for dt in (1e-4, -1e-4))
    assert ahead.swing == back.swing
    chest = robot.frame_jacobian(q, frame)[3:] @ robot.velocity(np.zeros(3), speed)
    feet = robot.frame_jacobian(q, robot.feet[side].frame)[3:] @ robot.velocity(np.zeros(3), speed)
    own = about @ (chest - feet)
    quaternion = pin.Quaternion(world).coeffs()
    imu = ImuSample(quaternion, world.T @ (rate + own), world.T @ np.array([0.0, 0.0, 9.81]))
    wrench = np.array([0.0, 0.0, robot.mass * 9.81, 0.0, 0.0, 0.0])
    loads = {foot: wrench if foot == side else np.zeros(6) for foot in SIDES}
    return Measured(position, speed, imu, loads["left"], loads["right"], time)


def pushed(robot, plan, step, velocity):
    """Return the recovery from a speed of the CoM that a push gave in mid single support."""
    time = middle_of(plan, step)
    return time, recover(robot, plan, time, measured_at(robot, plan, time, velocity))


@pytest.mark.parametrize("step", STEPS)
def test_without_a_push_the_capture_point_is_that_of_the_plan(robot, ahead, step):
    """The estimate from joints and IMU is the reference's own, at any time of a step."""
    for part in (-0.2, 0.0, 0.2):
        time = middle_of(ahead, step) + part
        seen = watch(robot, ahead, time, measured_at(robot, ahead, time))
        assert seen.capture_point == pytest.approx(seen.planned, abs=2e-3)
        assert recover(robot, ahead, time, measured_at(robot, ahead, time)) is None


@pytest.mark.parametrize("gap", [0.01, 0.1, 0.2])
def test_measurements_that_are_lost_are_no_push(robot, ahead, gap):
    """The estimate goes on after a gap [s], in which the capture point has moved with the plan."""
    seen = None
    for time in np.arange(0.402, ahead.duration, gap):  # no phase begins there
        measured = measured_at(robot, ahead, time)
        seen = watch(robot, ahead, time, measured, before=seen)
        assert recover(robot, ahead, time, measured, seen=seen) is None


@pytest.mark.parametrize("direction", TILTS)
def test_a_turning_body_moves_the_capture_point_by_its_speed(robot, ahead, direction):
    """A speed v of the CoM moves it by v / w in the same direction, and a fifth more: the turn."""
    time, push = middle_of(ahead, 1), 0.3 * np.array(direction)
    still = watch(robot, ahead, time, measured_at(robot, ahead, time))
    moved = watch(robot, ahead, time, measured_at(robot, ahead, time, push))
    off = moved.capture_point - still.capture_point
    assert off == pytest.approx(1.2 * push / moved.com.frequency, abs=2e-3)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("direction", TILTS)
def test_a_changed_walk_joins_the_present_one_smoothly(robot, ahead, step, direction):
    """Positions, speeds and accelerations of all joints are those of the present reference."""
    _, found = pushed(robot, ahead, step, 0.25 * np.array(direction))
    assert found is not None
    here = ahead.knots.at(found.begin)
    for rows, now, limit in zip(found.plan.knots.at(0.0), here, (1e-6, 2e-3, 0.2), strict=True):
        assert rows == pytest.approx(now, abs=limit)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("direction", TILTS)
def test_a_changed_walk_ends_standing_within_every_limit(robot, far, ahead, step, direction):
    """The step keeps the robot's limits, the joints theirs, and the end is at rest on two feet."""
    time, found = pushed(robot, ahead, step, 0.25 * np.array(direction))
    plan = found.plan
    stance = ahead.phase_at(time).stance
    assert fits(far, stance, [found.landing.side], np.array([found.landing.pose]))
    assert np.all(plan.knots.position >= robot.lower - 1e-9)
    assert np.all(plan.knots.position <= robot.upper + 1e-9)
    assert plan.checks.speed_ratio.max() <= 1.0 + 1e-9
    assert np.abs(plan.knots.velocity[-1]).max() < 1e-3
    assert plan.final.at_rest
    for side in SIDES:
        q = robot.configuration(plan.motion.base[-1], plan.knots.position[-1],
                                plan.motion.base_yaw.angle[-1])
        place = robot.frame_position(q, robot.feet[side].frame)
        foot = plan.stance.foot(side)
        assert place == pytest.approx([foot.x, foot.y, 0.0], abs=1e-6)


@pytest.mark.parametrize("step", STEPS)
def test_the_foot_goes_where_the_robot_falls(robot, ahead, step):
    """A push to the swinging foot's side makes the step wider, and more so if it is stronger."""
    swing = ahead.phase_at(middle_of(ahead, step)).swing
    outward = 1.0 if swing == "left" else -1.0
    width = []
    for speed in (0.0, 0.15, 0.25):
        time, found = pushed(robot, ahead, step, (-0.15, outward * speed))
        standing = ahead.phase_at(time).stance.foot(other(swing))
        width.append(outward * found.landing.pose.seen_from(standing).y)
    assert width == sorted(width)
    assert width[-1] > width[0] + 0.03


def test_just_before_touchdown_the_step_is_left_as_it_is(robot, ahead):
    """A foot that is about to land is not moved elsewhere."""
    time = ahead.touchdown_of(1) - 0.1
    assert recover(robot, ahead, time, measured_at(robot, ahead, time, (0.0, 0.3))) is None


def test_a_walk_that_was_changed_is_left_alone_while_it_goes_as_expected(robot, ahead):
    """No second change without a second error, and one with it."""
    _, found = pushed(robot, ahead, 1, (0.1, -0.2))
    time = 0.03
    expected = found.capture_point(time)
    still = measured_at(robot, found.plan, time)
    seen = watch(robot, found.plan, time, still)
    as_expected = replace(seen, capture_point=expected)
    assert recover(robot, found.plan, time, still, previous=found, seen=as_expected) is None
    off = replace(seen, capture_point=expected + [0.0, 0.05])
    again = recover(robot, found.plan, time, still, previous=found, seen=off)
    assert again is not None
    assert again.passed > found.passed


def test_the_margin_of_a_landing_is_that_of_the_pendulum(robot, far, ahead):
    """Margin and capture point of every landing follow from the pendulum's own solution."""
    time = middle_of(ahead, 1)
    phase = ahead.phase_at(time)
    state = reference_at(robot, ahead, time, 0.75)
    swing = Swing(
        phase.swing, phase.stance.foot(other(phase.swing)), state.foot.value[:2],
        state.foot.speed[:2], state.foot.acceleration[:2], ahead.footsteps[1].pose, 0.35)
    point, w = state.com.value + [0.05, 0.02], 3.5
    found = landings(robot.config, swing, point, w)
    assert [one.cost for one in found] == sorted(one.cost for one in found)
    for one in found:
        end = one.zmp + (point - one.zmp) * math.exp(w * one.time)
        assert one.capture_point == pytest.approx(end, abs=1e-9)
        assert fits(far, phase.stance, [one.side], np.array([one.pose]))
