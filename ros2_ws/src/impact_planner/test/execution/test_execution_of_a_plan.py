"""The execution of the planner's own plan of the paper's door, on HRP-2's joints."""

import numpy as np
import pytest
from humanoid_motion.knots import TOLERANCE
from humanoid_motion.splice import duration
from impact_planner.execution.execution import Execution
from impact_planner.execution.point_b import PointB
from impact_planner.execution.types import ExecutablePlan, ExecutionSettings, Outcome
from impact_planner.task.settings import PlannerSettings

# Feet on stiff gears, which show the contact before the switch.
SETTINGS = ExecutionSettings(force_delay=0.0045)
FORCE = 150.0  # force of the floor in a contact [N]
LATE = (-1.0, 0.0, 1.0)  # delays of the contact, as shares of the steady time


@pytest.fixture(scope="module")
def good(plan) -> ExecutablePlan:
    """The nominal plan, ready for an execution."""
    return ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases})


def hit(robot, good, share):
    """An execution after a contact, the times of run-up and contact, and the new trajectory."""
    execution = Execution(good, PointB(robot), SETTINGS)
    command = execution.start(0.0)
    cam = command.stamp + sum(
        duration(good.phases[name]) for name in ("prepare", "shift", "step", "back"))
    begin = cam + good.contact_time + share * good.steady_time
    position, velocity, _ = command.knots.at(begin - command.stamp)
    execution.on_joint_state(begin, position[0], velocity[0])
    (splice,) = execution.on_foot_forces(begin + SETTINGS.force_delay, FORCE)
    return execution, cam, begin, splice


def soles_apart(robot, joints):
    """Position and rotation of the right sole in the frame of the left sole."""
    q = robot.configuration(np.zeros(3), joints)
    (right, right_turn), (left, left_turn) = (
        robot.frame_pose(q, robot.feet[side].frame) for side in ("right", "left"))
    return np.append(left_turn.T @ (right - left), (left_turn.T @ right_turn).ravel())


def test_the_direction_away_from_the_door_hardly_turns_in_the_imus_frame(robot, good):
    """Across the steady part of the run-up, for which one direction is used."""
    point_b, cam = PointB(robot), good.phases["cam"]
    shares = good.contact_time + good.steady_time * np.linspace(-1.0, 1.0, 5)
    directions = [point_b.away_from_door(joints) for joints in cam.at(shares)[0]]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.min(directions @ directions[2]) > np.cos(np.radians(1.0))
    assert directions[2][1] > 0.99  # the IMU's y axis points to the left, and so away from it


@pytest.mark.parametrize("share", LATE)
def test_the_motion_after_the_hit_leaves_the_run_up_where_it_is(robot, good, share):
    _, cam, begin, splice = hit(robot, good, share)
    assert splice.stamp == pytest.approx(begin + PlannerSettings().switch_delay, abs=1e-9)
    run, after = good.phases["cam"].at(splice.stamp - cam), splice.knots.at(0.0)
    np.testing.assert_allclose(after[0], run[0], atol=1e-6)
    np.testing.assert_allclose(after[1], run[1], atol=1e-6)
    assert len(splice.knots.time) <= 60


@pytest.mark.parametrize("share", LATE)
def test_the_motion_after_the_hit_keeps_ranges_speeds_and_soles_and_comes_to_rest(
        robot, good, share):
    _, _, _, splice = hit(robot, good, share)
    to_rest = good.slow_down + good.rest_duration
    position, velocity, _ = splice.knots.at(np.linspace(0.0, to_rest, 60))
    assert np.all((position >= robot.lower - TOLERANCE) & (position <= robot.upper + TOLERANCE))
    assert np.all(np.abs(velocity) <= robot.speed_limit)
    np.testing.assert_allclose(velocity[-1], 0.0, atol=1e-9)
    placed = soles_apart(robot, good.phases["post"].position[0])
    for joints in position:
        np.testing.assert_allclose(soles_apart(robot, joints), placed, atol=5e-4)


@pytest.mark.parametrize("share", LATE)
def test_without_a_further_command_the_robot_goes_back_to_where_its_run_up_began(
        robot, good, share):
    """The soles move by at most 0.8 mm while the shift of a door that stood elsewhere fades."""
    _, _, _, splice = hit(robot, good, share)
    begin = duration(good.phases["post"]) + ExecutionSettings().goes_back
    position, velocity, _ = splice.knots.at(np.linspace(begin, duration(splice.knots), 60))
    assert np.all((position >= robot.lower - TOLERANCE) & (position <= robot.upper + TOLERANCE))
    assert np.all(np.abs(velocity) <= robot.speed_limit)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(position[-1], good.phases["cam"].position[0], atol=1e-3)
    placed = soles_apart(robot, good.phases["post"].position[0])
    for joints in position:
        np.testing.assert_allclose(soles_apart(robot, joints), placed, atol=1e-3)


