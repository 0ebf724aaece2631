"""A run's measurements: one bad message changes nothing, several in a row are a silent topic."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from humanoid_motion.samples import ImuSample
from humanoid_motion.splice import duration
from hypothesis import given
from hypothesis import strategies as st
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.settings import ExecutionSettings
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival, Intake, Plausible
from robot_driver.motion import Outcome
from robot_driver.names import DOOR, IMU, JOINTS

TICK = 0.005  # period of the driver [s]
UPRIGHT = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, 0.0, 9.8]))
UPSIDE_DOWN = replace(UPRIGHT, orientation=np.array([1.0, 0.0, 0.0, 0.0]))


def pushed(force):
    """A reading with a specific force besides gravity [m/s^2]."""
    return replace(UPRIGHT, specific_force=UPRIGHT.specific_force + force)


def away_from_door(force):
    """A wrench of the floor on a foot with a force towards the door [N]."""
    return np.array([0.0, -force, 280.0, 0.0, 0.0, 0.0])


class Rig:
    """A run whose robot follows its trajectory, in the middle of the run-up."""

    def __init__(self, robot, good) -> None:
        self.watch = Freshness((JOINTS, IMU, DOOR), 0.5, 0.05)
        self.inputs = Inputs(robot, self.watch)
        self.execution = Execution(good, PointB(robot))
        self.command = self.execution.start(0.0)
        self.now = self.execution.planned_contact - good.point_of_no_return - 0.1
        self.inputs.motion = self.execution
        for _ in range(3):
            self.tick()

    def at(self, stamp: float, underway: float = 0.0) -> Arrival:
        return Arrival(stamp, self.now, underway)

    def pose(self) -> np.ndarray:
        return self.command.knots.at(self.now - self.command.stamp)[0][0]

    def tick(self) -> list:
        """Good messages of one tick."""
        self.now += TICK
        at = self.at(self.now)
        return [*self.inputs.on_imu(at, UPRIGHT),
                *self.inputs.on_joints(at, self.pose(), np.zeros(30)),
                *self.inputs.on_door(at, 0.0, 0.0)]

    @property
    def dropped(self) -> int:
        return sum(self.inputs.intake.dropped.values())


@pytest.fixture
def rig(robot, good) -> Rig:
    return Rig(robot, good)


BAD = {
    "joints 5 s ahead": lambda rig: rig.inputs.on_joints(
        rig.at(rig.now + 5.0), rig.pose(), np.zeros(30)),
    "joints that jump": lambda rig: rig.inputs.on_joints(
        rig.at(rig.now + TICK), rig.pose() + 0.5, np.zeros(30)),
    "an IMU upside down": lambda rig: rig.inputs.on_imu(
        rig.at(rig.now + TICK), UPSIDE_DOWN),
    "a door at no angle": lambda rig: rig.inputs.on_door(rig.at(rig.now + TICK), np.nan, 0.5),
    "a door's angle that is old": lambda rig: rig.inputs.on_door(rig.at(rig.now), 0.03, 0.5),
    "a door that races": lambda rig: rig.inputs.on_door(rig.at(rig.now + TICK), 0.0, 50.0),
}


@pytest.mark.parametrize("bad", BAD.values(), ids=BAD)
def test_one_bad_message_in_a_run_is_dropped_and_counted_and_the_run_goes_on(rig, bad) -> None:
    assert bad(rig) == []
    assert rig.dropped == 1
    assert rig.execution.outcome is Outcome.RUNNING
    for _ in range(5):
        assert rig.tick() == []
    assert rig.dropped == 1
    assert rig.execution.phase == "cam"


def test_bad_messages_in_a_row_leave_the_topic_silent(rig) -> None:
    """A topic whose messages are all dropped is one without messages."""
    silent = None
    for _ in range(40):
        for _ in range(10):
            rig.now += TICK
            rig.inputs.on_joints(rig.at(rig.now), rig.pose(), np.zeros(30))
            rig.inputs.on_door(rig.at(rig.now), 0.0, 0.0)
            rig.inputs.on_imu(rig.at(rig.now), UPSIDE_DOWN)
        silent = silent or rig.watch.tick()
    assert silent[0] == IMU


@given(stamp=st.floats(), turn=st.floats(), rate=st.floats(), force=st.floats(), angle=st.floats(),
       speed=st.floats())
def test_no_single_message_moves_the_robot_before_the_contact(
        robot, good, stamp, turn, rate, force, angle, speed) -> None:
    """Whatever its numbers are; only a door that moves from where it stood counts as a contact."""
    rig = Rig(robot, good)
    at = Arrival(stamp, rig.now, 0.0)
    reading = ImuSample(np.full(4, turn), np.full(3, rate), np.full(3, force))
    assert rig.inputs.on_imu(at, reading) == []
    assert rig.inputs.on_joints(at, np.full(30, angle), np.full(30, speed)) == []
    for side in ("left", "right"):
        assert rig.inputs.on_wrench(side, at, np.full(6, speed)) == []
    assert rig.execution.outcome is Outcome.RUNNING


@pytest.mark.parametrize("odd", [5.0, 159.0])
def test_an_accelerometer_that_lies_far_from_the_planned_contact_is_no_contact(
        robot, good, odd) -> None:
    """However many of its messages lie; near the planned contact a single one is no contact."""
    rig, away = Rig(robot, good), PointB(robot).away_from_door(good.phases["cam"].position[-1])
    contact, edge = rig.execution.planned_contact, good.steady_time + 0.02
    while rig.now < contact + edge:
        near = abs(rig.now + TICK - contact) < edge
        lies = not near or abs(rig.now + TICK - contact) < 0.5 * TICK
        rig.now += TICK
        at = rig.at(rig.now)
        assert rig.inputs.on_imu(at, pushed(lies * odd * away)) == []
        assert rig.inputs.on_joints(at, rig.pose(), np.zeros(30)) == []
    assert rig.execution.phase == "cam"
    assert rig.execution.measured.contact_sensor == ""


@pytest.mark.parametrize("accelerometer", [True, False])
def test_without_an_accelerometer_the_feet_show_the_contact(robot, good, accelerometer) -> None:
    rig, away = Rig(robot, good), PointB(robot).away_from_door(good.phases["cam"].position[-1])
    contact, commands = rig.execution.planned_contact, []
    while rig.now < contact + 0.03 and not commands:
        rig.now += TICK
        at, touching = rig.at(rig.now), rig.now > contact
        commands += rig.inputs.on_imu(
            at, pushed(touching * 20.0 * away) if accelerometer else
            replace(UPRIGHT, specific_force=np.zeros(3)))
        commands += rig.inputs.on_joints(at, rig.pose(), np.zeros(30))
        force = away_from_door(60.0 * (rig.now > contact + 0.01))
        for side in ("left", "right"):
            commands += rig.inputs.on_wrench(side, at, force)
    assert len(commands) == 1
    assert rig.execution.phase == "post"
    assert rig.execution.measured.contact_sensor == ("imu" if accelerometer else "feet")


def test_messages_that_were_long_underway_show_how_late_the_executor_is(rig, good) -> None:
    """An executor that was held up gets old messages; the simulation's clock is as old as they."""
    contact = rig.execution.planned_contact
    rig.now = contact
    rig.inputs.on_joints(rig.at(contact), rig.pose(), np.zeros(30))
    late = contact + ExecutionSettings().force_delay
    rig.now = late
    for side in ("left", "right"):
        assert rig.inputs.on_wrench(
            side, rig.at(late, underway=3.0), away_from_door(80.0)) == []
    assert rig.execution.phase == "retreat"


