"""Kinematics and dynamics of a humanoid: a thin layer over Pinocchio.

Joint vectors are in the robot's own order, `RobotConfig.joint_names`; a shape (J,) has one entry
for each joint. Joints of the URDF that are not in this list are fixed at zero. The base is a free
joint; in every planned motion base_link stays upright, and in those of the hit its axes stay
parallel to those of odom. q and v are Pinocchio's vectors of configuration and velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES, RobotConfig
from hrp2_description.support import sole_corners
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.chain import Chain
from humanoid_motion.leg_ik import is_parallel
from humanoid_motion.numerical_leg import leg_of
from humanoid_motion.pinocchio_model import (
    coal,
    collision_shapes,
    free_floating_model,
    joint_columns,
    link_tree,
)

TOWARDS_DOOR = (0.0, -1.0, 0.0)  # direction of the hit in odom
_LEVEL = 1e-4  # largest tilt [rad] and difference in height [m] of the soles in half-sitting
# Heights of HRP-2's base_link and of its right shoulder in half-sitting [m].
_STANDING_HEIGHT, _SHOULDER_HEIGHT = 0.6487018511825304, 1.1804018511825305
_SQUAT = 0.525  # distance from hip to ankle in the deepest squat, as a share of the leg's length


@dataclass(frozen=True)
class Foot:
    """The sole of a foot and the area on which it can stand.

    Attributes:
        frame: Name of the sole's frame.
        sole: Position of the sole's frame relative to the ankle's centre, in the foot's axes,
            (3,) [m].
        rectangle: x_min, x_max, y_min, y_max of the support area in the sole's frame [m].
    """

    frame: str
    sole: Array
    rectangle: tuple[float, float, float, float]

    def corners(self, position: ArrayLike, yaw: float = 0.0) -> Array:
        """Compute the corners of the support area, (4, 2) [m].

        Args:
            position: Position of the sole in odom, (3,) [m].
            yaw: Heading of the sole in odom [rad].
        """
        x, y = np.asarray(position, dtype=float)[:2]
        return np.asarray(sole_corners(self.rectangle, (x, y, yaw)))


class RobotModel:
    """Kinematics and dynamics of the robot.

    An object must not be shared between threads, because Pinocchio's work space is reused.

    Attributes:
        config: Configuration of the robot.
        model: Pinocchio's model.
        data: Pinocchio's work space.
        joint_names: Names of the joints in the robot's order.
        q_index: Index of each joint in q, (J,).
        v_index: Index of each joint in v, (J,).
        lower: Lower ends of the joints' ranges, (J,) [rad].
        upper: Upper ends of the joints' ranges, (J,) [rad].
        speed_limit: Largest speeds of the joints, (J,) [rad/s].
        effort_limit: Largest torques of the joints, (J,) [N m].
        mass: Mass of the whole robot [kg].
        legs: Dimensions of the legs, by side.
        feet: Feet, by side.
        leg_columns: Columns of the legs' joints in the robot's order, by side.
        arm_columns: Columns of the hitting arm's joints in the robot's order.
        leg_chains: Chains from base_link to the soles, by side.
        hand_chain: Chain from base_link to the hand of the hitting arm.
    """

    def __init__(self, config: RobotConfig) -> None:
        """Load the URDF that the robot's configuration names.

        Raises:
            RobotConfigError: A leg cannot be solved, a sole is not parallel to the base in the zero
                posture, or the soles of half-sitting are not level on one floor.
        """
        self.config = config
        self.model: Any = free_floating_model(config)
        self.data: Any = self.model.createData()
        self.joint_names: tuple[str, ...] = tuple(config.joint_names)
        self.q_index, self.v_index = joint_columns(self.model, self.joint_names)
        self.lower, self.upper = config.lower, config.upper
        self.speed_limit, self.effort_limit = config.velocity_limit, config.effort_limit
        self.mass = float(pin.computeTotalMass(self.model))
        self.legs = {side: leg_of(self.model, side, config.legs[side], config.half_sitting[
            self.indices(config.legs[side])]) for side in SIDES}
        self.feet = {side: self._foot(side) for side in SIDES}
        self.leg_columns = {side: self.indices(config.legs[side]) for side in SIDES}
        self.arm_columns = self.indices(config.arm.joints)
        self.leg_chains = {side: self._chain(self.feet[side].frame) for side in SIDES}
        self.hand_chain = self._chain(config.hand_link)
        self._require_level_soles()

    # -- configuration ---------------------------------------------------------------------

    def configuration(self, base: ArrayLike, joints: ArrayLike, yaw: float = 0.0) -> Array:
        """Compose q of an upright base_link and of joints.

        Args:
            base: Position of base_link in odom, (3,) [m].
            joints: Joints, (J,) [rad].
            yaw: Heading of base_link in odom [rad].
        """
        return self.configurations(np.asarray(base), np.asarray(joints)[None], np.array(yaw))[0]

    def configurations(self, base: Array, joints: Array, yaw: Array | None = None) -> Array:
        """Compose q as `configuration` does for N samples: (N, 3), (N, J) and (N,)."""
        q = np.tile(np.array(pin.neutral(self.model)), (len(joints), 1))
        q[:, :3] = base
        q[:, self.q_index] = joints
        if yaw is not None:
            q[:, 5], q[:, 6] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
        return q

    def velocity(self, base: ArrayLike, joints: ArrayLike) -> Array:
        """Compose v of a base_link that moves with (3,) [m/s] upright, and of joints (J,) [rad/s].

        Accelerations are composed in the same way.
        """
        v = np.zeros(self.model.nv)
        v[:3] = base
        v[self.v_index] = joints
        return v

    def indices(self, names: Sequence[str]) -> NDArray[np.int_]:
        """Return the columns of joints in the robot's order."""
        return np.array([self.joint_names.index(name) for name in names], dtype=int)

    # -- figures of one posture --------------------------------------------------------------

    @cached_property
    def standing_height(self) -> float:
        """Height of base_link above the floor in half-sitting [m]."""
        q = self.configuration(np.zeros(3), self.config.half_sitting)
        return -float(self.frame_position(q, self.feet["right"].frame)[2])

    @property
    def height_scale(self) -> float:
        """This height over HRP-2's; heights are stated for HRP-2, and are used times this."""
        return self.standing_height / _STANDING_HEIGHT

    @cached_property
    def shoulder_scale(self) -> float:
        """Height of the right shoulder in half-sitting over HRP-2's: lengths of what arms do."""
        q = self.configuration([0.0, 0.0, self.standing_height], self.config.half_sitting)
        pin.forwardKinematics(self.model, self.data, q)
        first = self.data.oMi[self.model.getJointId(self.config.arm.joints[0])]
        return float(first.translation[2]) / _SHOULDER_HEIGHT

    def folded_by(self, joints: ArrayLike) -> float:
        """Return the largest distance of a joint of the upper body from half-sitting [rad]."""
        legs = [column for columns in self.leg_columns.values() for column in columns]
        return float(np.abs(np.delete(np.asarray(joints) - self.config.half_sitting, legs)).max())

    def com(self, q: Array) -> Array:
        """Compute the centre of mass in odom, (3,) [m]."""
        return np.array(pin.centerOfMass(self.model, self.data, q))

    def inertia_about_com(self, q: Array) -> Array:
        """Compute the inertia of the stiff robot about its CoM, axes of odom, (3, 3) [kg m^2]."""
        pin.ccrba(self.model, self.data, q, np.zeros(self.model.nv))
        return np.array(self.data.Ig.inertia)

    def mass_matrix(self, q: Array) -> Array:
        """Compute Pinocchio's joint-space inertia matrix without the motors' rotors, (nv, nv)."""
        upper = np.triu(np.array(pin.crba(self.model, self.data, q)))
        return np.asarray(upper + np.triu(upper, 1).T)

    def contact_position(self, q: Array) -> Array:
        """Compute the centre of the body that hits (the elbow) in odom, (3,) [m]."""
        return self.frame_position(q, self.config.contact_link)

    def frame_position(self, q: Array, name: str) -> Array:
        """Compute the origin of a frame in odom, (3,) [m]."""
        return self.frame_pose(q, name)[0]

    def frame_pose(self, q: Array, name: str) -> tuple[Array, Array]:
        """Compute the origin (3,) [m] and the orientation (3, 3) of a frame in odom."""
        pin.forwardKinematics(self.model, self.data, q)
        pose = pin.updateFramePlacement(self.model, self.data, self._frame_id(name))
        return np.array(pose.translation), np.array(pose.rotation)

    def poses_in_base(self, joints: ArrayLike, names: Sequence[str]) -> list[Array]:
        """Compute the poses (4, 4) of frames in base_link for joints (J,) [rad]."""
        pin.forwardKinematics(
            self.model, self.data, self.configuration(np.zeros(3), joints))
        return [
            np.array(pin.updateFramePlacement(self.model, self.data, index).homogeneous)
            for index in map(self._frame_id, names)]

    def base_tilt(self, joints: ArrayLike, imu: Array) -> float:
        """Compute the angle between base_link's z axis and the vertical [rad].

        Args:
            joints: Joints, (J,) [rad].
            imu: Rotation of the IMU in the world, (3, 3); without `imu_frame` that of base_link.
        """
        frame, vertical = self.config.imu_frame, imu[2]
        if frame is not None:
            vertical = self.poses_in_base(joints, [frame])[0][:3, :3] @ vertical
        x, y, z = vertical.tolist()
        return math.atan2(math.hypot(x, y), z)

    @cached_property
    def tree(self) -> tuple[tuple[str, str], ...]:
        """Names (parent, child) of the links that each joint of the URDF joins."""
        return link_tree(self.config)

    @cached_property
    def _tree_frames(self) -> list[tuple[int, int]]:
        return [(self._frame_id(one), self._frame_id(two)) for one, two in self.tree]

    def link_transforms(self, joints: ArrayLike) -> Array:
        """Compute the pose of each child link in its parent, in the order of `tree`.

        Args:
            joints: Joints in the robot's order, (J,) [rad].

        Returns:
            Rows (n, 7) with the position x, y, z [m] and the quaternion x, y, z, w.
        """
        q = self.configuration(np.zeros(3), joints)
        pin.framesForwardKinematics(self.model, self.data, q)
        poses = self.data.oMf
        return np.array(
            [pin.SE3ToXYZQUAT(poses[one].actInv(poses[two])) for one, two in self._tree_frames])

    def contact_jacobian(self, q: Array) -> Array:
        """Compute the Jacobian of `contact_position`, axes of odom, (3, nv)."""
        return self.frame_jacobian(q, self.config.contact_link)[:3]

    def effective_mass(
        self,
        q: Array,
        *,
        locked: Sequence[str],
        feet: Sequence[str] = SIDES,
        rotors: float = 0.0,
    ) -> float:
        """Compute the effective mass of point B in a hit during which joints yield [kg].

        This is the operational inertia (Khatib 1987)
        ``1 / (J_B (M^-1 - M^-1 Jc^T (Jc M^-1 Jc^T)^-1 Jc M^-1) J_B^T)`` with the feet fixed on the
        floor as constraints Jc. Plans use the more detailed ``hit_response`` of impact_planner.

        Args:
            q: Configuration at the hit.
            locked: Names of the joints that do not yield.
            feet: Sides whose foot stays on the floor, ``left`` or ``right``; may be empty.
            rotors: Multiple of the rotors' inertia, gear^2 J, that is added to each joint.
        """
        m = self.mass_matrix(q)
        m[self.v_index, self.v_index] += rotors * self.config.armature
        free = np.setdiff1d(np.arange(self.model.nv), self.v_index[self.indices(locked)])
        jb = (np.array(TOWARDS_DOOR) @ self.contact_jacobian(q))[free]
        minv = np.linalg.inv(m[np.ix_(free, free)])
        change = minv @ jb
        if feet:
            jc = np.vstack([self.frame_jacobian(q, self.feet[side].frame) for side in feet])
            jc = jc[:, free]
            mj = minv @ jc.T
            change = change - mj @ np.linalg.solve(jc @ mj, mj.T @ jb)
        return 1.0 / float(jb @ change)

    def frame_jacobian(self, q: Array, name: str) -> Array:
        """Compute the Jacobian of a frame, axes of odom, linear rows first, (6, nv)."""
        return self.frames_at(q, [name])[0][1]

    def frames_at(self, q: Array, names: Sequence[str]) -> list[tuple[Array, Array]]:
        """Compute the position in odom (3,) [m] and the Jacobian (6, nv) of each frame."""
        pin.computeJointJacobians(self.model, self.data, q)
        found = []
        for name in names:
            index = self._frame_id(name)
            place = pin.updateFramePlacement(self.model, self.data, index).translation
            jacobian = pin.getFrameJacobian(
                self.model, self.data, index, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            found.append((np.array(place), np.array(jacobian)))
        return found

    @cached_property
    def hand_radius(self) -> float:
        """Radius of the hand [m]: the configured one, or that of its collision sphere in the URDF.

        Raises:
            RobotConfigError: Neither the configuration nor the URDF gives a radius.
        """
        if self.config.hand_radius is not None:
            return self.config.hand_radius
        link = self.config.hand_link
        for item in collision_shapes(self.model, self.config)[0].geometryObjects:
            is_hands = self.model.frames[item.parentFrame].name == link
            if is_hands and isinstance(item.geometry, coal.Sphere):
                return float(item.geometry.radius)
        raise RobotConfigError(
            f"link {link!r} has no collision sphere in the URDF: add one, or set hand_radius",
            limit="a collision sphere or hand_radius",
        )

    def waist_heights(self) -> tuple[float, float]:
        """Compute the heights of base_link in a deep squat and on stretched legs [m]."""
        leg, sole = self.legs["right"], self.feet["right"].sole
        floor = float(leg.hip[2] + sole[2])
        return _SQUAT * leg.length - floor, leg.length - floor

    # -- reading the model --------------------------------------------------------------------

    def _frame_id(self, name: str) -> int:
        if not self.model.existFrame(name):
            raise ValueError(f"the URDF has no frame {name!r}")
        return int(self.model.getFrameId(name))

    def _chain(self, frame: str) -> Chain:
        self._frame_id(frame)
        return Chain(self.model, self.joint_names, frame)

    def _foot(self, side: str) -> Foot:
        name = self.config.feet[side].sole
        frame = self.model.frames[self._frame_id(name)]
        last, carrier = self.config.legs[side][-1], str(self.model.names[frame.parentJoint])
        if carrier != last:
            raise RobotConfigError(f"{name} hangs on another joint", value=carrier, limit=last)
        if not is_parallel(frame.placement):
            raise RobotConfigError(
                f"{name} is not parallel to the base in the zero posture",
                value=np.round(frame.placement.rotation, 3).tolist(),
                limit="parallel",
            )
        return Foot(
            frame=name,
            sole=np.array(frame.placement.translation),
            rectangle=self.config.soles[side],
        )

    def _require_level_soles(self) -> None:
        """Check half-sitting, in which motions begin: level soles, parallel to the base."""
        q = self.configuration(np.zeros(3), self.config.half_sitting)
        poses = {side: self.frame_pose(q, self.feet[side].frame) for side in SIDES}
        for side, (position, rotation) in poses.items():
            tilt = float(np.abs(rotation - np.eye(3)).max())
            step = float(abs(position[2] - poses[SIDES[0]][0][2]))
            if max(tilt, step) > _LEVEL:
                raise RobotConfigError(
                    f"half_sitting: the {side} sole is not level, parallel to the base and on one "
                    "floor with the other: tilt [rad] and height [m]",
                    value=(round(tilt, 5), round(step, 5)),
                    limit=_LEVEL,
                )


def braced_upper_body(robot: RobotModel) -> Array:
    """Return the joints of half-sitting with the hitting arm braced, (J,) [rad]."""
    return np.asarray(robot.config.posture(robot.config.braced_posture), dtype=float)
