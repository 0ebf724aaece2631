"""Floor forces, ZMP and joint torques of a motion, from the full rigid-body dynamics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array

from humanoid_motion.chain import yaw_matrices
from humanoid_motion.motion import BaseYaw, Motion
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.zmp import zmp_of


@dataclass(frozen=True)
class Load:
    """An external force on the robot's hand at N samples.

    Attributes:
        point: Position of the hand's middle in odom, (N, 3) [m].
        force: Force on the hand, axes of odom, (N, 3) [N].
    """

    point: Array
    force: Array


@dataclass(frozen=True)
class Dynamics:
    """CoM of a motion, and the floor forces and joint torques that it needs, at N samples.

    Attributes:
        com: CoM in odom, (N, 3) [m].
        zmp: x and y of the ZMP in odom, (N, 2) [m]; NaN where the floor does not push.
        force: Force of the floor on the robot, axes of odom, (N, 3) [N].
        moment_z: Moment of the floor on the robot about the vertical through the ZMP, (N,) [N m].
        torque: Torques of the joints without the effect of the floor's force, (N, J) [N m].
    """

    com: Array
    zmp: Array
    force: Array
    moment_z: Array
    torque: Array

    @property
    def friction(self) -> Array:
        """Ratio of the tangential to the normal force of all feet together, (N,)."""
        return np.asarray(np.hypot(self.force[:, 0], self.force[:, 1]) / self.force[:, 2])


def inverse_dynamics(robot: RobotModel, motion: Motion, load: Load | None = None) -> Dynamics:
    """Compute CoM, floor forces, ZMP and joint torques of a motion by recursive Newton-Euler.

    Args:
        motion: The motion; base_link stays upright.
        load: External force on the hand, e.g. that of the door.
    """
    com, force, moment, torque = _newton_euler(robot, motion)
    if load is not None:
        force = force - load.force
        moment = moment - np.cross(load.point, load.force)
        hand = robot.hand_chain.place(motion.joints, motion.base, _heading(motion))
        torque[:, robot.hand_chain.columns] -= hand.torques(load.force, np.zeros_like(load.force))
    zmp = zmp_of(force, moment)
    moment_z = moment[:, 2] - (zmp[:, 0] * force[:, 1] - zmp[:, 1] * force[:, 0])
    return Dynamics(com=com, zmp=zmp, force=force, moment_z=moment_z, torque=torque)


def floor_wrenches(robot: RobotModel, motion: Motion) -> tuple[Array, Array]:
    """Compute the floor's force and its moment about odom's origin, (N, 3) each [N, N m]."""
    _, force, moment, _ = _newton_euler(robot, motion)
    return force, moment


def _newton_euler(robot: RobotModel, motion: Motion) -> tuple[Array, Array, Array, Array]:
    """Compute CoM, the floor's force, its moment about odom's origin, and all joints' torques."""
    n = len(motion)
    q = robot.configurations(motion.base, motion.joints, _heading(motion))
    v = np.zeros((n, robot.model.nv))
    v[:, :3] = motion.base_speed
    v[:, robot.v_index] = motion.joint_speed
    a = np.zeros((n, robot.model.nv))
    a[:, :3] = motion.base_acceleration
    a[:, robot.v_index] = motion.joint_acceleration
    turn = None if motion.base_yaw is None else _turn_base(motion.base_yaw, v, a)
    tau, com = np.empty_like(v), np.empty((n, 3))
    model, data = robot.model, robot.data
    for i in range(n):
        tau[i] = pin.rnea(model, data, q[i], v[i], a[i])
        # The joints' placements are known from `rnea`, so this takes a fifth of a call with q.
        com[i] = pin.centerOfMass(model, data, pin.POSITION, False)
    force, moment = tau[:, :3], tau[:, 3:6]
    if turn is not None:
        force, moment = _turned(turn, force), _turned(turn, moment)
    return com, force, moment + np.cross(motion.base, force), tau[:, robot.v_index]


def _heading(motion: Motion) -> Array | None:
    return None if motion.base_yaw is None else motion.base_yaw.angle


def _turn_base(yaw: BaseYaw, v: Array, a: Array) -> Array:
    """Turn the base in Pinocchio's v and a; return the rotation matrices, (N, 3, 3).

    Pinocchio's velocity of a free base is in the base's own axes, and its acceleration is the
    derivative of these components, which lacks the part omega x v of the acceleration in odom.
    """
    turn = yaw_matrices(yaw.angle)
    back = np.swapaxes(turn, 1, 2)
    v[:, :3], a[:, :3] = _turned(back, v[:, :3]), _turned(back, a[:, :3])
    v[:, 5], a[:, 5] = yaw.speed, yaw.acceleration
    a[:, 0] += yaw.speed * v[:, 1]
    a[:, 1] -= yaw.speed * v[:, 0]
    return turn


def _turned(turn: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", turn, vectors))


def joint_torques(
    robot: RobotModel,
    motion: Motion,
    dynamics: Dynamics,
    feet: dict[str, Array],
    sides: Sequence[str],
    feet_yaw: Mapping[str, float] | None = None,
) -> Array:
    """Compute the joint torques with the floor's force distributed over the feet.

    The share of each foot follows linearly from the position of the ZMP along the line between
    the soles' centres. The feet exert no internal force on each other.

    Args:
        dynamics: Inverse dynamics of the motion.
        feet: Positions of the soles in odom, by side, (3,) each [m].
        sides: Sides of the soles that bear load.
        feet_yaw: Headings of these soles in odom, by side [rad]; None means parallel to odom.

    Returns:
        Torques, (N, J) [N m].
    """
    yaw = feet_yaw or dict.fromkeys(sides, 0.0)
    centres = {side: robot.feet[side].corners(feet[side], yaw[side]).mean(axis=0)
               for side in sides}
    share = _shares(dynamics.zmp, centres)
    centre = sum(share[side][:, None] * centres[side] for side in sides)
    out = dynamics.torque.copy()
    for side in sides:
        place = np.column_stack([centres[side] + dynamics.zmp - centre, np.zeros(len(motion))])
        force = share[side][:, None] * dynamics.force
        moment = np.cross(place - np.asarray(feet[side], dtype=float), force)
        moment[:, 2] += share[side] * dynamics.moment_z
        chain = robot.leg_chains[side]
        pose = chain.place(motion.joints, motion.base, _heading(motion))
        out[:, chain.columns] -= pose.torques(force, moment)
    return out


def _shares(zmp: Array, centres: dict[str, Array]) -> dict[str, Array]:
    """Compute the share of the floor's force that each sole bears, (N,) each."""
    if len(centres) == 1:
        return {side: np.ones(len(zmp)) for side in centres}
    right, line = centres["right"], centres["left"] - centres["right"]
    part = np.clip((zmp - right) @ line / (line @ line), 0.0, 1.0)
    return {"left": part, "right": 1.0 - part}
