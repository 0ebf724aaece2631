"""The execution: what is sent when, told by joint states and door angles alone."""

import numpy as np
import pytest
from impact_planner.errors import InvalidRequest
from impact_planner.execution import ExecutablePlan, Execution, ExecutionSettings, Outcome
from impact_planner.knots import Knots
from impact_planner.splice import concatenate, cut, duration, slowed, without_first

SPEED = 0.4  # of the only joint during the run-up [rad/s]
CONTACT, SWITCH = 0.6, 0.598
DESIRED = 0.36


def straight(start: float, end: float, length: float) -> Knots:
    """A joint that moves at constant speed."""
    speed = (end - start) / length
    return Knots(np.array([0.0, length / 2, length]),
                 np.array([[start], [(start + end) / 2], [end]]),
                 np.full((3, 1), speed), np.zeros((3, 1)))


def run_up() -> Knots:
    """From rest to the constant speed within 0.2 s, then 0.5 s of it."""
    time = np.array([0.0, 0.2, 0.45, 0.7])
    position = SPEED * np.maximum(time - 0.1, 0.0)
    velocity = np.array([0.0, SPEED, SPEED, SPEED])
    return Knots(time, position[:, None], velocity[:, None], np.zeros((4, 1)))


def plan(**changes: Knots) -> ExecutablePlan:
    still = straight(0.0, 0.0, 1.0)
    phases = dict.fromkeys(("prepare", "shift", "step", "back"), still)
    phases["cam"] = run_up()
    phases["post"] = straight(SPEED * (SWITCH - 0.1), SPEED * (SWITCH - 0.1), 1.4)
    phases["hold"] = straight(SPEED * (SWITCH - 0.1), 0.5, 2.0)
    return ExecutablePlan({**phases, **changes}, CONTACT, SWITCH, 0.15, 0.1, DESIRED, 0.2)


def started(**options: float) -> tuple[Execution, float]:
    """An execution and the time at which its run-up starts."""
    execution = Execution(plan(), lambda position, velocity: float(velocity[0]), **options)
    command = execution.start(10.0)
    return execution, command.stamp + 4.0


def joints(execution: Execution, now: float, speed: float = SPEED) -> list:
    """A robot where it was sent."""
    sent = Execution(plan(), lambda *_: 0.0).start(10.0)
    position = sent.knots.at(now - sent.stamp)[0][0]
    return execution.on_joint_state(now, position, np.array([speed]))


def opened(execution: Execution, contact: float) -> float:
    """The door opens from a planned contact and turns round; when the arm is told."""
    joints(execution, contact + 0.001)
    for now in np.arange(contact + 0.02, contact + 3.0, 0.01):
        since = now - contact
        if execution.on_door(now, 0.6 * since - 0.25 * since**2, 0.6 - 0.5 * since):
            return now
        joints(execution, now, 0.0)
    raise AssertionError("the peak was not noticed")


def test_everything_up_to_the_peak_goes_out_as_one_smooth_trajectory() -> None:
    command = Execution(plan(), lambda *_: 0.0).start(10.0)
    assert command.stamp == pytest.approx(10.0 + ExecutionSettings().lead)
    assert duration(command.knots) == pytest.approx(4.0 + SWITCH + 1.4)
    time = np.linspace(0.0, 6.0, 3001)
    position = command.knots.at(time)[0]
    assert np.abs(np.diff(position[:, 0])).max() <= SPEED * 0.002 * 1.01


def test_speed_scale_slows_the_preparation_and_leaves_the_run_up_alone() -> None:
    command = Execution(plan(), lambda *_: 0.0, speed_scale=0.5).start(10.0)
    assert duration(command.knots) == pytest.approx(8.0 + SWITCH + 1.4)
    assert command.knots.at(8.3)[1][0, 0] == pytest.approx(SPEED)


@pytest.mark.parametrize("scale", [0.0, -1.0, 1.5, float("nan")])
def test_a_speed_scale_out_of_range_is_refused(scale: float) -> None:
    with pytest.raises(InvalidRequest, match="speed_scale"):
        Execution(plan(), lambda *_: 0.0, speed_scale=scale)


def test_a_plan_without_hold_is_refused() -> None:
    whole = plan()
    phases = {name: knots for name, knots in whole.phases.items() if name != "hold"}
    with pytest.raises(InvalidRequest, match="hold"):
        Execution(ExecutablePlan(phases, CONTACT, SWITCH, 0.15, 0.1, DESIRED, 0.2), lambda *_: 0.0)


def test_the_arm_goes_out_on_the_doors_measured_peak_and_not_before() -> None:
    execution, cam = started()
    told = opened(execution, cam + CONTACT) - (cam + CONTACT)
    assert told == pytest.approx(1.2, abs=0.1)  # where 0.6 - 0.5 t is 0, and a little fall
    assert execution.phase == "hold"
    assert execution.measured.peak_angle == pytest.approx(0.36, abs=0.001)


@pytest.mark.parametrize(
    ("angles", "outcome"),
    [(np.full(40, DESIRED + 0.01), Outcome.SUCCESS),
     (np.full(40, DESIRED + 0.1), Outcome.NOT_HELD),
     (np.linspace(DESIRED - 0.1, DESIRED + 0.1, 30), Outcome.NOT_HELD)])
def test_a_door_is_held_where_it_stands_still_near_the_desired_angle(
        angles: np.ndarray, outcome: Outcome) -> None:
    execution, cam = started()
    end = opened(execution, cam + CONTACT) + 3.0
    for angle in angles:
        execution.on_door(end, angle, 0.0)
    joints(execution, end)
    assert execution.outcome is outcome
    assert (outcome is Outcome.SUCCESS) == (execution.reason == "")


