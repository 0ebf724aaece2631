"""The execution of a plan of one joint: its commands follow from measurements alone."""

from functools import cache

import numpy as np
import pytest
from humanoid_motion.driver_interface import Command
from humanoid_motion.knots import Knots, from_samples
from humanoid_motion.splice import concatenate, duration, without_first
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import InvalidRequest
from impact_planner.execution.execution import Execution
from impact_planner.execution.types import ExecutablePlan, ExecutionSettings, Outcome
from impact_planner.motion.post import path_time

SPEED = 0.4  # speed of the only joint during the run-up [rad/s]
CONTACT = 0.6  # time from the start of the run-up to the planned contact [s]
DELAY, SLOW, REST = 0.012, 0.01, 0.4  # durations of the motion after the hit [s]
STEADY = 0.05  # time before and after the planned contact with full speed [s]
OVERRUN, STOP = 0.12, 0.12  # time with full speed after the planned contact, then to rest [s]
RATIO = 0.15  # ratio of the speed after the hit to the speed before it
DESIRED = 0.36  # desired angle of the door [rad]
BACK = ExecutionSettings().goes_back + ExecutionSettings().back_from_miss
# Feet on stiff gears, which show the contact before the switch.
SETTINGS = ExecutionSettings(force_delay=0.0045)
CONTACT_FORCE = 100.0  # force of the floor in a contact [N]


def straight(start: float, end: float, length: float) -> Knots:
    """Knots of a joint that moves at constant speed."""
    speed = (end - start) / length
    return Knots(np.array([0.0, length / 2, length]),
                 np.array([[start], [(start + end) / 2], [end]]),
                 np.full((3, 1), speed), np.zeros((3, 1)))


def run_up() -> Knots:
    """Knots that reach the full speed within 0.2 s, pass the planned contact and come to rest."""
    time = np.array([0.0, 0.2, 0.45, CONTACT + OVERRUN])
    steady = Knots(time, SPEED * np.maximum(time - 0.1, 0.0)[:, None],
                   np.append(0.0, np.full(3, SPEED))[:, None], np.zeros((4, 1)))
    late = np.linspace(0.0, STOP, 25)
    way, rate, slope = path_time(late, 0.0, 1.0, STOP)
    stop, _ = from_samples(late, steady.position[-1] + SPEED * way[:, None],
                           SPEED * rate[:, None], SPEED * slope[:, None])
    return concatenate([steady, stop])


AFTER = float(run_up().at(CONTACT + DELAY)[0][0, 0]) + SPEED * (
    0.5 * SLOW * (1.0 + RATIO) + 0.5 * REST * RATIO)  # position at rest after a planned contact


def plan(**changes: Knots) -> ExecutablePlan:
    still = straight(0.0, 0.0, 1.0)
    phases = dict.fromkeys(("prepare", "shift", "step", "back"), still)
    phases["cam"] = run_up()
    phases["post"] = straight(AFTER, AFTER, 1.4)
    phases["hold"] = straight(AFTER, 0.5, 2.0)
    return ExecutablePlan(
        phases={**phases, **changes}, contact_time=CONTACT, steady_time=STEADY, switch_delay=DELAY,
        slow_down=SLOW, rest_duration=REST, post_ratio=RATIO, point_of_no_return=0.1,
        desired_angle=DESIRED, stop_duration=0.2)


class OneJoint:
    """The kinematics of the only joint, along which B moves towards the door."""

    def speed(self, _: np.ndarray, velocity: np.ndarray, rate: np.ndarray) -> float:
        return float(velocity[0] + rate[0])  # the only joint's speed and the gyro's rate

    def away_from_door(self, _: np.ndarray) -> np.ndarray:
        return np.array([0.0, 1.0, 0.0])


def started(phases: ExecutablePlan | None = None, **options: float) -> tuple[Execution, float]:
    """An execution that was started, and the time at which its run-up starts."""
    execution = Execution(phases or plan(), OneJoint(), SETTINGS, **options)
    command = execution.start(10.0)
    return execution, command.stamp + 4.0


@cache
def first() -> Command:
    """The first trajectory of an execution."""
    return Execution(plan(), OneJoint()).start(10.0)


