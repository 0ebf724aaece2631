"""The execution of the planner's own plan: its commands follow from measurements alone."""

from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.knots import TOLERANCE
from humanoid_motion.samples import NO_IMU, Measured
from humanoid_motion.splice import duration, without_first
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import InvalidRequest
from impact_planner.task.settings import PlannerSettings
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.settings import ExecutionSettings
from robot_driver.motion import Outcome

# Feet on stiff gears, which show the contact before the switch.
SETTINGS = ExecutionSettings(force_delay=0.0045)
FORCE = 150.0  # force of the floor in a contact [N]
LATE = (-1.0, 0.0, 1.0)  # delays of the contact, as shares of the steady time
OMEGA, BRAKE = 0.58, 0.387  # of the door after the hit [rad/s, rad/s^2]: 24.9 deg after 1.5 s
STILL, WRENCH = np.zeros(3), np.zeros(6)


def reading(force=0.0, tilt=0.0):
    """A tilt of the base [rad], and a specific force besides gravity [m/s^2]."""
    return tilt, np.array([0.0, 0.0, 9.8]) + force


def sample(position, velocity):
    """A complete sample of an upright trunk."""
    return Measured(position, velocity, NO_IMU, WRENCH, WRENCH, 0.0)


class Hit:
    """A run from its start; the robot is where the last trajectory has it."""

    def __init__(self, robot, plan, settings=SETTINGS):
        self.execution = Execution(plan, PointB(robot), settings, joint_names=robot.joint_names)
        self.sent = self.execution.start(10.0)
        self.plan, self.settings = plan, settings
        self.contact = self.execution.planned_contact
        self.cam = self.contact - plan.contact_time

    def took(self, now, commands):
        for command in commands:
            if command.knots is not None:
                self.sent = replace(command, stamp=command.stamp or now)
        return commands

    def joints(self, now, off=0.0):
        """What is measured in a tick."""
        position, velocity, _ = self.sent.knots.at(now - self.sent.stamp)
        self.execution.on_imu(now, *reading())
        commands = self.took(now, self.execution.on_joints(now, position[0] + off, velocity[0]))
        self.execution.on_measured(now, sample(position[0], velocity[0]))
        return commands

    def feet(self, begin, force=FORCE):
        """The feet show a contact."""
        self.joints(begin)
        now = begin + self.settings.force_delay
        return self.took(now, self.execution.on_wrenches(
            now, WRENCH, np.array([0.0, -force, 0.0, 0.0, 0.0, 0.0])))

    def door(self, now, angle, speed):
        return self.took(now, self.execution.on_door(now, angle, speed))

    def opened(self, begin):
        """The door opens and turns round after a contact; the time of the next command."""
        for now in np.arange(begin + 0.02, begin + 3.0, 0.01):
            since = now - begin
            if self.door(now, OMEGA * since - 0.5 * BRAKE * since**2, OMEGA - BRAKE * since):
                return now
            self.joints(now)
        raise AssertionError("the peak was not detected")


@pytest.fixture
def run(robot, good):
    """The nominal plan's run."""
    return Hit(robot, good)


def require_sound(robot, good, knots, times, slip):
    """Joints keep ranges and speeds, and the right sole its place from the left to `slip` [m]."""
    def apart(joints):
        q = robot.configuration(np.zeros(3), joints)
        (right, right_turn), (left, left_turn) = (
            robot.frame_pose(q, robot.feet[side].frame) for side in ("right", "left"))
        return np.append(left_turn.T @ (right - left), (left_turn.T @ right_turn).ravel())

    position, velocity, _ = knots.at(times)
    assert np.all((position >= robot.lower - TOLERANCE) & (position <= robot.upper + TOLERANCE))
    assert np.all(np.abs(velocity) <= robot.speed_limit)
    placed = apart(good.phases["post"].position[0])
    for joints in position:
        np.testing.assert_allclose(apart(joints), placed, atol=slip)


