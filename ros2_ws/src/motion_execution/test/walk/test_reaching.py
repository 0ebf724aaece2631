"""The hand on its way to the closed leaf: it stops where it meets something."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from humanoid_motion.driver_interface import Command
from motion_execution.walk.reaching import Reaching
from robot_driver.motion import Outcome
from walking.passing.reach import plan_reach
from walking.passing.settings import PassageSettings

TICK = 0.005


@dataclass
class Rig:
    """A driver that follows exactly, and a leaf that is felt as functions of time say."""

    reaching: Reaching
    now: float = 5.0
    sent: list[Command] = field(default_factory=list)
    postures: list[np.ndarray] = field(default_factory=list)

    def run(self, force=lambda _: 0.0, angle=lambda _: 0.0, stop=math.inf):
        """Until the motion ends; a stop is requested at a time [s]."""
        reaching, self.sent = self.reaching, [self.reaching.start(self.now)]
        while reaching.running:
            self.now += TICK
            time, last = reaching.since(self.now), self.sent[-1]
            at = np.clip(self.now - last.stamp, *last.knots.time[[0, -1]])
            self.postures.append(last.knots.at(at)[0][0])
            if time > stop:
                reaching.stop("enough")
            self.sent += reaching.on_door(self.now, angle(time), 0.0)
            self.sent += reaching.on_hand(self.now, force(time))
            self.sent += reaching.on_joints(
                self.now, self.postures[-1], np.zeros_like(self.postures[-1]))
        return reaching


@pytest.fixture(scope="module")
def reach(robot, half_sitting, doorway):
    """The way of the hand to the leaf."""
    return plan_reach(robot, doorway(), half_sitting, PassageSettings())


@pytest.fixture
def rig(robot, reach):
    return Rig(Reaching(robot, reach))


@pytest.mark.parametrize(("force", "angle"), [(9.0, 0.0), (3.0, math.radians(0.6))])
def test_the_hand_stops_softly_where_it_feels_the_leaf_or_the_leaf_gives_way(
        rig, reach, force, angle):
    """Once, within 0.3 s, and without a jump of the reference."""
    done = rig.run(lambda time: force * (time > 3.2), lambda time: angle * (time > 3.2))
    assert (done.outcome, done.reason, len(rig.sent)) == (Outcome.SUCCESS, "", 2)
    assert 3.2 < rig.sent[-1].knots.time[0] < 3.25
    assert done.since(rig.now) < 3.7
    assert np.abs(np.diff(rig.postures, axis=0)).max() < 0.02
    assert np.abs(np.diff(rig.postures, 2, axis=0)).max() / TICK**2 < 20.0
    assert np.abs(rig.postures[-1] - reach.walk.knots.position[-1]).max() > 0.02


def test_a_hand_that_meets_nothing_says_so_at_the_end_of_its_way(rig, reach):
    done = rig.run(lambda _: 1.5)
    assert done.outcome is Outcome.NO_CONTACT
    assert "at most 1.5 N" in done.reason
    assert rig.postures[-1] == pytest.approx(reach.walk.knots.position[-1])


def test_one_noisy_sample_of_the_force_is_no_contact(rig):
    done = rig.run(lambda time: 15.0 * (abs(time - 3.0) < 0.6 * TICK))
    assert done.outcome is Outcome.NO_CONTACT


def test_a_stop_brings_the_arm_to_rest_at_once(rig):
    done = rig.run(stop=0.9)
    assert (done.outcome, done.reason) == (Outcome.STOPPED, "enough")
    assert done.since(rig.now) < 1.3
