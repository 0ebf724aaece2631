"""Soles, CoM and ZMP that follow from a reference motion of the joints, computed by Pinocchio.

The lower sole of the reference is assumed to stand flat and still on the floor, which determines
the motion of base_link. All vectors are in the level frame: its origin is that of base_link, its
z axis is that of the lower sole, and its x axis points in the mean heading of the soles. So the
frame does not jump when the other sole becomes the lower one, and it turns with a robot that turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns
from humanoid_motion.spline import JointReference

from hrp2_sim_bridge.physics.engine import SimulatedRobot

_LEAST_LOAD = 0.2  # smallest normal force of the floor, as a share of the weight
_PARALLEL = 1e-6  # angle between the soles' headings below which they count as parallel [rad]
_SINGULAR = 0.01  # damping of the legs' inverse kinematics, for a straight knee [m, rad]
_ON_FLOOR = 0.002  # largest height over the lower sole at which the other sole stands, too [m]


@dataclass(frozen=True)
class ReferenceStance:
    """The reference at one time, in the level frame; rows are the left and the right foot.

    Attributes:
        zmp: x and y of the ZMP of the whole motion, on the floor, (2,) [m].
        com: Position of the CoM, (3,) [m].
        floor: Height of the floor [m].
        normal_force: Normal force of the floor on both soles together [N].
        force: Horizontal force of the floor on both soles together, (2,) [N].
        yaw_moment: Moment of the floor about the vertical through the frame's origin [N m].
        effort: Torques of the joints without the floor's forces, (J,) [N m].
        sole_force: Force of the floor on both soles together, in the axes of each, (2, 3) [N].
        centers: x and y of the soles' middles, (2, 2) [m].
        heights: Heights of the soles over the floor, (2,) [m].
        turns: Rotation matrices of the soles, (2, 3, 3).
        level: Rotation matrix of base_link, (3, 3).
        standing: Whether each sole is on the floor, (2,).
        legs: Transposed Jacobians of the soles by the joints of their legs, twists in the soles'
            frames, (2, 6, 6).
        to_joints: Damped inverses of these Jacobians, (2, 6, 6).
        imu: Rotation matrix of the IMU, (3, 3).
        imu_rate: Angular velocity of the IMU in its own frame, (3,) [rad/s].
    """

    zmp: Array
    com: Array
    floor: float
    normal_force: float
    force: Array
    yaw_moment: float
    effort: Array
    sole_force: Array
    centers: Array
    heights: Array
    turns: Array
    level: Array
    standing: tuple[bool, bool]
    legs: Array
    to_joints: Array
    imu: Array
    imu_rate: Array


class ReferenceStanceModel:
    """Computes the stance of a reference; of a reference that rests, only once.

    Args:
        robot: Configuration of the robot.

    Attributes:
        leg_joints: Indices of the left and the right leg's joints in the robot's order, (2, 6).
        middles: x and y of the soles' middles in the soles' frames, (2, 2) [m].
        half_size: Half the size of a sole along x and y, (2,) [m].
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._q_index, self._v_index = joint_columns(self._model, robot.joint_names)
        self._soles = [self._model.getFrameId(robot.feet[side].sole) for side in SIDES]
        self._imu = self._model.getFrameId(robot.imu_frame)
        self.leg_joints = np.array(
            [[robot.index(name) for name in robot.legs[side]] for side in SIDES])
        self._leg_columns = self._v_index[self.leg_joints]
        rectangles = np.array([robot.soles[side] for side in SIDES])
        self.middles = np.stack(
            [rectangles[:, :2].mean(axis=1), rectangles[:, 2:].mean(axis=1)], axis=1)
        self.half_size = np.array([np.ptp(rectangles[0, :2]), np.ptp(rectangles[0, 2:])]) / 2.0
        self._least_load = _LEAST_LOAD * robot.mass * GRAVITY
        self._q = pin.neutral(self._model)
        self._regular = _SINGULAR**2 * np.eye(6)
        self._resting: tuple[Array, ReferenceStance] | None = None

    def at(self, reference: JointReference) -> ReferenceStance:
        """Compute the stance.

        Args:
            reference: Positions, velocities and accelerations of the joints, (J,) each.
        """
        if reference.velocity.any() or reference.acceleration.any():
            return self._compute(reference)
        if self._resting is None or not np.array_equal(self._resting[0], reference.position):
            self._resting = reference.position.copy(), self._compute(reference)
        return self._resting[1]

    def _compute(self, reference: JointReference) -> ReferenceStance:
        model, data, q = self._model, self._data, self._q
        v, a = np.zeros(model.nv), np.zeros(model.nv)
        q[self._q_index] = reference.position
        v[self._v_index] = reference.velocity
        a[self._v_index] = reference.acceleration
        pin.forwardKinematics(model, data, q, v, a)
        poses = [pin.updateFramePlacement(model, data, frame) for frame in self._soles]
        rotations, origins = [p.rotation for p in poses], [p.translation for p in poses]
        up = rotations[0][:, 2]
        lower = 0 if up.dot(origins[0]) <= up.dot(origins[1]) else 1
        level = _level_axes(rotations[lower].T, rotations[1 - lower])
        # The lower sole is at rest, so base_link has the opposite of the sole's relative motion.
        sole, world = self._soles[lower], pin.ReferenceFrame.WORLD
        v[:6] = -pin.getFrameVelocity(model, data, sole, world).vector
        a[:6] = -pin.getFrameAcceleration(model, data, sole, world).vector
        model.gravity.linear = -GRAVITY * level[2]
        effort = pin.rnea(model, data, q, v, a)
        wrench = effort[:6]
        imu = pin.updateFramePlacement(model, data, self._imu)
        imu_velocity = pin.getFrameVelocity(model, data, self._imu, pin.ReferenceFrame.LOCAL)
        pin.computeJointJacobians(model, data)
        jacobians = [pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
                     for frame in self._soles]
        turns = np.array([level.dot(rotation) for rotation in rotations])
        places = np.array([level.dot(origin) for origin in origins])
        centers = places[:, :2] + np.einsum("ijk,ik->ij", turns[:, :2, :2], self.middles)
        floor = float(places[lower, 2])
        force, torque = level.dot(wrench[:3]), level.dot(wrench[3:])
        normal = max(float(force[2]), self._least_load)
        heights = places[:, 2] - floor
        carried = np.array([force[0], force[1], normal])
        turned = np.stack([jacobian[:, columns].T for jacobian, columns in zip(
            jacobians, self._leg_columns, strict=True)])
        legs = turned.transpose(0, 2, 1)
        return ReferenceStance(
            zmp=np.array([floor * force[0] - torque[1], floor * force[1] + torque[0]]) / normal,
            com=level.dot(pin.centerOfMass(model, data, False)),
            floor=floor,
            normal_force=normal,
            force=force[:2],
            yaw_moment=float(torque[2]),
            effort=effort[self._v_index],
            sole_force=carried @ turns,
            centers=centers,
            heights=heights,
            turns=turns,
            level=level,
            standing=(bool(heights[0] < _ON_FLOOR), bool(heights[1] < _ON_FLOOR)),
            legs=turned,
            to_joints=turned @ np.linalg.inv(legs @ turned + self._regular),
            imu=level.dot(imu.rotation),
            imu_rate=np.array(imu_velocity.angular))


def _level_axes(lower: Array, other: Array) -> Array:
    """Turn the transposed rotation matrix of the lower sole to the mean heading of both soles."""
    x, y = lower[:2].dot(other[:, 0])
    yaw = math.atan2(y, x)
    if abs(yaw) < _PARALLEL:
        return lower
    cos, sin = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]).dot(lower)