def test_the_first_trajectory_ends_in_the_run_up_backwards(robot, good, run):
    """All phases up to it are one motion; without a contact the driver itself goes back."""
    first, end = run.sent.knots.time[0], duration(run.sent.knots)
    knots = replace(run.sent.knots, time=run.sent.knots.time - first)
    assert run.sent.stamp + first == pytest.approx(10.0 + SETTINGS.lead)
    time = np.linspace(0.0, end, 3001)
    moved = np.abs(np.diff(knots.at(time)[0], axis=0))
    assert np.all(moved <= 1.01 * robot.speed_limit * time[1])
    back, cam = np.linspace(end - SETTINGS.back_from_miss, end, 200), good.phases["cam"]
    position, velocity, _ = knots.at(back)
    np.testing.assert_allclose(position[-1], cam.position[0], atol=1e-6)
    np.testing.assert_allclose(velocity[[0, -1]], 0.0, atol=1e-6)
    fastest = np.abs(cam.at(np.linspace(0.0, duration(cam), 200))[1]).max(axis=0)
    assert np.all(np.abs(velocity).max(axis=0) <= fastest + 1e-6)
    require_sound(robot, good, knots, back, 5e-4)


def test_a_speed_scale_of_0_and_a_plan_without_a_phase_are_refused(robot, good):
    with pytest.raises(InvalidRequest, match="speed_scale"):
        Execution(good, PointB(robot), speed_scale=0.0)
    with pytest.raises(InvalidRequest, match="post"):
        replace(good, phases={name: knots for name, knots in good.phases.items() if name != "post"})


def test_the_direction_away_from_the_door_hardly_turns_in_the_imus_frame(robot, good):
    """Across the steady part of the run-up, for which one direction is used."""
    point_b, cam = PointB(robot), good.phases["cam"]
    shares = good.contact_time + good.steady_time * np.linspace(-1.0, 1.0, 5)
    directions = [point_b.away_from_door(joints) for joints in cam.at(shares)[0]]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.min(directions @ directions[2]) > np.cos(np.radians(1.0))
    assert directions[2][1] > 0.99  # the IMU's y axis points to the left, and so away from it


# -- the contact ---------------------------------------------------------------------------------


@pytest.mark.parametrize("share", LATE)
def test_a_contact_that_the_feet_show_slows_the_run_up_down_and_leads_back(
        robot, plan, good, run, share):
    begin = run.contact + share * good.steady_time
    (command,) = run.feet(begin)
    assert run.feet(begin + 0.005) == run.door(begin + 0.01, 0.005, 0.6) == []  # once only
    assert run.execution.phase == "post"
    assert run.execution.measured.contact_time == pytest.approx(begin)
    assert command.stamp == pytest.approx(begin + PlannerSettings().switch_delay, abs=1e-9)
    before, after = good.phases["cam"].at(command.stamp - run.cam), command.knots.at(0.0)
    np.testing.assert_allclose(after[0], before[0], atol=1e-6)
    np.testing.assert_allclose(after[1], before[1], atol=1e-6)
    assert len(command.knots.time) <= 60
    for time, speed in ((0.0, plan.v_rb), (good.slow_down, plan.v_rb_post)):
        position, velocity, _ = command.knots.at(time)
        found = PointB(robot).speed(position[0], velocity[0], STILL)
        assert found == pytest.approx(speed, abs=4e-3)
    rest = good.slow_down + good.rest_duration
    require_sound(robot, good, command.knots, np.linspace(0.0, rest, 60), 5e-4)
    # Without a further command the robot goes back to where its run-up began. The soles move by
    # at most 0.8 mm while the shift of a door that stood elsewhere fades.
    back, end = duration(good.phases["post"]) + SETTINGS.goes_back, duration(command.knots)
    position, velocity, _ = command.knots.at([rest, back, end])
    np.testing.assert_allclose(velocity, 0.0, atol=1e-9)
    np.testing.assert_allclose(position[-1], good.phases["cam"].position[0], atol=1e-3)
    require_sound(robot, good, command.knots, np.linspace(back, end, 60), 1e-3)


@given(share=st.floats(-1.0, 1.0), part=st.floats(0.25, 0.95))
def test_a_contact_that_the_imu_shows_began_before_the_first_reading_that_rises(
        robot, good, share, part):
    """By the part of this reading in the next one; a late detection delays the switch."""
    run, late = Hit(robot, good), share * good.steady_time
    away = PointB(robot).away_from_door(good.phases["cam"].at(good.contact_time)[0][0])
    begin = run.contact + late
    run.joints(begin - 0.06)
    first = begin + part * 0.005
    for stamp in first - 0.005 * np.arange(8, 0, -1):
        assert run.execution.on_imu(stamp, *reading()) == []
    assert run.execution.on_imu(first, *reading(20.0 * part * away)) == []
    (command,) = run.execution.on_imu(first + 0.005, *reading(20.0 * away))
    assert run.execution.measured.contact_sensor == "imu"
    assert run.execution.measured.contact_delay == pytest.approx(late, abs=1e-9)
    assert command.stamp == pytest.approx(
        max(begin + good.switch_delay, first + 0.005 + SETTINGS.splice), abs=1e-9)


