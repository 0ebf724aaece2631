"""Poses of the robot's links and its centre of mass in base_link, from the joint angles alone."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from hrp2_description.robot import RobotConfig
from numpy.typing import ArrayLike

from humanoid_motion.pinocchio_model import free_floating_model, joint_columns


class RobotKinematics:
    """Poses of links relative to ``base_link`` for the joint angles that were set last.

    An object must not be shared between threads, because Pinocchio's work space is reused.

    Args:
        robot: Configuration that names the URDF.

    Attributes:
        robot: Configuration of the robot.
        tree: Names (parent, child) of the links that each joint of the URDF joins.
    """

    def __init__(self, robot: RobotConfig) -> None:
        self.robot = robot
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._order, _ = joint_columns(self._model, robot.joint_names)
        # The base stays at the origin, so poses in Pinocchio's world are poses in base_link.
        self._configuration = np.array(pin.neutral(self._model))
        self._soles = {side: self._frame(foot.sole) for side, foot in robot.feet.items()}
        tree = [
            (joint.find("parent"), joint.find("child"))
            for joint in ET.parse(robot.urdf_path).getroot().findall("joint")
        ]
        self.tree: tuple[tuple[str, str], ...] = tuple(
            (parent.attrib["link"], child.attrib["link"])
            for parent, child in tree
            if parent is not None and child is not None
        )
        self._tree_frames = [(self._frame(one), self._frame(two)) for one, two in self.tree]

    def set_joints(self, positions: ArrayLike) -> None:
        """Set the joint angles.

        Args:
            positions: Angles in the order of the configuration's ``joint_names``, (J,) [rad].

        Raises:
            SettingError: There are not J angles, or an angle is not finite.
        """
        angles = np.asarray(positions, dtype=float)
        if angles.shape != (len(self._order),):
            raise SettingError("joint positions", angles.shape, f"shape ({len(self._order)},)")
        if not np.isfinite(angles).all():
            bad = int(np.flatnonzero(~np.isfinite(angles))[0])
            raise SettingError(self.robot.joint_names[bad], float(angles[bad]), "finite")
        self._configuration[self._order] = angles
        pin.forwardKinematics(self._model, self._data, self._configuration)

    def soles(self) -> dict[str, Array]:
        """Return the poses (4, 4) of the ``left`` and ``right`` sole in base_link."""
        return {
            side: np.array(pin.updateFramePlacement(self._model, self._data, frame).homogeneous)
            for side, frame in self._soles.items()
        }

    def pose(self, link: str) -> Array:
        """Return the pose (4, 4) of a link in base_link.

        Raises:
            SettingError: The robot has no such link.
        """
        frame = self._frame(link)
        return np.array(pin.updateFramePlacement(self._model, self._data, frame).homogeneous)

    def link_transforms(self) -> Array:
        """Return the pose of each child link in its parent, in the order of ``tree``.

        Returns:
            Rows (n, 7) with the position x, y, z [m] and the quaternion x, y, z, w.
        """
        pin.updateFramePlacements(self._model, self._data)
        poses = self._data.oMf
        return np.array(
            [pin.SE3ToXYZQUAT(poses[one].actInv(poses[two])) for one, two in self._tree_frames]
        )

    def com(self) -> Array:
        """Return the centre of mass of the whole robot in base_link, (3,) [m]."""
        return np.array(pin.centerOfMass(self._model, self._data, pin.POSITION, False))

    def _frame(self, link: str) -> int:
        if not self._model.existFrame(link):
            raise SettingError("link", link, "a link of the URDF")
        return int(self._model.getFrameId(link))


def inverse_pose(pose: Array) -> Array:
    """Return the inverse (4, 4) of a homogeneous pose (4, 4)."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverse


def planar_pose(x: float, y: float, yaw: float) -> Array:
    """Return the pose (4, 4) of a frame on the floor at x, y [m], turned about z by yaw [rad]."""
    pose = np.eye(4)
    cos, sin = np.cos(yaw), np.sin(yaw)
    pose[:2, :2] = [[cos, -sin], [sin, cos]]
    pose[:2, 3] = x, y
    return pose


def yaw_of(pose: Array) -> float:
    """Return the heading of a pose's x axis, its angle about the vertical [rad]."""
    return float(np.arctan2(pose[1, 0], pose[0, 0]))


def pose_row(pose: Array) -> Array:
    """Return a pose (4, 4) as its position x, y, z [m] and quaternion x, y, z, w, (7,)."""
    return np.array(pin.SE3ToXYZQUAT(pin.SE3(pose[:3, :3].copy(), pose[:3, 3].copy())))
