"""The guard of a standing robot: when it watches, what makes it step, and what does not."""

import math

import numpy as np
import pytest
from hrp2_description.robot import SIDES
from humanoid_motion.samples import ImuSample, Measured
from motion_execution.walk.guard import Guard
from walking.errors import NotReady
from walking.pattern.state import standing

TICK = 0.005
FAST = 0.6  # speed of the CoM that no stance bears [m/s]


class Rig:
    """A robot at rest in half-sitting, or turning about its soles."""

    def __init__(self, robot, stance):
        self.robot, self.stance, self.now = robot, stance, 0.0
        self.free = self.known = True
        self.guard = Guard(robot, lambda: self.free, self.state)
        self.position = np.array(robot.config.half_sitting)
        q = robot.configuration(np.zeros(3), self.position)
        self.height = float(robot.com(q)[2] - robot.frame_position(q, robot.feet["left"].frame)[2])

    def state(self):
        if not self.known:
            raise NotReady("the sensors contradict each other")
        return standing(self.robot, self.stance)

    def tick(self, velocity=(0.0, 0.0), share=1.0, lag=0.0):
        """Measure a velocity of the CoM [m/s], with the soles bearing a share of the weight."""
        self.now += TICK
        wrench = np.array([0.0, 0.0, 0.5 * share * self.robot.mass * 9.81, 0.0, 0.0, 0.0])
        turn = np.array([-velocity[1], velocity[0], 0.0]) / self.height
        imu = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), turn, np.array([0.0, 0.0, 9.81]))
        self.guard.lags(lag)
        return self.guard.on_measured(self.now, Measured(
            self.position, np.zeros(len(self.position)), imu, wrench, wrench, self.now))

    def rest(self, seconds=1.2):
        for _ in range(round(seconds / TICK)):
            assert self.tick() == []
        return self

    def pushed(self, angle=math.pi, **measured):
        """Let the CoM move fast in a direction for 0.1 s, and return what the guard sends."""
        velocity = FAST * math.cos(angle), FAST * math.sin(angle)
        return next(filter(None, (self.tick(velocity, **measured) for _ in range(20))), [])


@pytest.fixture
def rig(robot, half_sitting):
    return Rig(robot, half_sitting)


@pytest.mark.parametrize("angle", np.arange(4) * math.pi / 2.0)
def test_a_push_that_no_stance_bears_makes_steps_that_end_on_two_feet(rig, robot, angle):
    """The motion begins in the present posture, within 60 ms."""
    (command,) = rig.rest().pushed(angle)
    assert rig.now < command.stamp + command.knots.time[0] < rig.now + 0.06
    assert np.abs(command.knots.position[0] - rig.position).max() < 5e-3
    assert np.abs(command.knots.velocity[-1]).max() < 1e-6
    q = robot.configuration(np.zeros(3), command.knots.position[-1])
    heights = [robot.frame_position(q, robot.feet[side].frame)[2] for side in SIDES]
    assert abs(heights[0] - heights[1]) < 1e-4
    assert len(rig.guard.steps) == 1


def test_a_robot_is_watched_when_it_has_been_at_rest_for_a_second(rig):
    """Not before, not while something else moves it, and not while its state is doubted."""
    assert rig.rest(0.9).pushed() == []
    rig.free = False
    assert rig.rest().pushed() == []
    rig.free, rig.known = True, False
    assert rig.rest().pushed() == []
    rig.known = True
    assert rig.rest().pushed()


@pytest.mark.parametrize("change", [
    lambda rig: setattr(rig, "free", False),
    lambda rig: setattr(rig, "now", rig.now + 0.5),
    lambda rig: setattr(rig, "now", rig.now - 0.5),
    lambda rig: setattr(rig, "position", rig.position + 0.05),
    lambda rig: rig.tick(share=0.2)])
def test_a_robot_that_something_else_moves_is_left_alone(rig, change):
    """A hit, a gap of the messages, a clock that goes back, another posture, ropes."""
    rig.rest()
    change(rig)
    assert rig.pushed() == []


def test_what_is_measured_late_makes_no_step(rig):
    """A step that comes late makes a fall worse."""
    assert rig.rest().pushed(lag=0.03) == []