@pytest.mark.parametrize(("delay", "edge", "past"), [
    (0.0045, -1.0, -0.0155), (0.0045, 1.0, 0.016), (0.012, 1.0, 0.016)])
def test_a_force_while_the_run_up_is_not_steady_is_no_contact(robot, good, delay, edge, past):
    """However long the feet take; recorded 16 ms after the steady part as the run-up stops."""
    run = Hit(robot, good, ExecutionSettings(force_delay=delay))
    assert run.feet(run.contact + edge * good.steady_time + past - delay) == []
    assert run.execution.phase == "cam"
    assert np.isnan(run.execution.measured.contact_time)


@pytest.mark.parametrize("late", [0.06, 0.2])
def test_a_contact_far_from_the_planned_one_ends_within_the_joints_ranges(robot, good, run, late):
    """The hold is shifted no further than at the edge of the steady time."""
    begin = run.contact + late
    run.joints(begin)
    (command,) = run.door(begin, 0.02, 0.5)
    start = good.phases["cam"].at(command.stamp - run.cam)[0]
    np.testing.assert_allclose(command.knots.position[:1], start, atol=1e-6)
    run.door(begin + 1.0, good.desired_angle, 0.1)
    (hold,) = run.door(begin + 1.1, good.desired_angle - 0.01, -0.1)
    assert run.execution.phase == "hold"
    for knots in (command.knots, hold.knots):
        assert np.all(knots.position >= robot.lower - TOLERANCE)
        assert np.all(knots.position <= robot.upper + TOLERANCE)


def test_without_a_contact_the_robot_goes_back(good, run):
    end = run.cam + duration(good.phases["cam"])
    for now in np.arange(run.cam, end + SETTINGS.late, 0.01):
        assert run.feet(now, 20.0) == []
        assert run.door(now, 0.0, 0.0) == []
        assert run.execution.outcome is Outcome.RUNNING  # the door's angle may come late
    assert run.joints(end + SETTINGS.late + 0.01) == []
    assert (run.execution.phase, run.execution.outcome) == ("retreat", Outcome.RUNNING)
    run.joints(run.sent.stamp + run.sent.knots.time[-1] + 0.3)
    assert run.execution.outcome is Outcome.NO_CONTACT


def test_the_speed_after_the_contact_is_the_mean_while_b_neither_trembles_nor_slows_down(
        robot, good, run):
    run.feet(run.contact)
    begin, end = SETTINGS.after_hit
    position, velocity, _ = good.phases["cam"].at(good.contact_time)
    speed = PointB(robot).speed(position[0], velocity[0], STILL)
    for number, since in enumerate(np.arange(0.002, end + 0.1, 0.005)):
        wanted = 0.06 + 0.3 * np.cos(300.0 * since) * (since < begin) - 0.2 * (since > end)
        wanted += 0.04 * (-1) ** number  # uneven
        run.execution.on_measured(
            run.contact + since, sample(position[0], wanted / speed * velocity[0]))
        assert np.isnan(run.execution.measured.v_rb_post) == (since < begin)
    assert run.execution.measured.v_rb_post == pytest.approx(0.06, abs=0.01)
    assert run.execution.measured.v_rb == pytest.approx(speed, rel=0.01)


# -- the door's peak and the ending --------------------------------------------------------------


@pytest.mark.parametrize("share", LATE)
def test_the_arm_goes_out_on_the_doors_measured_peak_and_is_shifted_with_the_door(
        robot, good, run, share):
    """The soles move by at most 0.7 mm, which makes 35 N on rubber of 1e5 N/m."""
    contact = run.contact + share * good.steady_time
    (command,) = run.feet(contact)
    assert run.opened(contact) - contact == pytest.approx(OMEGA / BRAKE, abs=0.1)
    found = run.execution.measured
    assert run.execution.phase == "hold"
    assert found.peak_angle == pytest.approx(0.5 * OMEGA**2 / BRAKE, abs=0.001)
    assert found.peak_time == pytest.approx(OMEGA / BRAKE, abs=0.01)
    assert found.omega_door == pytest.approx(OMEGA, abs=0.02)
    hold, planned = run.sent.knots, without_first(good.phases["hold"])
    rest = command.knots.at(good.slow_down + good.rest_duration)[0]
    shifted = planned.position + rest - good.phases["post"].position[-1]
    np.testing.assert_allclose(hold.position, shifted, atol=1e-6)
    np.testing.assert_array_equal(hold.velocity, planned.velocity)
    require_sound(robot, good, hold, hold.time, 7e-4)


