"""The robot, loaded once, and walks that several tests look at."""

import math

import pytest
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from walking.footsteps.footstep import Pose, Stance
from walking.footsteps.planner import plan_footsteps
from walking.pattern.plan import plan_walk
from walking.pattern.state import standing


@pytest.fixture(scope="session")
def robot():
    """The model of HRP-2."""
    return RobotModel(load_robot_config())


@pytest.fixture(scope="session")
def half_sitting(robot):
    """The soles in half-sitting, with their middle in the origin."""
    return Stance.around(Pose(0.0, 0.0, 0.0), robot.config.footsteps.width)


@pytest.fixture(scope="session")
def walk_to(robot, half_sitting):
    """A function that plans a walk from half-sitting to x, y [m] and yaw [deg]."""

    def walk(x, y, yaw_deg, **options):
        goal = Pose(x, y, math.radians(yaw_deg))
        footsteps = plan_footsteps(robot.config, half_sitting, goal, **options)
        return plan_walk(robot, standing(robot, half_sitting), footsteps)

    return walk


@pytest.fixture(scope="session")
def arc(walk_to):
    """A walk ahead and to the left that ends turned by 60 deg."""
    return walk_to(1.0, 0.4, 60.0)
