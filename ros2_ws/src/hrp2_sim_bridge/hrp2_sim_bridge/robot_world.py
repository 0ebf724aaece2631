"""HRP-2 in the simulator: loading it as its URDF says, its joint servos, its raw sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.engine import GRAVITY
from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.spline import Array

SIDES = ("left", "right")
# Share of a position error that a servo takes back within the substep: 0.5 chatters.
_POSITION_GAIN = 0.2
_VELOCITY_GAIN = 1.0
_BRACE_TOLERANCE = np.deg2rad(5.0)
_BRACE_TORQUE = 3000.0  # what the arm leaning on the trunk may carry at a joint [N m]
_FASTEST_JOINT = 1000.0  # PyBullet's own clamp, out of the way [rad/s]
_MASS_SLACK = 1e-6  # [kg]


@dataclass(frozen=True)
class BodyState:
    """Pose and velocity of a frame, in the world.

    Attributes:
        position: (3,) [m].
        quaternion: (4,) x, y, z, w.
        linear: (3,) velocity of the frame's origin [m/s].
        angular: (3,) [rad/s].
    """

    position: Array
    quaternion: Array
    linear: Array
    angular: Array


def rotation(quaternion: Array) -> Array:
    """(3, 3) rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def cross(a: Array, b: Array) -> Array:
    """Cross product of two (3,) vectors, quicker than NumPy's general one."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


class RobotBody:
    """HRP-2 standing in a posture, soles on the floor, the world's origin midway between them.

    Args:
        client: of PyBullet.
        robot: configuration.
        posture: (30,) [rad].
        brace: whether the braced joints may carry more than their motors.

    Raises:
        ModelError: PyBullet changed a mass, an inertia or the order of things.
    """

    def __init__(self, client: Any, robot: RobotConfig, posture: Array, *, brace: bool) -> None:
        self._client = client
        self.robot = robot
        self.body = int(
            client.loadURDF(str(robot.urdf_path), flags=client.URDF_USE_INERTIA_FROM_FILE)
        )
        infos = [client.getJointInfo(self.body, i) for i in range(client.getNumJoints(self.body))]
        self.link_names = tuple(info[12].decode() for info in infos)
        self.link_index = {name: index for index, name in enumerate(self.link_names)}
        joint_index = {info[1].decode(): index for index, info in enumerate(infos)}
        self._joints = [joint_index[name] for name in robot.joint_names]
        self.soles = {side: self.link_index[robot.feet[side].sole] for side in SIDES}
        sensors = [joint_index[robot.feet[side].sensor_joint] for side in SIDES]
        self._read = self._joints + sensors
        self._imu = self.link_index[robot.imu_frame]
        self._contact = self.link_index[robot.contact_link]
        self._quiet_defaults([info[2] for info in infos])
        self._anchor_soles()
        self._check_masses()
        for sensor in sensors:
            client.enableJointForceTorqueSensor(self.body, sensor, 1)
        offset = client.getDynamicsInfo(self.body, -1)[3:5]
        self._base_offset = offset
        self._base_offset_back = client.invertTransform(*offset)
        self._sole_mass, self._sole_inertia = self._sole_bodies()
        self._set_servos(brace)
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

    def _check_masses(self) -> None:
        """PyBullet replaces an inertia it dislikes by zero, silently."""
        total = 0.0
        for index in range(-1, len(self.link_names)):
            info = self._client.getDynamicsInfo(self.body, index)
            name = self.robot.name if index < 0 else self.link_names[index]
            if min(info[2]) <= 0.0:
                raise ModelError(name, info[2], "positive", "principal inertia [kg m^2]")
            total += info[0]
        if abs(total - self.robot.mass) > _MASS_SLACK:
            raise ModelError(self.robot.name, total, self.robot.mass, "mass [kg]")

    def _sole_bodies(self) -> tuple[dict[str, float], dict[str, Array]]:
        """Mass and inertia below each sensor; the sensor reports in that body's inertial frame."""
        mass, inertia = {}, {}
        for side, index in self.soles.items():
            info = self._client.getDynamicsInfo(self.body, index)
            if np.abs(info[3]).max() > 1e-9 or abs(abs(info[4][3]) - 1.0) > 1e-9:
                raise ModelError(
                    self.link_names[index], info[3:5], "the link's own frame", "inertial frame"
                )
            mass[side], inertia[side] = info[0], np.array(info[2])
        return mass, inertia

    def _set_servos(self, brace: bool) -> None:
        robot = self.robot
        self._gains = [_POSITION_GAIN] * len(self._joints)
        self._velocity_gains = [_VELOCITY_GAIN] * len(self._joints)
        self.braced_indices = [robot.index(name) for name in robot.braced_joints]
        self._limits = robot.effort_limit.tolist()
        self._braced_limits = list(self._limits)
        if brace:
            for index in self.braced_indices:
                self._braced_limits[index] = _BRACE_TORQUE
        self._posture_indices = [robot.index(name) for name in robot.braced_posture]
        self._braced_posture = np.array(list(robot.braced_posture.values()))
        self.forces = self._limits

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

    def update_brace(self, reference: Array) -> bool:
        """Choose the torque limits for a commanded posture (30,) [rad]; True when braced."""
        error = np.abs(reference[self._posture_indices] - self._braced_posture)
        braced = bool(error.max() < _BRACE_TOLERANCE)
        self.forces = self._braced_limits if braced else self._limits
        return braced

    def command(self, position: Array, velocity: Array) -> None:
        """Targets of all servos for the coming substep.

        Args:
            position: (30,) reference at its start [rad].
            velocity: (30,) mean speed of the reference over it [rad/s]; so a servo that is where
                it should be arrives exactly on the reference at the end.
        """
        client = self._client
        client.setJointMotorControlArray(
            self.body, self._joints, client.POSITION_CONTROL,
            targetPositions=position.tolist(), targetVelocities=velocity.tolist(),
            forces=self.forces, positionGains=self._gains, velocityGains=self._velocity_gains,
        )

    def read_joints(self) -> tuple[Array, Array, Array, Array]:
        """Positions [rad], velocities [rad/s], motor torques [N m] (30,), sensor reactions (2, 6).

        The reactions (left, right) are PyBullet's: what the ankle exerts on the sole, in its frame.
        """
        states = self._client.getJointStates(self.body, self._read)
        joints = np.array([(state[0], state[1], state[3]) for state in states[:-2]])
        reactions = np.array([states[-2][2], states[-1][2]])
        return joints[:, 0], joints[:, 1], joints[:, 2], reactions

    def base(self) -> BodyState:
        """State of base_link, free of PyBullet's inertial frame."""
        client = self._client
        centre, turn = client.getBasePositionAndOrientation(self.body)
        position, quaternion = client.multiplyTransforms(centre, turn, *self._base_offset_back)
        linear, angular = (np.array(v) for v in client.getBaseVelocity(self.body))
        arm = np.array(position) - np.array(centre)
        return BodyState(
            np.array(position), np.array(quaternion), linear + cross(angular, arm), angular
        )

    def frame(self, link: int) -> BodyState:
        """State of a link's own frame."""
        state = self._client.getLinkState(self.body, link, 1, 1)
        angular = np.array(state[7])
        arm = np.array(state[4]) - np.array(state[0])
        return BodyState(
            np.array(state[4]),
            np.array(state[5]),
            np.array(state[6]) + cross(angular, arm),
            angular,
        )

    def contact_sphere(self) -> BodyState:
        """State of the middle of the body that hits the door, point B."""
        return self.frame(self._contact)

    def imu(self) -> BodyState:
        """State of the IMU's frame."""
        return self.frame(self._imu)

    def foot_wrench(
        self, side: str, reaction: Array, before: BodyState, after: BodyState, duration: float
    ) -> Array:
        """Force and torque of the floor on a sole, in the sole's frame.

        The sensor sits above the sole: its reading R leaves the sole's weight and inertia, so
        f = m (a - g) - R and n = I alpha + omega x I omega - R_n.

        Args:
            side: left or right.
            reaction: (6,) mean reading over the duration, [N] and [N m].
            before: state of the sole at its begin.
            after: state of the sole at its end.
            duration: [s].

        Returns:
            (6,) force [N] and torque about the sole frame's origin [N m]; +z when standing.
        """
        turn = rotation(after.quaternion).T
        acceleration = (after.linear - before.linear) / duration
        acceleration[2] += GRAVITY
        alpha = turn @ (after.angular - before.angular) / duration
        omega = turn @ after.angular
        inertia = self._sole_inertia[side]
        force = self._sole_mass[side] * (turn @ acceleration) - reaction[:3]
        torque = inertia * alpha + cross(omega, inertia * omega) - reaction[3:]
        return np.concatenate([force, torque])

    def floor_touchers(self, floor: int) -> set[str]:
        """Names of the links on the floor, soles left out."""
        names = set()
        for point in self._client.getContactPoints(self.body, floor):
            if point[3] not in self.soles.values() and point[8] <= 0.0:
                names.add(self.link_names[point[3]] if point[3] >= 0 else "base_link")
        return names
