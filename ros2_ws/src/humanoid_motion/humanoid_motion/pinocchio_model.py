"""Pinocchio's model of the robot, built in one place for everything that uses Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import RobotConfig
from numpy.typing import NDArray


def free_floating_model(config: RobotConfig) -> Any:
    """Build Pinocchio's model of a robot whose base_link is free to move.

    Joints of the URDF that the configuration does not list are fixed at zero.

    Args:
        config: Configuration that names the URDF and its joints.

    Returns:
        The model, of type ``pinocchio.Model``. Its joint 1, ``root_joint``, is the free base: q
        begins with the position [m] and the quaternion (x, y, z, w) of base_link in the world,
        v with the linear [m/s] and angular [rad/s] velocity of base_link in its own axes. The
        robot's joints follow in the URDF's order, which may differ from `RobotConfig.joint_names`.

    Raises:
        ValueError: The URDF cannot be read.
    """
    model = pin.buildModelFromUrdf(str(config.urdf_path), pin.JointModelFreeFlyer())
    moving = {"universe", "root_joint", *config.joint_names}
    fixed = [model.getJointId(name) for name in model.names if name not in moving]
    if fixed:
        model = pin.buildReducedModel(model, fixed, pin.neutral(model))
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])  # Pinocchio's own default is 9.81
    return model


def joint_columns(
    model: Any, names: Sequence[str]
) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return where joints, given by their names, stand in Pinocchio's q and v, (J,) each."""
    joints = [model.joints[model.getJointId(name)] for name in names]
    return np.array([joint.idx_q for joint in joints]), np.array([joint.idx_v for joint in joints])