def test_a_planned_contact_sends_nothing_more() -> None:
    execution, cam = started()
    joints(execution, cam + CONTACT + 0.001)
    assert execution.on_door(cam + CONTACT + 0.02, 0.01, 0.6) == []
    assert execution.measured.contact_delay == pytest.approx(0.02)


def test_a_door_that_moves_early_brings_the_slow_down_forward() -> None:
    execution, cam = started()
    joints(execution, cam + 0.4)
    (command,) = execution.on_door(cam + 0.4, 0.01, 0.6)
    assert command.stamp < cam + SWITCH
    position, velocity, _ = command.knots.at(0.0)
    assert position[0, 0] == pytest.approx(SPEED * (command.stamp - cam - 0.1), abs=1e-6)
    assert velocity[0, 0] == pytest.approx(0.15 * SPEED)


def test_a_door_that_never_moves_is_a_missed_contact() -> None:
    execution, cam = started()
    joints(execution, cam + 1.5)
    assert execution.outcome is Outcome.RUNNING  # the door's angle may come late
    for now in np.arange(cam, cam + 1.5, 0.01):
        execution.on_door(now, 0.0, 0.0)
    assert execution.outcome is Outcome.NO_CONTACT


def test_a_stop_before_the_point_of_no_return_stops_and_after_it_completes_the_hit() -> None:
    execution, cam = started()
    joints(execution, cam + 0.3)
    execution.stop()
    (command,) = joints(execution, cam + 0.305)
    assert not command.knots.velocity[-1].any()  # by a motion of its own, not by the driver's stop
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


def test_a_stop_past_the_point_of_no_return_comes_after_the_hit() -> None:
    execution, cam = started()
    joints(execution, cam + CONTACT - 0.05)
    execution.stop()
    opened(execution, cam + CONTACT)
    assert execution.outcome is Outcome.STOPPED
    assert "after the hit" in execution.reason


def test_it_ends_in_the_plans_retreat_which_can_be_stopped_again() -> None:
    back = straight(SPEED * (SWITCH - 0.1), 0.0, 1.2)
    for again in (False, True):
        execution = Execution(plan(retreat=back), lambda position, velocity: float(velocity[0]))
        cam = execution.start(10.0).stamp + 4.0
        joints(execution, cam + CONTACT - 0.05)
        execution.stop()
        now = opened(execution, cam + CONTACT)
        assert execution.phase == "retreat"
        assert execution.outcome is Outcome.RUNNING
        if again:
            execution.stop()
        commands = joints(execution, now + 0.5, 0.0)
        assert [command.knots for command in commands] == ([None] if again else [])
        joints(execution, now + 2.0, 0.0)
        assert execution.outcome is Outcome.STOPPED
        assert again or "back from the door" in execution.reason


def test_the_hold_can_be_stopped() -> None:
    execution, cam = started()
    now = opened(execution, cam + CONTACT)
    assert not execution.past_no_return(now + 0.1)
    execution.stop()
    (command,) = joints(execution, now + 0.1, 0.0)
    assert command.knots is None
    assert execution.outcome is Outcome.STOPPED


def test_a_robot_that_does_not_follow_is_stopped_and_the_joint_named() -> None:
    execution, cam = started(joint_names=("ELBOW",))
    assert execution.on_joint_state(cam - 1.0, np.array([0.09]), np.zeros(1)) == []
    (command,) = execution.on_joint_state(cam - 0.9, np.array([0.11]), np.zeros(1))
    assert command.knots is None
    assert execution.outcome is Outcome.NOT_FOLLOWED
    assert "ELBOW is 0.110 rad" in execution.reason


def test_silence_stops_before_the_point_of_no_return_and_after_it_leaves_the_driver_alone() -> None:
    execution, cam = started()
    joints(execution, cam)
    (command,) = execution.on_silence(cam + 0.3, "/joint_states", 0.3)
    assert command.knots is None
    assert "/joint_states has been silent for 0.30 s" in execution.reason

    execution, cam = started()
    joints(execution, cam + CONTACT - 0.05)
    assert execution.on_silence(cam + CONTACT, "/imu", 0.3) == []
    assert execution.outcome is Outcome.STOPPED


def test_a_falling_robot_is_stopped_once() -> None:
    execution, _ = started()
    assert execution.on_tilt(0.1) == []
    assert execution.on_tilt(0.6)[0].knots is None
    assert execution.outcome is Outcome.FELL
    assert execution.on_tilt(0.7) == []


def test_speed_before_the_contact_is_that_of_the_last_samples_of_the_run_up() -> None:
    execution, cam = started()
    for now in np.arange(cam, cam + 0.59, 0.005):
        joints(execution, now, 0.37)
    assert execution.measured.v_rb == pytest.approx(0.37)


def test_cut_and_without_first_keep_the_motion() -> None:
    knots = straight(0.0, 1.0, 2.0)
    np.testing.assert_allclose(cut(knots, 1.3).at(1.1)[0], knots.at(1.1)[0])
    assert cut(knots, 1.3).time[-1] == 1.3
    np.testing.assert_allclose(without_first(knots).at(1.5)[0], knots.at(1.5)[0])
    slow = slowed(knots, 0.5)
    np.testing.assert_allclose(slow.at(2.0)[0], knots.at(1.0)[0])
    np.testing.assert_allclose(slow.at(2.0)[1], 0.5 * knots.at(1.0)[1])
    assert duration(concatenate([knots, slow])) == pytest.approx(6.0)
