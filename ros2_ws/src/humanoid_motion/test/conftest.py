"""The posture in which the robot stands in most tests."""

from dataclasses import dataclass

import numpy as np
import pytest
from humanoid_motion.robot_model import braced_upper_body
from humanoid_motion.whole_body import solve


@dataclass(frozen=True)
class Posture:
    """A posture, and the lever of its hit [m] and inertia about the CoM's x axis [kg m^2]."""

    waist_height: float
    joints: np.ndarray
    base: np.ndarray
    com: np.ndarray
    a_r: float
    i_rob: float


@dataclass(frozen=True)
class Stance:
    """Positions of the soles in odom by side [m], and the posture above them."""

    feet: dict
    posture: Posture


@pytest.fixture(scope="session")
def stance(robot):
    """About the stance of a hit: arm braced, right foot 0.2 m aside, CoM over its inner edge."""
    feet = {"left": np.array([0.0, 0.095, 0.0]), "right": np.array([0.0, -0.295, 0.0])}
    height = 0.5614
    joints, base = solve(robot, upper=braced_upper_body(robot), com_xy=np.array([0.015, -0.25]),
                         waist_z=height, feet=feet)
    q = robot.configuration(base[0], joints[0])
    com = robot.com(q)
    lever = float(robot.contact_position(q)[2] - com[2])
    inertia = float(robot.inertia_about_com(q)[0, 0])
    return Stance(feet, Posture(height, joints[0], base[0], com, lever, inertia))