@pytest.mark.parametrize(("first", "last", "caught", "outcome"), [
    (0.01, 0.01, False, Outcome.SUCCESS), (0.1, 0.1, False, Outcome.NOT_HELD),
    (0.1, 0.1, True, Outcome.SUCCESS), (-0.1, 0.1, False, Outcome.NOT_HELD),
    (-0.1, 0.1, True, Outcome.NOT_HELD)])
def test_a_door_is_held_where_it_stands_still_near_the_angle_to_which_it_is_pushed(
        robot, good, first, last, caught, outcome):
    """A leaf that stays where it was caught may do so at another angle than planned."""
    run = Hit(robot, replace(good, held_angle=good.desired_angle - 0.2 * caught))
    run.feet(run.contact)
    run.opened(run.contact)
    end = run.sent.stamp + duration(run.sent.knots) + 1.0
    run.joints(end - 1.0)
    for number, off in enumerate(np.linspace(first, last, 30)):
        run.door(end - 0.4 + 0.01 * number, good.desired_angle + off, 0.0)
    run.joints(end)
    assert run.execution.outcome is outcome
    assert (outcome is Outcome.SUCCESS) == (run.execution.reason == "")


@pytest.mark.parametrize("stop", [False, True])
def test_a_door_that_does_not_turn_round_ends_in_the_retreat(run, stop):
    """The robot does not wait for ever if the encoder is stuck or the door stays open."""
    run.feet(run.contact)
    if stop:
        run.execution.stop()
    for now in np.arange(run.contact + 0.1, run.contact + 2.5, 0.1):
        assert run.joints(now) == []
        run.door(now, 0.0, 0.0)
    assert run.execution.phase == "retreat"
    assert not run.execution.turned_round
    run.joints(now + 5.0)
    assert run.execution.outcome is Outcome.NOT_HELD


def test_an_angle_of_the_door_with_the_stamp_of_another_clock_changes_nothing(run):
    run.feet(run.contact)
    run.door(run.contact + 0.05, 0.03, 0.6)
    assert run.door(run.contact + 50.0, 0.0, 0.0) == []
    assert run.execution.phase == "post"
    assert run.execution.door_angle == run.execution.measured.peak_angle == 0.03


@pytest.mark.parametrize(("off", "lag", "phase"), [
    (0.0, 0.05, "hold"), (0.0, 0.2, "retreat"), (-10.0, 0.0, "retreat"), (15.0, 0.0, "retreat")])
def test_a_door_that_the_arm_would_strike_is_not_caught(good, run, off, lag, phase):
    """Its peak was noticed late (0.2 s: 258 N on the hand), or is far from the desired angle."""
    run.feet(run.contact)
    peak = good.desired_angle + np.radians(off)
    run.door(run.contact + 1.4, peak, 0.0)
    run.execution.lags(lag)
    assert len(run.door(run.contact + 1.5, peak - 0.01, -0.1)) == 1
    assert run.execution.phase == phase
    if phase == "retreat":
        assert run.joints(run.contact + 6.0) == []
        assert run.execution.outcome is Outcome.NOT_HELD
        assert ("at most 0.1 s" if lag else f"{np.degrees(peak):.1f}") in run.execution.reason


@pytest.mark.parametrize(("lag", "by"), [(0.11, "feet"), (5.0, "door")])
def test_a_contact_that_is_noticed_too_late_sends_nothing(run, lag, by):
    """The driver brings the run-up to rest and the robot back by itself."""
    run.joints(run.contact)
    run.execution.lags(lag)
    sent = run.feet(run.contact) if by == "feet" else run.door(run.contact + 0.02, 0.01, 0.4)
    assert sent == []
    assert run.execution.phase == "retreat"
    run.joints(run.sent.stamp + duration(run.sent.knots) + 1.0)
    assert run.execution.outcome is Outcome.NOT_HELD
    assert f"{lag:.2f} s" in run.execution.reason


# -- stops and other ends ------------------------------------------------------------------------


