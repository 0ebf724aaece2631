"""HRP-2 in the simulator: its place, its raw sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.frames import BodyState, cross
from hrp2_sim_bridge.rotors import load_robot
from hrp2_sim_bridge.servos import JointServos
from hrp2_sim_bridge.spline import Array

SIDES = ("left", "right")
_FASTEST_JOINT = 1000.0  # PyBullet's own clamp, out of the way [rad/s]


class RobotBody:
    """HRP-2 standing in a posture, soles on the floor, the world's origin midway between them.

    Args:
        client: of PyBullet.
        robot: configuration.
        posture: (30,) [rad].
        rotor_scale: multiple of the rotors' inertia.

    Raises:
        ModelError: PyBullet changed a mass, an inertia or the order of things.
    """

    def __init__(
        self, client: Any, robot: RobotConfig, posture: Array, *, rotor_scale: float
    ) -> None:
        self._client = client
        self.robot = robot
        self.body = load_robot(client, robot, rotor_scale)
        infos = [client.getJointInfo(self.body, i) for i in range(client.getNumJoints(self.body))]
        self.link_names = tuple(info[12].decode() for info in infos)
        self.link_index = {name: index for index, name in enumerate(self.link_names)}
        joint_index = {info[1].decode(): index for index, info in enumerate(infos)}
        self._joints = [joint_index[name] for name in robot.joint_names]
        self.soles = {side: self.link_index[robot.feet[side].sole] for side in SIDES}
        self._sensors = [joint_index[robot.feet[side].sensor_joint] for side in SIDES]
        self._imu = self.link_index[robot.imu_frame]
        self._contact = self.link_index[robot.contact_link]
        self._frames = [*self.soles.values(), self._contact, self._imu]
        self._quiet_defaults([info[2] for info in infos])
        self._anchor_soles()
        for sensor in self._sensors:
            client.enableJointForceTorqueSensor(self.body, sensor, 1)
        offset = client.getDynamicsInfo(self.body, -1)[3:5]
        self._base_offset = offset
        self._base_offset_back = client.invertTransform(*offset)
        self.sole_mass, self.sole_inertia = self._sole_bodies()
        self.servos = JointServos(client, self.body, self._joints, robot)
        self._place(posture)

    def _quiet_defaults(self, joint_types: list[int]) -> None:
        """No damping, no default motors, no limit constraints (servos against them pump force)."""
        client = self._client
        for index in range(-1, len(joint_types)):
            client.changeDynamics(
                self.body, index, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0,
                lateralFriction=1.0, restitution=0.0, maxJointVelocity=_FASTEST_JOINT,
            )
            if index >= 0 and joint_types[index] != client.JOINT_FIXED:
                # Lower above upper means free: the driver keeps the limits.
                client.changeDynamics(self.body, index, jointLowerLimit=1.0, jointUpperLimit=-1.0)
                client.setJointMotorControl2(self.body, index, client.VELOCITY_CONTROL, force=0.0)

    def _anchor_soles(self) -> None:
        """Friction that holds a place, not only a speed: else soles creep 0.3 mm in 25 s."""
        for sole in self.soles.values():
            self._client.changeDynamics(self.body, sole, frictionAnchor=1)

    def _sole_bodies(self) -> tuple[Array, Array]:
        """Mass (2,) and principal inertia (2, 3) below each sensor.

        The sensor reports in that body's inertial frame: it must be the link's own.
        """
        infos = [self._client.getDynamicsInfo(self.body, index) for index in self.soles.values()]
        for index, info in zip(self.soles.values(), infos, strict=True):
            if np.abs(info[3]).max() > 1e-9 or abs(abs(info[4][3]) - 1.0) > 1e-9:
                raise ModelError(
                    self.link_names[index], info[3:5], "the link's own frame", "inertial frame"
                )
        return np.array([info[0] for info in infos]), np.array([info[2] for info in infos])

    def _place(self, posture: Array) -> None:
        client = self._client
        for joint, angle in zip(self._joints, posture, strict=True):
            client.resetJointState(self.body, joint, float(angle), 0.0)
        self._set_base(np.zeros(3))
        feet = np.array([self.frame(self.soles[side]).position for side in SIDES])
        self._set_base(np.array([-feet[:, 0].mean(), -feet[:, 1].mean(), -feet[:, 2].min()]))

    def _set_base(self, position: Array) -> None:
        pose = self._client.multiplyTransforms(
            position.tolist(), [0.0, 0.0, 0.0, 1.0], *self._base_offset
        )
        self._client.resetBasePositionAndOrientation(self.body, *pose)

    def read_reactions(self) -> tuple[Sequence[float], Sequence[float]]:
        """What each ankle exerts on its sole (left, right), in the sole's frame, by PyBullet."""
        left, right = self._client.getJointStates(self.body, self._sensors)
        return left[2], right[2]

    def read_joints(self) -> Array:
        """Positions [rad], velocities [rad/s] and motor torques [N m] (3, 30)."""
        q, dq, _, torque = zip(*self._client.getJointStates(self.body, self._joints), strict=True)
        return np.array([q, dq, torque])

    def read_frames(self) -> tuple[Any, ...]:
        """States of left sole, right sole, contact link, IMU and base, as PyBullet has them.

        `frame_states` makes arrays of several readings at once.
        """
        client = self._client
        return (
            *client.getLinkStates(self.body, self._frames, 1),
            (*client.getBasePositionAndOrientation(self.body), *client.getBaseVelocity(self.body)),
        )

    def frame_states(self, readings: Sequence[tuple[Any, ...]]) -> tuple[BodyState, BodyState]:
        """States of T readings: (T, 4) of left sole, right sole, contact link and IMU; (T,) of base.
        """
        links = _link_states([reading[:-1] for reading in readings])
        return links, self._base_states([reading[-1] for reading in readings])

    def _base_states(self, rows: Sequence[Any]) -> BodyState:
        """Free of PyBullet's inertial frame."""
        client = self._client
        placed = [client.multiplyTransforms(*row[:2], *self._base_offset_back) for row in rows]
        position = np.array([pose[0] for pose in placed])
        quaternion = np.array([pose[1] for pose in placed])
        angular = np.array([row[3] for row in rows])
        arm = position - np.array([row[0] for row in rows])
        linear = np.array([row[2] for row in rows]) + cross(angular, arm)
        return BodyState(position, quaternion, linear, angular)

    def frame(self, link: int) -> BodyState:
        """State of a link's own frame."""
        return _link_states([[self._client.getLinkState(self.body, link, 1, 1)]]).at((0, 0))

    def contact_sphere(self) -> BodyState:
        """State of the middle of the body that hits the door, point B."""
        return self.frame(self._contact)

    def floor_touchers(self, floor: int) -> set[str]:
        """Names of the links on the floor, soles left out."""
        names = set()
        for point in self._client.getContactPoints(self.body, floor):
            if point[3] not in self.soles.values() and point[8] <= 0.0:
                names.add(self.link_names[point[3]] if point[3] >= 0 else "base_link")
        return names


def _link_states(readings: Sequence[Sequence[Any]]) -> BodyState:
    """States (T, L) of links' own frames from what getLinkState says (its velocity is the CoM's)."""
    com, position, quaternion, linear, angular = (
        np.array([[link[entry] for link in links] for links in readings])
        for entry in (0, 4, 5, 6, 7)
    )
    return BodyState(position, quaternion, linear + cross(angular, position - com), angular)
