"""A walk without nodes: pushes and falls; tests/test_scaled_robot.py has one without."""

import math

import numpy as np
import pytest
from door_impact_evaluation.run.driver_link import AFTERWARDS
from door_impact_evaluation.run.walk_run import Push, plan_between, push_standing, walk
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from walking.footsteps.footstep import Pose

START = Pose(-3.0, 7.5, 2.5)


@pytest.fixture(scope="module")
def robot():
    """The model of HRP-2."""
    return RobotModel(load_robot_config())


@pytest.fixture(scope="module")
def plan(robot):
    """Two steps ahead and a turn, far from the origin."""
    return plan_between(robot, START, START.moved(0.2, 0.0, 0.2))


@pytest.mark.nightly("nine seconds")
def test_a_push_moves_the_center_of_mass_by_its_impulse(robot, plan):
    """10 N s to the robot's left while it stands in the end change its speed by 0.17 m/s."""
    at = plan.duration + 0.5
    direction = START.yaw + 0.2 + 0.5 * math.pi
    push = Push(at, (10.0 * math.cos(direction), 10.0 * math.sin(direction), 0.0))
    pushed = walk(robot, plan, [push], engine="mujoco", seed=5)
    motion = pushed.log.motion
    before, after = np.searchsorted(motion.t, pushed.begin + at + np.array([0.0, 0.1]))
    speed = np.gradient(motion.com, motion.t, axis=0)[[before, after], :2]
    gained = (speed[1] - speed[0]) @ [math.cos(direction), math.sin(direction)]
    assert 0.08 < gained < 10.0 / robot.mass  # the soles hold against it


@pytest.mark.nightly("four seconds")
def test_a_fall_ends_the_walk(robot, plan):
    """120 N s in the first step throw the robot over, and the log ends then."""
    push = Push(1.5, (120.0, 0.0, 0.0))
    fallen = walk(robot, plan, [push], engine="mujoco")
    assert not fallen.stood
    assert fallen.log.motion.t[-1] < fallen.begin + plan.duration + AFTERWARDS
    assert fallen.margin < 0.0


@pytest.mark.nightly("ten seconds")
@pytest.mark.parametrize("step_change", [True, False])
def test_steps_keep_a_standing_robot_from_falling_backwards(robot, step_change):
    """25 N s from ahead throw a robot over that makes no step."""
    world = World(robot.config, load_door("paper"), 9.0, -9.0, engine="mujoco", seed=1)
    try:
        stepped = push_standing(world, robot, (-25.0, 0.0, 0.0), step_change=step_change)
        assert stepped == step_change
        assert bool(world.fell) != step_change
    finally:
        world.close()