def test_after_a_missed_contact_the_driver_takes_the_robot_back_by_itself(robot, good):
    """The end of the first trajectory is the run-up backwards, at less than its speed."""
    command = Execution(good, PointB(robot), SETTINGS).start(0.0)
    end = duration(command.knots)
    position, velocity, _ = command.knots.at(
        np.linspace(end - ExecutionSettings().back_from_miss, end, 200))
    np.testing.assert_allclose(position[-1], good.phases["cam"].position[0], atol=1e-6)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=1e-6)
    path = good.phases["cam"]
    fastest = np.abs(path.at(np.linspace(0.0, duration(path), 200))[1]).max(axis=0)
    assert np.all(np.abs(velocity).max(axis=0) <= fastest + 1e-6)
    placed = soles_apart(robot, position[0])
    for joints in position:
        np.testing.assert_allclose(soles_apart(robot, joints), placed, atol=5e-4)


@pytest.mark.parametrize("share", LATE)
def test_the_hold_keeps_soles_and_ranges_wherever_the_door_stood(robot, good, share):
    """The soles move by at most 0.7 mm, which makes 35 N on rubber of 1e5 N/m."""
    execution, _, begin, _ = hit(robot, good, share)
    execution.on_door(begin + 1.0, 0.4, 0.1)
    (command,) = execution.on_door(begin + 1.1, 0.39, -0.1)
    placed = soles_apart(robot, good.phases["hold"].position[0])
    for joints in command.knots.position:
        np.testing.assert_allclose(soles_apart(robot, joints), placed, atol=7e-4)
    assert np.all(command.knots.position >= robot.lower - TOLERANCE)
    assert np.all(command.knots.position <= robot.upper + TOLERANCE)


def test_speed_of_b_is_the_plan_s_before_the_hit_and_after_it(robot, plan, good):
    speed = PointB(robot).speed
    still = np.zeros(3)
    position, velocity, _ = good.phases["cam"].at(good.contact_time)
    assert speed(position[0], velocity[0], still) == pytest.approx(plan.v_rb, rel=2e-3)
    position, velocity, _ = good.phases["post"].at(good.slow_down)
    assert speed(position[0], velocity[0], still) == pytest.approx(plan.v_rb_post, abs=4e-3)


def stand(execution, now, knots):
    """A joint state of a robot that stands where a trajectory ends."""
    return execution.on_joint_state(now, knots.position[-1], np.zeros(30))


@pytest.mark.parametrize("off", [-10.0, 15.0])
def test_a_door_that_opened_far_too_little_or_too_far_is_not_caught(robot, good, off):
    """The arm would strike the door, so that the robot goes back and names the angle."""
    execution, _, begin, _ = hit(robot, good, 0.0)
    peak = good.desired_angle + np.radians(off)
    execution.on_door(begin + 1.0, peak, 0.1)
    (command,) = execution.on_door(begin + 1.1, peak - 0.01, -0.1)
    assert execution.phase == "retreat"
    assert stand(execution, begin + 6.0, command.knots) == []
    assert execution.outcome is Outcome.NOT_HELD
    assert f"opened to {np.degrees(peak):.1f} deg" in execution.reason
    assert execution.turned_round


@pytest.mark.parametrize("stop", [False, True])
def test_a_door_that_does_not_turn_round_ends_in_the_retreat(robot, good, stop):
    """The robot does not wait for ever if the encoder is stuck or the door stays open."""
    execution, _, begin, splice = hit(robot, good, 0.0)
    if stop:
        execution.stop()
    for now in np.arange(begin + 0.1, begin + 2.5, 0.1):
        position = splice.knots.at(now - splice.stamp)[0][0]
        assert execution.on_joint_state(now, position, np.zeros(30)) == []
        execution.on_door(now, 0.0, 0.0)
    assert execution.phase == "retreat"
    assert not execution.turned_round
    stand(execution, now + 5.0, splice.knots)
    assert execution.outcome is Outcome.NOT_HELD
    assert "turn round" in execution.reason