def test_a_stop_of_the_run_up_is_the_plans_own_and_nothing_ends_it(good, run):
    """It leaves the run-up where it is; a force and a moving door do not matter any more."""
    run.joints(run.cam + 0.2)
    run.execution.stop()
    (command,) = run.joints(run.cam + 0.205)
    begin = good.phases["cam"].at(command.stamp - run.cam)
    np.testing.assert_allclose(command.knots.position[:1], begin[0], atol=1e-6)
    np.testing.assert_allclose(command.knots.velocity[:1], begin[1], atol=1e-6)
    assert not command.knots.velocity[-1].any()
    run.execution.stop()
    assert run.feet(run.cam + 0.4) == []
    assert run.door(run.cam + 0.41, 0.01, 0.5) == []
    assert np.isnan(run.execution.measured.contact_time)
    assert run.execution.outcome is Outcome.RUNNING
    run.joints(command.stamp + duration(command.knots) + 0.1)
    assert run.execution.outcome is Outcome.STOPPED


@pytest.mark.parametrize(("before", "lag", "stops"), [
    (0.05, 0.0, True), (0.05, 0.2, False), (-0.05, 0.0, False)])
def test_a_stop_past_the_point_of_no_return_sends_nothing(good, run, before, lag, stops):
    """Judged by the present, and not by the stamp of an old joint state."""
    run.execution.stop()
    run.execution.lags(lag)
    sent = run.joints(run.contact - good.point_of_no_return - before)
    assert bool(sent) is stops
    assert run.execution.outcome is Outcome.RUNNING


@pytest.mark.parametrize("again", [False, True])
def test_such_a_stop_ends_in_the_plans_retreat_which_can_be_stopped_again(run, again):
    run.joints(run.contact - 0.05)
    run.execution.stop()
    run.feet(run.contact)
    now = run.opened(run.contact)
    assert (run.execution.phase, run.execution.outcome) == ("retreat", Outcome.RUNNING)
    if again:
        run.execution.stop()
    assert [command.knots for command in run.joints(now + 0.5)] == ([None] if again else [])
    run.joints(now + 5.0)
    assert run.execution.outcome is Outcome.STOPPED
    assert again or "back from the door" in run.execution.reason


def test_a_robot_that_does_not_follow_is_no_success_and_the_joint_named(robot, good, run):
    """It is stopped before the run-up; after the hit it is judged at the end."""
    off = np.zeros(len(robot.joint_names))
    for error, sent in ((0.09, 0), (0.11, 1)):
        off[robot.config.index("RARM_JOINT3")] = error
        assert len(run.joints(run.cam - 1.0 + error, off)) == sent
    late = Hit(robot, good)
    late.feet(late.contact)
    late.opened(late.contact)
    late.joints(late.contact + 20.0, off)
    for each in (run, late):
        assert each.execution.outcome is Outcome.NOT_FOLLOWED
        assert "RARM_JOINT3 is 0.110 rad" in each.execution.reason


def test_silence_stops_before_the_point_of_no_return_and_after_it_leaves_the_driver_alone(
        robot, good):
    """Before the run-up the driver stops; the run-up slows down by the plan's own stop."""
    early, middle, late = (Hit(robot, good) for _ in range(3))
    early.joints(early.cam - 0.5)
    assert early.execution.on_silence(early.cam - 0.2, "joint_states", 0.3, 0.25)[0].knots is None

    middle.joints(middle.cam)
    (command,) = middle.execution.on_silence(middle.cam + 0.2, "joint_states", 0.3, 0.25)
    assert not command.knots.velocity[-1].any()
    assert middle.execution.on_silence(middle.cam + 0.25, "joint_states", 0.35, 0.25) == []
    assert middle.execution.outcome is Outcome.STOPPED
    assert "joint_states for 0.30 s, at most 0.25 s" in middle.execution.reason

    assert late.joints(late.contact - 0.05) == []
    assert late.execution.on_silence(late.contact, "imu", 0.3, 0.25) == []
    assert late.execution.outcome is Outcome.STOPPED


def test_a_falling_robot_is_stopped_and_no_further_event_is_answered(run):
    assert run.execution.on_imu(11.0, *reading(tilt=0.1)) == []
    assert run.execution.on_imu(11.1, *reading(tilt=0.6))[0].knots is None  # the driver's stop
    assert run.execution.outcome is Outcome.FELL
    assert "34.4 deg, at most 30.0 deg" in run.execution.reason
    assert run.execution.on_imu(11.2, *reading(tilt=0.7)) == []
    assert run.feet(run.contact) == []
    assert run.door(run.contact + 0.1, 0.1, 1.0) == []
    assert run.execution.on_silence(run.contact + 1.0, "imu", 0.9, 0.5) == []
    run.execution.give_up("it was given up")
    assert run.execution.outcome is Outcome.FELL
