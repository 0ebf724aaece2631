"""A walk's measurements: lies are dropped, silence makes no further step, ticks are whole."""


import numpy as np
import pytest
from humanoid_motion.samples import ImuSample
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_execution.walk.walk import Walk
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival
from robot_driver.motion import Outcome
from robot_driver.names import IMU, JOINTS, WRENCHES

TICK = 0.005
UPRIGHT = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, 0.0, 9.81]))
STANDING = np.array([0.0, 0.0, 280.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def ahead(walk_to):
    """A walk of some footsteps."""
    return walk_to(0.6, 0.0, 0.0)


class Rig:
    """A walk whose joints follow at once, two seconds after its begin."""

    def __init__(self, robot, plan):
        self.watch = Freshness((JOINTS, IMU), 0.5, 0.05)
        self.inputs = Inputs(robot, self.watch)
        self.walk = self.inputs.motion = Walk(robot, plan)
        self.whole = []  # stamps of the ticks that were complete
        self.walk.on_measured = lambda now, measured: self.whole.append(now) or []
        command = self.walk.start(0.0)
        self.origin, self.knots = command.stamp, command.knots
        self.now = self.origin + 0.5
        self.tick()

    def position(self):
        return self.knots.at(self.now - self.origin)[0][0]

    def messages(self):
        at = Arrival(self.now, self.now, 0.0)
        count = len(self.position())
        return [lambda: self.inputs.on_joints(at, self.position(), np.zeros(count)),
                lambda: self.inputs.on_imu(at, UPRIGHT),
                *(lambda side=side: self.inputs.on_wrench(side, at, STANDING) for side in WRENCHES)]

    def tick(self, order=range(4)):
        self.now += TICK
        messages = self.messages()
        for index in order:
            messages[index]()


@settings(max_examples=6)
@given(order=st.permutations(range(4)), missing=st.integers(0, 4))
def test_a_push_is_judged_by_the_measurements_of_one_tick_alone(robot, ahead, order, missing):
    """In whatever order they arrive; a tick without one of them is left out."""
    rig = Rig(robot, ahead)
    before = len(rig.whole)
    rig.tick([each for each in order if each != missing])
    assert len(rig.whole) == before + (missing == 4)
    rig.tick(order)
    assert rig.whole[-1] == pytest.approx(rig.now)
    assert len(set(rig.whole)) == len(rig.whole)


def test_a_silent_topic_ends_the_walk_without_a_command(robot, ahead):
    """The driver finishes what it has, and the sentence names the topic."""
    rig = Rig(robot, ahead)
    assert rig.inputs.on_silence(JOINTS, 0.55, 0.5) == []
    assert rig.walk.outcome is Outcome.STOPPED
    assert JOINTS in rig.walk.reason


def test_a_clock_that_goes_back_ends_the_walk_and_forgets_everything(robot, ahead):
    rig = Rig(robot, ahead)
    rig.inputs.forget()
    assert rig.walk.outcome is Outcome.STOPPED
    assert rig.inputs.joints is None
    assert not rig.watch.complete((JOINTS,))