def joints(execution: Execution, now: float, speed: float = SPEED, turn: float = 0.0) -> list:
    """A gyro and a joint state of the same tick, of a robot that follows its trajectory."""
    position = first().knots.at(now - first().stamp)[0][0]
    execution.on_imu(now, 0.0, np.array([turn, 0.0, 0.0]), None)
    return execution.on_joint_state(now, position, np.array([speed]))


def hit(execution: Execution, begin: float) -> list:
    """The feet show a contact."""
    joints(execution, begin)
    return execution.on_foot_forces(begin + SETTINGS.force_delay, CONTACT_FORCE)


def opened(execution: Execution, contact: float) -> float:
    """The door opens after a contact and turns round; returns when the next motion is sent."""
    hit(execution, contact)
    for now in np.arange(contact + 0.02, contact + 3.0, 0.01):
        since = now - contact
        if execution.on_door(now, 0.6 * since - 0.25 * since**2, 0.6 - 0.5 * since):
            return now
        joints(execution, now, 0.0)
    raise AssertionError("the peak was not detected")


def test_everything_up_to_the_end_of_the_run_up_goes_out_as_one_smooth_trajectory() -> None:
    command = Execution(plan(), OneJoint()).start(10.0)
    assert command.stamp == pytest.approx(10.0 + ExecutionSettings().lead)
    assert duration(command.knots) == pytest.approx(4.0 + CONTACT + OVERRUN + STOP + BACK)
    time = np.linspace(0.0, duration(command.knots), 3001)
    position = command.knots.at(time)[0]
    assert np.abs(np.diff(position[:, 0])).max() <= SPEED * (time[1] - time[0]) * 1.01
    assert not command.knots.velocity[-1].any()


@pytest.mark.parametrize("scale", [0.0, float("nan")])
def test_a_speed_scale_out_of_range_is_refused(scale: float) -> None:
    with pytest.raises(InvalidRequest, match="speed_scale"):
        Execution(plan(), OneJoint(), speed_scale=scale)


def test_a_plan_without_a_phase_is_refused() -> None:
    whole = plan()
    del whole.phases["post"]
    with pytest.raises(InvalidRequest, match="post"):
        ExecutablePlan(**vars(whole))


@given(late=st.floats(-STEADY, STEADY))
def test_a_contact_that_the_feet_show_sends_the_motion_after_the_hit(late: float) -> None:
    execution, cam = started()
    begin = cam + CONTACT + late
    (command,) = hit(execution, begin)
    assert execution.phase == "post"
    assert command.stamp == pytest.approx(begin + DELAY, abs=1e-9)
    run = run_up().at(command.stamp - cam)
    position, velocity, _ = command.knots.at(0.0)
    assert position[0, 0] == pytest.approx(run[0][0, 0], abs=1e-6)
    assert velocity[0, 0] == pytest.approx(SPEED, abs=1e-6)
    assert len(command.knots.time) <= 60
    assert command.knots.at(SLOW)[1][0, 0] == pytest.approx(RATIO * SPEED, abs=1e-6)
    assert duration(command.knots) == pytest.approx(SLOW + REST)
    assert not command.knots.velocity[-1].any()
    assert command.knots.position[-1, 0] - AFTER == pytest.approx(SPEED * late, abs=1e-6)


@given(late=st.floats(-STEADY, STEADY), share=st.floats(0.25, 0.95))
def test_a_contact_that_the_imu_shows_sends_the_motion_after_the_hit(
        late: float, share: float) -> None:
    """It began before the first reading that rises, by the share of the reading in the next."""
    execution, cam = started()
    begin = cam + CONTACT + late
    joints(execution, begin - 0.06)
    first = begin + share * 0.005
    for stamp in first - 0.005 * np.arange(8, 0, -1):
        assert execution.on_imu(stamp, 0.0, np.zeros(3), np.zeros(3)) == []
    assert execution.on_imu(first, 0.0, np.zeros(3), np.array([0.0, 20.0 * share, 0.0])) == []
    (command,) = execution.on_imu(first + 0.005, 0.0, np.zeros(3), np.array([0.0, 20.0, 0.0]))
    assert execution.measured.contact_sensor == "imu"
    assert execution.measured.contact_delay == pytest.approx(late, abs=1e-9)
    assert command.stamp == pytest.approx(
        max(begin + DELAY, first + 0.005 + SETTINGS.splice), abs=1e-9)