def test_an_ending_that_the_driver_does_not_follow_is_no_success(robot, good):
    execution, _, begin, splice = hit(robot, good, 0.0)
    execution.on_door(begin + 1.0, good.desired_angle, 0.1)
    execution.on_door(begin + 1.1, good.desired_angle - 0.01, -0.1)
    stand(execution, begin + 20.0, splice.knots)
    assert execution.outcome is Outcome.NOT_FOLLOWED
    assert "where the hold ends" in execution.reason


@pytest.mark.parametrize(
    ("later", "angle", "velocity"),
    [(0.03, np.nan, 0.5), (-0.01, 0.0, 0.0), (50.0, 0.0, 0.0)])
def test_an_angle_of_the_door_that_makes_no_sense_changes_nothing(
        robot, good, later, angle, velocity):
    """It is no number, older than the last angle, or has the stamp of another clock."""
    execution, _, begin, _ = hit(robot, good, 0.0)
    execution.on_door(begin + 0.05, 0.03, 0.6)
    assert execution.on_door(begin + 0.05 + later, angle, velocity) == []
    assert execution.phase == "post"
    assert execution.door_angle == 0.03
    assert execution.measured.peak_angle == 0.03


@pytest.mark.parametrize(("lag", "phase"), [(0.05, "hold"), (0.2, "retreat")])
def test_a_peak_that_is_noticed_too_late_sends_the_robot_back(robot, good, lag, phase):
    """The arm would meet the leaf too low: with 0.2 s the hand strikes it with 258 N."""
    execution, _, begin, _ = hit(robot, good, 0.0)
    execution.on_door(begin + 1.4, good.desired_angle, 0.0)
    execution.lags(lag)
    (command,) = execution.on_door(begin + 1.5, good.desired_angle - 0.01, -0.1)
    assert execution.phase == phase
    if phase == "retreat":
        stand(execution, begin + 6.0, command.knots)
        assert execution.outcome is Outcome.NOT_HELD
        assert "0.18 s later than the hold allows for, at most 0.1 s" in execution.reason


@pytest.mark.parametrize(("lag", "by"), [(0.11, "feet"), (5.0, "door")])
def test_a_contact_that_is_noticed_too_late_sends_nothing(robot, good, lag, by):
    """The driver brings the run-up to rest and the robot back by itself."""
    execution = Execution(good, PointB(robot), SETTINGS)
    command = execution.start(0.0)
    begin = execution.planned_contact
    position, velocity, _ = command.knots.at(begin - command.stamp)
    execution.on_joint_state(begin, position[0], velocity[0])
    execution.lags(lag)
    sent = (execution.on_foot_forces(begin + SETTINGS.force_delay, FORCE)
            if by == "feet" else execution.on_door(begin + 0.02, 0.01, 0.4))
    assert sent == []
    assert execution.phase == "retreat"
    stand(execution, command.stamp + duration(command.knots) + 1.0, command.knots)
    assert execution.outcome is Outcome.NOT_HELD
    assert f"noticed {lag:.2f} s late" in execution.reason


def test_a_stop_is_judged_by_the_present_and_not_by_the_stamp_of_an_old_message(robot, good):
    """A joint state from before the point of no return is handled after it: nothing is sent."""
    for lag, stops in ((0.0, True), (0.2, False)):
        execution = Execution(good, PointB(robot), SETTINGS)
        command = execution.start(0.0)
        now = execution.planned_contact - good.point_of_no_return - 0.05
        execution.stop()
        execution.lags(lag)
        position, velocity, _ = command.knots.at(now - command.stamp)
        assert bool(execution.on_joint_state(now, position[0], velocity[0])) is stops


@pytest.mark.parametrize("late", [0.06, 0.2])
def test_a_contact_far_from_the_planned_one_ends_within_the_joints_ranges(robot, good, late):
    """The door shows it; the hold is shifted no further than at the edge of the steady time."""
    execution, cam, _, _ = hit(robot, good, 1.0)
    execution = Execution(good, PointB(robot), SETTINGS)
    command = execution.start(0.0)
    begin = cam + good.contact_time + late
    position, velocity, _ = command.knots.at(begin - command.stamp)
    execution.on_joint_state(begin, position[0], velocity[0])
    assert execution.on_door(begin, 0.02, 0.5)
    execution.on_door(begin + 1.0, good.desired_angle, 0.1)
    (command,) = execution.on_door(begin + 1.1, good.desired_angle - 0.01, -0.1)
    assert execution.phase == "hold"
    assert np.all(command.knots.position >= robot.lower - TOLERANCE)
    assert np.all(command.knots.position <= robot.upper + TOLERANCE)
