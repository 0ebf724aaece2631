"""What a reference motion of the joints means for the body: soles, CoM, ZMP (Pinocchio).

The sole that the reference holds lower stands flat and still on the floor; that alone fixes how
base_link moves. Everything is said in the level frame: origin in base_link's, axes of that sole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES, RobotConfig, needed
from humanoid_motion.spline import JointState

_LEAST_LOAD = 0.2  # share of the weight that the floor bears at least, however fast the motion
_ON_FLOOR = 0.002  # a sole no higher than this over the other stands, too [m]


@dataclass(frozen=True)
class Stance:
    """The reference at one time, in the level frame; rows are the left and the right foot.

    Attributes:
        zmp: (2,) of the whole motion, on the floor [m].
        com: (3,) [m].
        floor: height of the floor [m].
        normal_force: of the floor on both soles [N].
        centers: (2, 2) middles of the soles [m].
        turns: (2, 3, 3) axes of the soles.
        standing: (2,) whether a sole is on the floor.
        legs: (2, 6, 6) twist of the sole in its frame [m/s, rad/s] by the leg's joints [rad/s].
        imu: (3, 3) axes of the IMU.
        imu_rate: (3,) angular velocity of the IMU in its frame [rad/s].
    """

    zmp: Array
    com: Array
    floor: float
    normal_force: float
    centers: Array
    turns: Array
    standing: tuple[bool, bool]
    legs: Array
    imu: Array
    imu_rate: Array


class StanceModel:
    """Works stances out.

    Args:
        robot: configuration.

    Attributes:
        leg_joints: (2, 6) places of the left and right leg's joints in HRP-2's order.
        middles: (2, 2) x and y of the soles' middles in their frames [m].
        half_size: (2,) of a sole along x and y [m].
    """

    def __init__(self, robot: RobotConfig) -> None:
        self._model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
        self._data = self._model.createData()
        joints = [self._model.joints[self._model.getJointId(n)] for n in robot.joint_names]
        self._q_index = [joint.idx_q for joint in joints]
        self._v_index = [joint.idx_v for joint in joints]
        self._soles = [self._model.getFrameId(robot.feet[side].sole) for side in SIDES]
        self._imu = self._model.getFrameId(needed(robot.imu_frame, "imu_frame"))
        self.leg_joints = np.array(
            [[robot.index(name) for name in robot.legs[side]] for side in SIDES])
        self._leg_columns = np.array(self._v_index)[self.leg_joints]
        rectangles = np.array([robot.soles[side] for side in SIDES])
        self.middles = np.stack(
            [rectangles[:, :2].mean(axis=1), rectangles[:, 2:].mean(axis=1)], axis=1
        )
        self.half_size = np.array([np.ptp(rectangles[0, :2]), np.ptp(rectangles[0, 2:])]) / 2.0
        self._least_load = _LEAST_LOAD * robot.mass * GRAVITY
        self._q = pin.neutral(self._model)

    def at(self, reference: JointState) -> Stance:
        """The stance of a reference of the joints (30,), of any speed and acceleration."""
        model, data, q = self._model, self._data, self._q
        v, a = np.zeros(model.nv), np.zeros(model.nv)
        q[self._q_index] = reference.position
        v[self._v_index] = reference.velocity
        a[self._v_index] = reference.acceleration
        pin.forwardKinematics(model, data, q, v, a)
        poses = [pin.updateFramePlacement(model, data, frame) for frame in self._soles]
        up = poses[0].rotation[:, 2]
        heights = [float(up @ pose.translation) for pose in poses]
        lower = 0 if heights[0] <= heights[1] else 1
        level = poses[lower].rotation.T
        # The standing sole is at rest, so base_link moves as the sole does not.
        sole, world = self._soles[lower], pin.ReferenceFrame.WORLD
        v[:6] = -pin.getFrameVelocity(model, data, sole, world).vector
        a[:6] = -pin.getFrameAcceleration(model, data, sole, world).vector
        model.gravity.linear = -GRAVITY * level[2]
        wrench = pin.rnea(model, data, q, v, a)[:6]
        imu = pin.updateFramePlacement(model, data, self._imu)
        imu_velocity = pin.getFrameVelocity(model, data, self._imu, pin.ReferenceFrame.LOCAL)
        pin.computeJointJacobians(model, data, q)
        jacobians = np.stack([pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
                              for frame in self._soles])
        turns = np.array([level @ pose.rotation for pose in poses])
        places = np.array([level @ pose.translation for pose in poses])
        centers = places[:, :2] + np.einsum("ijk,ik->ij", turns[:, :2, :2], self.middles)
        floor = float(places[lower, 2])
        force, torque = level @ wrench[:3], level @ wrench[3:]
        normal = max(float(force[2]), self._least_load)
        return Stance(
            zmp=np.array([floor * force[0] - torque[1], floor * force[1] + torque[0]]) / normal,
            com=level @ pin.centerOfMass(model, data, q, False),
            floor=floor,
            normal_force=normal,
            centers=centers,
            turns=turns,
            standing=(
                bool(places[0, 2] - floor < _ON_FLOOR), bool(places[1, 2] - floor < _ON_FLOOR)
            ),
            legs=np.stack([jacobians[i][:, self._leg_columns[i]] for i in range(len(SIDES))]),
            imu=level @ imu.rotation,
            imu_rate=np.array(imu_velocity.angular),
        )
