"""What the guard lets pass a stock controller follows exactly, whatever the motions want."""

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_double import PERIOD, ControllerDouble
from humanoid_motion.driver_interface import Command, TrajectoryArrays
from humanoid_motion.knots import Knots
from hypothesis import given
from hypothesis import strategies as st
from robot_driver.errors import TrajectoryRefusedError
from robot_driver.trajectory_checks import JointLimits
from robot_driver.trajectory_driver import TrajectoryDriver
from robot_driver.trajectory_guard import TrajectoryGuard

NAMES = ("a", "b", "c")
LIMITS = JointLimits(NAMES, np.full(3, -1.0), np.full(3, 1.0), np.array([2.0, 4.0, 3.0]))
REST = np.zeros(3)


class Robot:
    """The guard with the controller's double, and our driver, which gets what the guard gets."""

    def __init__(self) -> None:
        self.guard = TrajectoryGuard(LIMITS)
        self.guard.compare(0.0, REST)
        self.controller = ControllerDouble(LIMITS, REST)
        self.driver = TrajectoryDriver(LIMITS, REST)
        self.now, self.farthest = 0.0, 0.0

    def run(self, cycles: int) -> None:
        """Let time pass, and compare what the two command."""
        for _ in range(cycles):
            commanded = self.controller.positions(np.array([self.now, self.now + PERIOD]))[-1]
            self.now += PERIOD
            off = np.abs(commanded - self.driver.sample(self.now).position).max()
            self.farthest = max(self.farthest, float(off))

    def send(self, command: Command) -> str:
        """Send a trajectory to both; return why the guard refuses it."""
        verdicts = []
        for follow in (self._through_the_guard, self._directly):
            try:
                follow(command)
                verdicts.append("")
            except TrajectoryRefusedError as error:
                verdicts.append(str(error))
        assert verdicts[0] == verdicts[1]
        return verdicts[0]

    def _through_the_guard(self, command: Command) -> None:
        sent = self.guard.follow(command, self.now, self.controller.sample(self.now).position)
        assert sent is not None
        self.controller.accept(TrajectoryArrays.of(sent, NAMES), sent.stamp, self.now)

    def _directly(self, command: Command) -> None:
        self.driver.accept(TrajectoryArrays.of(command, NAMES), command.stamp, self.now)


rows = st.lists(st.floats(-1.2, 1.2), min_size=3, max_size=3)
bad = st.sampled_from([math.nan, math.inf, 3.0])


@st.composite
def commands(draw: st.DrawFn) -> Command:
    """A trajectory that may be late or early, fast, too far, no number, or still moving."""
    if draw(st.integers(0, 5)) == 0:
        return Command(0.0, None)
    count = draw(st.integers(2, 4))
    steps = draw(st.lists(st.floats(0.02, 1.0), min_size=count, max_size=count))
    position = np.array(draw(st.lists(rows, min_size=count, max_size=count))) * draw(
        st.sampled_from([0.05, 0.5, 1.0]))
    slopes = 0.3 * np.array(draw(st.lists(rows, min_size=count, max_size=count)))
    slopes[-1] *= draw(st.sampled_from([0.0, 0.0, 1.0]))
    if draw(st.integers(0, 6)) == 0:
        position[draw(st.integers(0, count - 1)), 0] = draw(bad)
    return Command(draw(st.sampled_from([0.0, -0.04, 0.3, 2.0])), Knots(
        np.cumsum(steps) - draw(st.sampled_from([0.0, steps[0]])), position, slopes, 0.0 * slopes))


@given(st.lists(st.tuples(commands(), st.integers(1, 60)), min_size=1, max_size=6))
def test_the_controller_follows_what_our_driver_would_and_nothing_else(orders) -> None:
    """Within 0.1 mrad, in steps within the speeds, refused alike, and never by the controller."""
    robot = Robot()
    robot.run(2)
    for command, cycles in orders:
        stamp = robot.now + command.stamp if command.stamp else 0.0
        robot.send(replace(command, stamp=max(stamp, 0.0)))
        robot.run(cycles)
    robot.run(300)
    assert not robot.controller.rejected
    assert robot.farthest < 1e-4
    assert (robot.controller.steps <= 1.1 * LIMITS.velocity * PERIOD + 1e-9).all()


def to(*position: float, at: float = 1.0) -> Command:
    """A motion that is at rest in a posture after a time, and until then undetermined."""
    still = np.zeros((2, 3))
    return Command(0.0, Knots(np.array([at, at + 0.5]), np.array([position] * 2), still, still))


def test_a_stop_is_two_points_and_brakes_within_a_sixth_of_a_second() -> None:
    robot = Robot()
    robot.run(1)
    assert robot.send(to(0.5, 0.5, 0.5)) == ""
    robot.run(100)
    sent = robot.guard.follow(Command(0.0, None), robot.now, None)
    assert sent is not None
    assert sent.knots is not None
    assert sent.knots.time == pytest.approx([0.0, 0.15])
    assert sent.knots.velocity[0].max() > 0.1
    assert not sent.knots.velocity[-1].any()
    assert not sent.knots.acceleration[-1].any()


def test_nothing_is_sent_that_begins_where_the_controller_may_not_be() -> None:
    """Before it is known what the controller holds, and after others have moved the joints."""
    guard, here = TrajectoryGuard(LIMITS), np.full(3, 0.02)
    assert guard.follow(Command(0.0, None), 1.0, here) is None
    first = guard.follow(to(0.1, 0.1, 0.1), 1.0, here)
    assert first is not None
    assert first.knots is not None
    assert first.knots.time[0] == pytest.approx(1.0)  # it goes there from wherever it is
    second = guard.follow(to(0.2, 0.1, 0.1), 2.5, np.full(3, 0.12))
    assert second is not None
    assert second.knots is not None
    assert (second.knots.time[0], second.knots.position[0, 0]) == (0.0, pytest.approx(0.1))
    moved = guard.follow(to(0.2, 0.1, 0.1), 9.0, np.full(3, 0.5))
    assert moved is not None
    assert moved.knots is not None
    assert moved.knots.time[0] == pytest.approx(1.0)


def test_a_controller_that_was_activated_anew_ends_the_motion_in_words() -> None:
    """It holds the measured joints then; what is sent next begins there."""
    robot = Robot()
    robot.run(1)
    robot.send(to(0.5, 0.2, 0.2))
    robot.run(100)
    state = robot.controller.sample(robot.now).position
    assert robot.guard.compare(robot.now, state) == ""
    why = robot.guard.compare(robot.now, state - [0.1, 0.0, 0.0])
    assert "holds a at" in why
    assert "0.1000 rad from where the trajectory" in why
    assert "activated anew" in why
    sent = robot.guard.follow(to(0.3, 0.2, 0.2), robot.now, None)
    assert sent is not None
    assert sent.knots is not None
    np.testing.assert_allclose(sent.knots.position[0], state - [0.1, 0.0, 0.0])