@pytest.mark.parametrize("late", [-0.07, 0.07])
def test_a_force_while_the_run_up_is_not_steady_is_no_contact(late: float) -> None:
    execution, cam = started()
    assert hit(execution, cam + CONTACT + late) == []
    assert execution.phase == "cam"
    assert np.isnan(execution.measured.contact_time)


@pytest.mark.parametrize("force_delay", [0.0045, 0.012])
def test_the_force_with_which_the_run_up_comes_to_rest_is_no_contact(force_delay: float) -> None:
    """However long the feet take to show a contact; recorded 16 ms after the steady part."""
    execution = Execution(plan(), OneJoint(), ExecutionSettings(force_delay=force_delay))
    cam = execution.start(10.0).stamp + 4.0
    joints(execution, cam + CONTACT + STEADY)
    assert execution.on_foot_forces(cam + CONTACT + STEADY + 0.016, 102.0) == []
    assert execution.phase == "cam"


def test_a_second_force_and_a_door_that_continues_to_move_change_nothing() -> None:
    execution, cam = started()
    hit(execution, cam + CONTACT)
    before = vars(execution.measured).copy()
    assert hit(execution, cam + CONTACT + 0.005) == []
    assert execution.on_door(cam + CONTACT + 0.01, 0.005, 0.6) == []
    of_the_door = {"omega_door", "peak_angle", "peak_time"}
    for name in set(before) - of_the_door:
        np.testing.assert_equal(getattr(execution.measured, name), before[name], name)


def test_a_contact_is_detected_by_the_door_alone() -> None:
    execution, cam = started()
    joints(execution, cam + CONTACT - 0.02)
    assert execution.on_door(cam + CONTACT - 0.02, 0.0, 0.14) == []
    (command,) = execution.on_door(cam + CONTACT - 0.01, 0.002, 0.16)
    assert command.stamp == pytest.approx(cam + CONTACT - 0.01 + DELAY)
    assert execution.measured.contact_delay == pytest.approx(-0.01)
    assert command.knots.position[0, 0] == pytest.approx(
        run_up().at(command.stamp - cam)[0][0, 0], abs=1e-6)


@pytest.mark.parametrize("late", [0.14, 0.3])
def test_a_door_that_is_hit_past_the_overrun_ends_at_rest_within_the_legs_reach(
        late: float) -> None:
    execution, cam = started()
    joints(execution, cam + CONTACT + late)
    (command,) = execution.on_door(cam + CONTACT + late, 0.0, 0.3)
    position, velocity, _ = command.knots.at(np.linspace(0.0, duration(command.knots), 200))
    end = run_up().position[-1, 0]
    start = run_up().at(min(command.stamp - cam, run_up().time[-1]))[0][0, 0]
    assert position[0, 0] == pytest.approx(start, abs=1e-6)
    assert position.max() <= end + 1e-6
    assert velocity[-1, 0] == pytest.approx(0.0, abs=1e-9)


def test_without_a_contact_the_run_up_comes_to_rest_and_the_robot_goes_back() -> None:
    execution, cam = started()
    end = cam + CONTACT + OVERRUN + STOP
    for now in np.arange(cam, end + ExecutionSettings().late, 0.01):
        assert joints(execution, now, 0.0) == []
        assert execution.on_foot_forces(now, 20.0) == []
        assert execution.on_door(now, 0.0, 0.0) == []
        assert execution.outcome is Outcome.RUNNING  # the door's angle may come late
    assert joints(execution, end + ExecutionSettings().late + 0.01, 0.0) == []
    assert (execution.phase, execution.outcome) == ("retreat", Outcome.RUNNING)
    execution.on_joint_state(end + BACK + 0.3, np.zeros(1), np.zeros(1))
    assert execution.outcome is Outcome.NO_CONTACT
    assert execution.reason.endswith("the robot went back from the door")


