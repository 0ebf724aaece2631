"""HRP-2 in the simulator: its place, its raw sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, needed

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.frames import BodyState, cross, quaternion_product, rotation
from hrp2_sim_bridge.physics.rotors import load_robot, moments_by_link
from hrp2_sim_bridge.physics.rubber import lay_rubber
from hrp2_sim_bridge.physics.servos import JointServos

_LINKS, _LINK_VALUES, _BASE_VALUES = 4, 16, 13
FRAME_VALUES = _LINKS * _LINK_VALUES + _BASE_VALUES
_FASTEST_JOINT = 1000.0  # PyBullet's own clamp, out of the way [rad/s]


class RobotBody:
    """HRP-2 standing in a posture, soles on the floor, the world's origin midway between them.

    Args:
        client: of PyBullet.
        robot: configuration.
        posture: (30,) [rad].
        rotor_scale: multiple of the rotors' inertia.
        servo_time_constant: of the joints' servos [s]; the robot's own by default.
        rubber: whether the soles are of rubber.

    Raises:
        ModelError: PyBullet changed a mass, an inertia or the order of things.
    """

    def __init__(
        self,
        client: Any,
        robot: RobotConfig,
        posture: Array,
        *,
        rotor_scale: float,
        servo_time_constant: float | None = None,
        rubber: bool = False,
    ) -> None:
        self._client = client
        self.robot = robot
        self.body = load_robot(client, robot, rotor_scale)
        self._moments = {
            held: moments_by_link(client, self.body, robot, 0.0 if held else rotor_scale)
            for held in (True, False)}
        self._rotors_held = False
        infos = [client.getJointInfo(self.body, i) for i in range(client.getNumJoints(self.body))]
        self.link_names = tuple(info[12].decode() for info in infos)
        self.link_index = {name: index for index, name in enumerate(self.link_names)}
        self.joint_index = {info[1].decode(): index for index, info in enumerate(infos)}
        self._joints = [self.joint_index[name] for name in robot.joint_names]
        self.soles = {side: self.link_index[robot.feet[side].sole] for side in SIDES}
        sensors = [needed(robot.feet[side].sensor_joint, "sensor_joint") for side in SIDES]
        self._sensors = [self.joint_index[name] for name in sensors]
        self._imu = self.link_index[needed(robot.imu_frame, "imu_frame")]
        self.contact_link = self.link_index[robot.contact_link]
        self._frames = [*self.soles.values(), self.contact_link, self._imu]
        self._quiet_defaults([info[2] for info in infos])
        self._anchor_soles()
        if rubber:
            known = needed(robot.sole_rubber, "sole_rubber")
            lay_rubber(client, self.body, self.soles.values(), known)
        for sensor in self._sensors:
            client.enableJointForceTorqueSensor(self.body, sensor, 1)
        offset = client.getDynamicsInfo(self.body, -1)[3:5]
        self._base_offset = offset
        self._offset_back = client.invertTransform(*offset)
        self.sole_mass, self.sole_inertia = self._sole_bodies()
        time_constant = servo_time_constant or needed(
            robot.servo_time_constant, "servo_time_constant")
        self.servos = JointServos(client, self.body, self._joints, robot, time_constant)
        self._place(posture)

    def _quiet_defaults(self, joint_types: list[int]) -> None:
        """No damping, no default motors, friction as the floor has it."""
        client = self._client
        for index in range(-1, len(joint_types)):
            # One call each: with a damping or a speed, PyBullet drops the friction without a word
            # (github.com/bulletphysics/bullet3, issues 3314 and 4133).
            for setting in (
                {"linearDamping": 0.0, "angularDamping": 0.0},
                {"jointDamping": 0.0},
                {"maxJointVelocity": _FASTEST_JOINT},
                {"lateralFriction": 1.0, "restitution": 0.0},
            ):
                client.changeDynamics(self.body, index, **setting)
            if index >= 0 and joint_types[index] != client.JOINT_FIXED:
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

    def hold_rotors(self, held: bool) -> None:
        """Take the rotors' inertia off the links while the joints hold, or put it back.

        A rotor weighs on turns of its joint alone. On a link it also weighs on those of the robot
        as a whole: of a robot whose joints hold in a hit, 3.5 % too much at point B.
        """
        if held != self._rotors_held:
            for index, moments in enumerate(self._moments[held], start=-1):
                self._client.changeDynamics(self.body, index, localInertiaDiagonal=moments)
            self._rotors_held = held

    def read_reactions(self) -> tuple[Sequence[float], Sequence[float]]:
        """What each ankle exerts on its sole (left, right), in the sole's frame, by PyBullet."""
        left, right = self._client.getJointStates(self.body, self._sensors)
        return left[2], right[2]

    def read_joints(self) -> Array:
        """Positions [rad], velocities [rad/s] and motor torques [N m] (3, 30)."""
        q, dq, _, torque = zip(*self._client.getJointStates(self.body, self._joints), strict=True)
        return np.array([q, dq, torque])

    def read_frames(self) -> list[float]:
        """States of left sole, right sole, contact link, IMU and base.

        `link_states` and `base_states` make something of them. For links: CoM, origin [m],
        quaternion x, y, z, w, velocities [m/s] and [rad/s]; for the base without the origin.
        """
        client = self._client
        row: list[float] = []
        # Without forward kinematics (the last 1) they would be those of the step before.
        for com, _, _, _, origin, turn, linear, angular in client.getLinkStates(
            self.body, self._frames, 1, 1
        ):
            row += (*com, *origin, *turn, *linear, *angular)
        for part in client.getBasePositionAndOrientation(self.body):
            row += part
        for part in client.getBaseVelocity(self.body):
            row += part
        return row

    def link_states(self, rows: Array) -> BodyState:
        """States (T, 4) of left sole, right sole, contact link and IMU from T readings."""
        links = rows[:, :-_BASE_VALUES].reshape(len(rows), _LINKS, _LINK_VALUES)
        com, origin, turn = links[..., :3], links[..., 3:6], links[..., 6:10]
        linear, angular = links[..., 10:13], links[..., 13:]
        # PyBullet's velocity is the CoM's.
        return BodyState(origin, turn, linear + cross(angular, origin - com), angular)

    def base_states(self, rows: Array) -> BodyState:
        """States (T,) of base_link, free of PyBullet's inertial frame, from T readings."""
        com, turn, linear, angular = np.split(rows[:, -_BASE_VALUES:], (3, 7, 10), axis=-1)
        offset, own = (np.array(part) for part in self._offset_back)
        arm = rotation(turn) @ offset
        placed = np.stack(quaternion_product([*turn.T], [*own]), axis=-1)
        return BodyState(com + arm, placed, linear + cross(angular, arm), angular)

    def tilt(self) -> float:
        """Angle between base_link's z axis and the vertical [rad]."""
        client = self._client
        pose = client.getBasePositionAndOrientation(self.body)
        x, y, _, _ = client.multiplyTransforms(*pose, *self._offset_back)[1]
        return math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y)))

    def frame(self, link: int) -> BodyState:
        """State of a link's own frame."""
        state = self._client.getLinkState(self.body, link, 1, 1)
        com, origin, turn, linear, angular = (np.array(state[i]) for i in (0, 4, 5, 6, 7))
        return BodyState(origin, turn, linear + cross(angular, origin - com), angular)

    def contact_sphere(self) -> BodyState:
        """State of the middle of the body that hits the door, point B."""
        return self.frame(self.contact_link)

    def imu(self) -> BodyState:
        """State of the IMU's frame."""
        return self.frame(self._imu)

    def floor_touchers(self, floor: int) -> set[str]:
        """Names of the links on the floor, soles left out."""
        names = set()
        for point in self._client.getContactPoints(self.body, floor):
            if point[3] not in self.soles.values() and point[8] <= 0.0:
                names.add(self.link_names[point[3]] if point[3] >= 0 else "base_link")
        return names