@pytest.mark.parametrize("before", [1.5, 0.5])
def test_a_failure_of_the_program_stops_the_run_up_if_it_can_still_be_stopped(rig, good, before):
    """By the plan's own stop; past the point of no return the driver is left alone."""
    rig.now = rig.execution.planned_contact - before * good.point_of_no_return
    rig.inputs.on_joints(rig.at(rig.now), rig.pose(), np.zeros(30))
    commands = rig.inputs.on_failure(RuntimeError("a bug"))
    assert [duration(command.knots) for command in commands] == (
        [pytest.approx(good.stop_duration)] if before > 1.0 else [])
    if commands:
        rig.now += 1.0
        rig.inputs.on_joints(rig.at(rig.now), commands[0].knots.position[-1], np.zeros(30))
    assert rig.execution.outcome is Outcome.STOPPED
    assert "RuntimeError: a bug" in rig.execution.reason


@given(st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(-1.0, 1.0)), max_size=40))
def test_accepted_messages_are_in_order_and_never_jump(messages) -> None:
    intake = Intake({"topic": Plausible(0.9, 2.0, 0.1)})
    accepted = [(stamp, value) for stamp, value in messages
                if intake.accept("topic", Arrival(stamp, 5.0, 0.0), value, in_motion=True)]
    assert len(accepted) + sum(intake.dropped.values()) == len(messages)
    for (before, last), (stamp, value) in pairwise(accepted):
        assert stamp > before
        assert abs(value - last) <= 0.1 + 2.0 * (stamp - before) or stamp - before > 1.0
    assert all(stamp <= 5.1 and abs(value) <= 0.9 for stamp, value in accepted)
