"""The execution of a passage beside a driver and a leaf that do what is planned, or do not."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from humanoid_motion.driver_interface import Command
from humanoid_motion.samples import ImuSample
from motion_execution.walk.passage import Passage
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival
from robot_driver.motion import Outcome
from robot_driver.names import DOOR, HAND, IMU, JOINTS

TICK = 0.005
WATCH = 10  # ticks between two looks for silent topics
UPRIGHT = ImuSample(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, 0.0, 9.81]))


@dataclass
class Rig:
    """A passage, and a driver that follows it exactly."""

    passage: Passage
    inputs: Inputs
    watch: Freshness
    now: float = 5.0
    ticks: int = 0
    sent: list[Command] = field(default_factory=list)
    off: Callable[[float], float] = lambda _: 0.0  # of the leaf from its plan [rad]
    force: Callable[[float], float] = lambda _: 20.0  # on the hand; NaN: no sensor [N]

    def run(self, until: float = math.inf) -> Passage:
        """Until the passage ends, or up to a time since its begin [s]."""
        if not self.sent:
            self.sent.append(self.passage.start(self.now))
        while self.passage.running and self.passage.since(self.now) < until:
            self.tick()
        return self.passage

    def tick(self) -> None:
        self.now, self.ticks = self.now + TICK, self.ticks + 1
        arrival, time = Arrival(self.now, self.now, 0.0), self.passage.since(self.now)
        command = self.sent[-1]
        at = min(max(self.now - command.stamp, 0.0), command.knots.time[-1])
        posture = command.knots.at(at)[0][0]
        leaf = float(self.passage.passage.push.at(np.array([max(time, 0.0)]))[0])
        force = np.array([0.0, self.force(time), 0.0, 0.0, 0.0, 0.0])
        self.sent += self.inputs.on_joints(arrival, posture, np.zeros_like(posture))
        self.sent += self.inputs.on_imu(arrival, UPRIGHT)
        self.sent += self.inputs.on_door(arrival, leaf + self.off(time), 0.0)
        if not np.isnan(force).any():
            self.sent += self.inputs.on_hand(arrival, force)
        missing = self.watch.tick() if self.ticks % WATCH == 0 else None
        if missing is not None:
            self.inputs.on_silence(*missing, self.watch.limit)


@pytest.fixture
def rig(robot, passage) -> Rig:
    watch = Freshness((JOINTS, IMU, DOOR, HAND), 0.5, WATCH * TICK, optional=[HAND])
    inputs = Inputs(robot, watch)
    inputs.motion = Passage(robot, passage, yields=False)
    return Rig(inputs.motion, inputs, watch)


def test_a_passage_that_goes_as_planned_succeeds(rig):
    """Its stages come in their order, and it says when the robot was clear."""
    done, plan = rig.run(), rig.passage.passage
    assert done.outcome is Outcome.SUCCESS
    assert len(rig.sent) == done.steps_made(rig.now) + 1 == len(plan.walk.footsteps) + 1
    begin = rig.sent[0].stamp + rig.sent[0].knots.time[0]
    assert done.cleared(rig.now) == pytest.approx(begin + plan.clear)
    assert math.isnan(done.cleared(begin + plan.clear - 0.1))
    stages = [done.stage(begin + time) for time in np.arange(0.0, plan.walk.duration, 0.1)]
    assert list(dict.fromkeys(stages)) == ["push", "walk", "square_up"]
    assert done.watch.largest_force == pytest.approx(20.0)
    assert done.watch.largest_error < 1e-9
    assert done.release_angle == pytest.approx(plan.push.last, abs=0.01)
    assert [done.yields_at(begin + time) for time in (
        0.0, plan.push.release - 0.01, plan.push.release + 0.01)] == [True, True, False]


@pytest.mark.parametrize("error_deg", [12.0, -12.0])
def test_no_step_follows_on_a_lost_leaf(rig, error_deg):
    """The step that has begun is finished, and the last trajectory ends at rest on both feet."""
    rig.off = lambda time: math.radians(error_deg) if time > 3.0 else 0.0
    done, plan = rig.run(), rig.passage.passage.walk
    assert done.outcome is Outcome.LEAF_LOST
    assert "the leaf is lost" in done.reason
    assert math.isnan(done.cleared(rig.now))
    assert math.isnan(done.release_angle)
    known = sum(plan.begin_of(step) - 0.35 < 3.2 for step in range(len(plan.footsteps)))
    assert done.steps_made(rig.now) == known
    assert np.abs(rig.sent[-1].knots.velocity[-1]).max() < 1e-6


def test_a_leaf_that_is_lost_after_the_release_does_not_matter(rig):
    release = rig.passage.passage.push.release
    rig.off = lambda time: 0.5 if time > release + 0.02 else 0.0
    assert rig.run().outcome is Outcome.SUCCESS


def test_a_hand_that_is_pressed_stops_the_passage(rig):
    rig.force = lambda time: 180.0 if time > 2.0 else 20.0
    done = rig.run()
    assert done.outcome is Outcome.STOPPED
    assert "the force on the hand has been 180 N" in done.reason


def test_a_wrist_without_a_sensor_passes_and_one_that_falls_silent_does_not(rig):
    """The driver finishes what it has, which ends with the robot standing."""
    rig.force = lambda _: math.nan
    assert rig.run(2.0).running
    assert math.isnan(rig.passage.watch.largest_force)
    rig.force = lambda time: 20.0 if time < 2.5 else math.nan
    done = rig.run()
    assert done.outcome is Outcome.STOPPED
    assert HAND in done.reason
    assert done.since(rig.now) == pytest.approx(3.0, abs=0.1)


def test_a_stop_finishes_the_step(rig):
    rig.run(4.0).stop("as asked")
    sent = len(rig.sent)
    assert (rig.run().reason, len(rig.sent)) == ("as asked", sent)
    assert rig.passage.steps_made(rig.now) == sent - 1


@pytest.mark.parametrize("yields", [True, False])
def test_the_arm_of_a_yielding_hand_may_leave_its_trajectory(robot, passage, yields):
    """No other joint may, and no arm whose hand is stiff."""
    walk = Passage(robot, passage, yields=yields)
    command = walk.start(5.0)
    posture = command.knots.at(1.0)[0][0]
    posture[robot.arm_columns[0]] += 0.4
    walk.on_joints(command.stamp + 1.0, posture, 0.0 * posture)
    assert walk.outcome is (Outcome.RUNNING if yields else Outcome.NOT_FOLLOWED)
    posture[robot.leg_columns["left"][0]] += 0.4
    walk.on_joints(command.stamp + 1.0, posture, 0.0 * posture)
    assert walk.outcome is Outcome.NOT_FOLLOWED