def test_the_arm_goes_out_on_the_doors_measured_peak_and_not_before() -> None:
    execution, cam = started()
    sent = opened(execution, cam + CONTACT) - (cam + CONTACT)
    assert sent == pytest.approx(1.2, abs=0.1)  # 0.6 - 0.5 t is 0, and the door falls a little
    assert execution.phase == "hold"
    assert execution.measured.peak_angle == pytest.approx(0.36, abs=0.001)
    assert execution.measured.peak_time == pytest.approx(1.2, abs=0.01)
    assert execution.measured.omega_door == pytest.approx(0.6, abs=0.02)


@pytest.mark.parametrize("late", [-0.04, 0.0, 0.03])
def test_the_hold_is_shifted_with_the_door(late: float) -> None:
    execution, cam = started()
    contact = cam + CONTACT + late
    (command,) = hit(execution, contact)
    rest = command.knots.position[-1, 0]
    hold = None
    for now in np.arange(contact + 0.02, contact + 3.0, 0.01):
        since = now - contact
        found = execution.on_door(now, 0.6 * since - 0.25 * since**2, 0.6 - 0.5 * since)
        hold = found[0].knots if found else hold
    planned = without_first(plan().phases["hold"])
    np.testing.assert_allclose(hold.position - planned.position, SPEED * late, atol=1e-6)
    assert rest - AFTER == pytest.approx(SPEED * late, abs=1e-6)
    np.testing.assert_array_equal(hold.velocity, planned.velocity)


@pytest.mark.parametrize(
    ("angles", "outcome"),
    [(np.full(40, DESIRED + 0.01), Outcome.SUCCESS),
     (np.full(40, DESIRED + 0.1), Outcome.NOT_HELD),
     (np.linspace(DESIRED - 0.1, DESIRED + 0.1, 30), Outcome.NOT_HELD)])
def test_a_door_is_held_where_it_stands_still_near_the_desired_angle(
        angles: np.ndarray, outcome: Outcome) -> None:
    execution, cam = started()
    end = opened(execution, cam + CONTACT) + 3.0
    joints(execution, end - 1.0)
    for number, angle in enumerate(angles):
        execution.on_door(end - 0.4 + 0.01 * number, angle, 0.0)
    execution.on_joint_state(end, np.array([0.5]), np.zeros(1))
    assert execution.outcome is outcome
    assert (outcome is Outcome.SUCCESS) == (execution.reason == "")


def test_a_force_and_a_moving_door_do_not_end_a_stop_of_the_run_up() -> None:
    execution, cam = started()
    joints(execution, cam + 0.45)
    execution.stop()
    (command,) = joints(execution, cam + 0.455)
    assert command.knots is not None
    assert execution.on_foot_forces(cam + CONTACT - 0.02, CONTACT_FORCE) == []
    assert execution.on_door(cam + CONTACT - 0.02, 0.01, 0.5) == []
    assert np.isnan(execution.measured.contact_time)


def test_a_stop_before_the_point_of_no_return_stops_and_after_it_completes_the_hit() -> None:
    execution, cam = started()
    joints(execution, cam + 0.3)
    execution.stop()
    (command,) = joints(execution, cam + 0.305)
    assert not command.knots.velocity[-1].any()  # a planned stop, not the driver's own stop
    begin = run_up().at(command.stamp - cam)
    np.testing.assert_allclose(command.knots.position[0], begin[0][0], atol=1e-6)
    np.testing.assert_allclose(command.knots.velocity[0], begin[1][0], atol=1e-6)
    execution.stop()
    assert execution.on_joint_state(cam + 0.4, command.knots.at(0.09)[0][0], np.zeros(1)) == []
    assert execution.outcome is Outcome.RUNNING
    execution.on_joint_state(cam + 0.6, command.knots.position[-1], np.zeros(1))
    assert execution.outcome is Outcome.STOPPED

    execution, cam = started()
    joints(execution, cam + CONTACT - 0.05)
    execution.stop()
    assert joints(execution, cam + CONTACT - 0.045) == []
    assert execution.outcome is Outcome.RUNNING


