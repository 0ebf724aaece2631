"""The probe on the planner's own plan: the leaf is touched slowly, and hit where it was found."""

import numpy as np
import pytest
from humanoid_motion.driver_interface import Command
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.hit.probe import SPEED
from robot_driver.motion import Outcome

TICK = 0.01  # period of the joint states [s]
COUNT = 2.0 * np.pi / 14400.0  # angle of a count of the door's encoder [rad]
JOLT = (1.0, 3.0)  # of the IMU at the leaf, in ticks that follow each other [m/s^2]
ALWAYS = ("prepare", "shift", "step", "back", "probe")


class Robot:
    """A robot that follows every trajectory exactly, before a leaf that opens without a force."""

    def __init__(self, robot, plan, off=np.inf, *, locked=False, jolt=JOLT,
                 felt=True):
        self.point_b = PointB(robot)
        self.execution = Execution(plan, self.point_b, joint_names=robot.joint_names, probe=True)
        self.face = off + self.point_b.reach(plan.phases["cam"].at(plan.contact_time)[0][0])
        self.commands = [self.execution.start(0.0)]
        self.now, self.locked, self.jolt, self.felt = 0.0, locked, list(jolt), felt
        self.ajar = 0.0  # least angle of the leaf from now on [rad]
        self.widest = 0.0  # how far the leaf was pushed [m]

    @property
    def position(self):
        """Joint positions of the trajectory that is followed."""
        command = self.commands[-1]
        return command.knots.at(self.now - command.stamp)[0][0]

    def tick(self):
        """Send the messages of a tick."""
        self.now += TICK
        execution, position = self.execution, self.position
        ahead = max(0.0, self.point_b.reach(position) - self.face)
        self.widest = max(self.widest, ahead)
        force = self.jolt.pop(0) if ahead > 0.0 and self.jolt else 0.0
        angle = 0.0 if self.locked else np.floor(max(self.ajar, ahead / 0.43) / COUNT) * COUNT
        felt = 60.0 * (self.felt and self.locked and ahead > 0.0)
        feet = np.array([0.0, -felt, 500.0, 0.0, 0.0, 0.0])
        for commands in (
                execution.on_imu(self.now, 0.0, np.array([0.0, force, 9.81])),
                execution.on_joints(self.now, position, np.zeros(len(position))),
                execution.on_wrenches(self.now, feet, np.zeros(6)),
                execution.on_door(self.now, angle, 0.0)):
            self.commands += commands

    def until(self, done, longest=40.0):
        """Tick until a condition holds."""
        while not done():
            assert self.now < longest, self.execution.phase
            self.tick()

    def end(self):
        """Tick until the end."""
        self.until(lambda: self.execution.outcome is not Outcome.RUNNING)
        return self.execution


def test_the_first_trajectory_ends_where_the_run_up_begins_and_never_hurries(robot, good):
    """So silence is safe: the driver goes back by itself, and B is never faster than planned."""
    (command,) = Robot(robot, good).commands
    knots, start = command.knots, good.phases["cam"].position[0]
    np.testing.assert_allclose(knots.position[-1], start, atol=1e-6)
    assert np.abs(knots.velocity[-1]).max() < 1e-9
    driver = Robot(robot, good)
    begin = driver.execution.starts["probe"] - command.stamp
    joints = knots.at(np.arange(begin, knots.time[-1], 0.01))[0]
    ways = [driver.point_b.reach(row) for row in joints]
    assert np.abs(np.diff(ways)).max() / 0.01 < 2.0 * SPEED
    assert max(ways) - ways[0] > 0.1


@pytest.mark.parametrize("off", [-0.018, 0.0, 0.018])
def test_a_leaf_is_found_where_it_stands_and_hit_there(robot, good, off):
    """Within 1 mm; the run-up begins where the plan has it, and expects the contact in time."""
    driver = Robot(robot, good, off)
    driver.until(lambda: driver.execution.phase == "cam")
    execution, cam = driver.execution, good.phases["cam"]
    assert execution.measured.leaf_off == pytest.approx(off, abs=1e-3)
    assert driver.widest < 0.015
    np.testing.assert_allclose(driver.commands[-1].knots.at(0.0)[0][0], cam.position[0], atol=1e-6)
    driver.jolt = [20.0, 30.0]
    driver.until(lambda: execution.phase != "cam")
    assert execution.phase == "post"
    time = execution.measured.contact_time - execution.starts["cam"]
    assert driver.point_b.reach(cam.at(time)[0][0]) == pytest.approx(driver.face, abs=6e-3)


def test_a_jolt_where_the_leaf_was_not_found_is_no_contact(robot, good):
    """Without a probe the contact would be expected there."""
    driver = Robot(robot, good, 0.018)
    driver.until(lambda: driver.execution.phase == "cam")
    driver.until(lambda: driver.now > driver.execution.planned_contact - 0.03)
    for force in (20.0, 30.0):
        driver.now += 0.005
        driver.execution.on_imu(driver.now, 0.0, np.array([0.0, force, 9.81]))
    assert driver.execution.phase == "cam"


@pytest.mark.parametrize(("options", "outcome", "reason"), [
    ({"off": 0.0, "locked": True}, Outcome.LOCKED, "locked"),
    ({"off": np.inf}, Outcome.NO_CONTACT, "no leaf"),
    ({"off": 0.028}, Outcome.NO_CONTACT, "28 mm farther"),
    ({"off": 0.0, "locked": True, "jolt": ()}, Outcome.LOCKED, "locked"),
    ({"off": 0.0, "locked": True, "felt": False}, Outcome.NO_CONTACT, "neither")])
def test_without_a_free_leaf_in_its_place_there_is_no_hit(robot, good, options, outcome, reason):
    """The robot stands where the run-up would have begun."""
    driver = Robot(robot, good, **options)
    execution = driver.end()
    assert execution.outcome is outcome
    assert reason in execution.reason
    assert set(execution.starts) == {*ALWAYS, "retreat"}
    np.testing.assert_allclose(driver.position, good.phases["cam"].position[0], atol=1e-6)


@pytest.mark.parametrize("phase", ["step", "probe"])
@pytest.mark.parametrize("silent", [False, True])
def test_stop_and_silence_are_the_drivers_own_stop(robot, good, phase, silent):
    """The robot is slow: it keeps its balance anywhere."""
    driver = Robot(robot, good, 0.0)
    driver.until(lambda: driver.execution.phase == phase)
    if silent:
        commands = driver.execution.on_silence(driver.now, "imu", 0.6, 0.5)
    else:
        driver.execution.stop()
        commands = driver.execution.on_joints(driver.now + TICK, driver.position, np.zeros(30))
    assert commands == [Command(0.0, None)]
    assert driver.execution.outcome is Outcome.STOPPED


def test_a_leaf_that_stays_open_after_the_probe_is_not_hit(robot, good):
    driver = Robot(robot, good, 0.0)
    driver.until(lambda: len(driver.commands) > 1)
    driver.ajar = 0.1
    assert driver.end().outcome is Outcome.NO_CONTACT
    assert "fall shut" in driver.execution.reason
