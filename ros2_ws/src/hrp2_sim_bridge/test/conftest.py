"""Robot, door and worlds that several tests use."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from door_model.door.config import DoorConfig, load_door
from hrp2_description.robot import RobotConfig, load_robot_config
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TrajectoryArrays
from robot_driver.trajectory_checks import JointLimits

ANKLE_X = 0.3 * np.sin(np.radians(26.0)) - 0.3 * np.sin(np.radians(24.0))
LEG = 0.3 * np.cos(np.radians(26.0)) + 0.3 * np.cos(np.radians(24.0))


@pytest.fixture(scope="session")
def robot() -> RobotConfig:
    """The configuration of HRP-2."""
    return load_robot_config()


@pytest.fixture(scope="session")
def paper_door() -> DoorConfig:
    """The configuration of the paper's door."""
    return load_door("paper")


@pytest.fixture(scope="session")
def limits(robot: RobotConfig) -> JointLimits:
    """The limits of HRP-2's joints."""
    return JointLimits.of(robot)


@pytest.fixture
def make_world(robot: RobotConfig, paper_door: DoorConfig) -> Iterator[Callable[..., World]]:
    """A function that makes worlds with the paper's door, which are closed afterwards."""
    worlds = []

    def make(door_distance: float = 0.9, **settings: object) -> World:
        worlds.append(World(robot, paper_door, door_distance, -0.42, **settings))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


@pytest.fixture(scope="session")
def sway(robot: RobotConfig) -> Callable[..., np.ndarray]:
    """A function for the posture with the body shifted sideways by y [m] over parallel legs."""

    def posture(y: float, base: np.ndarray | None = None) -> np.ndarray:
        q = np.array(robot.half_sitting if base is None else base)
        for side, sign in (("R", -1.0), ("L", 1.0)):
            # From the hip axes to the ankle; the shank carries the ankle 35 mm outside of the hip.
            x, across, down = ANKLE_X, sign * 0.035 - y, LEG
            roll = np.arctan2(across, down) - np.arcsin(sign * 0.035 / np.hypot(across, down))
            length = np.sqrt(across**2 + down**2 - 0.035**2)
            knee = 2.0 * np.arccos(np.hypot(x, length) / 0.6)
            hip = -np.arctan2(x, length) - knee / 2.0
            angles = (0.0, roll, hip, knee, -hip - knee, -roll)
            first = robot.index(f"{side}LEG_JOINT0")
            q[first : first + 6] = angles
        return q

    return posture


@pytest.fixture(scope="session")
def moving(robot: RobotConfig) -> Callable[..., TrajectoryArrays]:
    """A function for a trajectory through postures (K, 30) at times (K), at rest at both ends."""

    def trajectory(times: np.ndarray, postures: np.ndarray) -> TrajectoryArrays:
        from scipy.interpolate import CubicSpline

        curve = CubicSpline(times, postures, bc_type="clamped")
        return TrajectoryArrays(
            robot.joint_names, times.tolist(), postures.tolist(),
            curve(times, 1).tolist(), curve(times, 2).tolist())

    return trajectory