def test_it_ends_in_the_plans_retreat_which_can_be_stopped_again() -> None:
    back = straight(AFTER, 0.0, 1.2)
    for again in (False, True):
        execution, cam = started(plan(retreat=back))
        joints(execution, cam + CONTACT - 0.05)
        execution.stop()
        now = opened(execution, cam + CONTACT)
        assert execution.phase == "retreat"
        assert execution.outcome is Outcome.RUNNING
        if again:
            execution.stop()
        commands = joints(execution, now + 0.5, 0.0)
        assert [command.knots for command in commands] == ([None] if again else [])
        execution.on_joint_state(now + 2.0, np.zeros(1), np.zeros(1))
        assert execution.outcome is Outcome.STOPPED
        assert again or "back from the door" in execution.reason


def test_a_robot_that_does_not_follow_is_stopped_and_the_joint_named() -> None:
    execution, cam = started(joint_names=("ELBOW",))
    assert execution.on_joint_state(cam - 1.0, np.array([0.09]), np.zeros(1)) == []
    (command,) = execution.on_joint_state(cam - 0.9, np.array([0.11]), np.zeros(1))
    assert command.knots is None
    assert execution.outcome is Outcome.NOT_FOLLOWED
    assert "ELBOW is 0.110 rad" in execution.reason


def test_silence_stops_before_the_point_of_no_return_and_after_it_leaves_the_driver_alone() -> None:
    """Before the run-up the driver stops; the run-up slows down by the plan's own stop."""
    execution, cam = started()
    joints(execution, cam - 0.5)
    assert execution.on_silence(cam - 0.2, "/joint_states", 0.3, 0.25)[0].knots is None

    execution, cam = started()
    joints(execution, cam)
    (command,) = execution.on_silence(cam + 0.3, "/joint_states", 0.3, 0.25)
    assert not command.knots.velocity[-1].any()
    assert execution.on_silence(cam + 0.35, "/joint_states", 0.35, 0.25) == []
    assert execution.outcome is Outcome.STOPPED
    assert ("no message has arrived on /joint_states for 0.30 s, at most 0.25 s are allowed"
            in execution.reason)

    execution, cam = started()
    assert joints(execution, cam + CONTACT - 0.05) == []
    assert execution.on_silence(cam + CONTACT, "/imu", 0.3, 0.25) == []
    assert execution.outcome is Outcome.STOPPED


def test_a_falling_robot_is_stopped_once() -> None:
    execution, _ = started()
    assert execution.on_imu(11.0, 0.1, np.zeros(3), None) == []
    assert execution.on_imu(11.1, 0.6, np.zeros(3), None)[0].knots is None  # the driver's stop
    assert execution.outcome is Outcome.FELL
    assert "tilted by 34.4 deg, at most 30.0 deg are allowed" in execution.reason
    assert execution.on_imu(11.2, 0.7, np.zeros(3), None) == []


def test_after_its_end_an_execution_answers_no_event() -> None:
    execution, cam = started()
    execution.give_up("it was given up")
    assert joints(execution, cam + 0.1) == []
    assert execution.on_foot_forces(cam + CONTACT, CONTACT_FORCE) == []
    assert execution.on_door(cam + 0.1, 0.1, 1.0) == []
    assert execution.on_imu(cam + 0.1, 1.0, np.zeros(3), None) == []
    assert execution.on_silence(cam + 1.0, "/imu", 0.9, 0.5) == []
    execution.give_up("it was given up again")
    assert (execution.outcome, execution.reason) == (Outcome.STOPPED, "it was given up")


def test_the_speed_after_the_contact_is_the_mean_while_b_neither_trembles_nor_slows_down() -> None:
    execution, cam = started()
    hit(execution, cam + CONTACT)
    begin, end = ExecutionSettings().after_hit
    for number, since in enumerate(np.arange(0.002, end + 0.1, 0.005)):
        trembling = 0.3 * np.cos(300.0 * since) * (since < begin)
        uneven = 0.04 * (-1) ** number
        braking = -0.2 * (since > end)
        joints(execution, cam + CONTACT + since, 0.06 + trembling + uneven + braking)
        assert np.isnan(execution.measured.v_rb_post) == (since < begin)
    assert execution.measured.v_rb_post == pytest.approx(0.06, abs=0.01)
    assert execution.measured.v_rb == pytest.approx(SPEED)
