"""HRP-2 in PyBullet: its pose and its raw sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, SoleRubber, needed

from hrp2_sim_bridge.errors import ModelError
from hrp2_sim_bridge.physics.frames import cross, quaternion_product, rotation
from hrp2_sim_bridge.physics.pybullet.rubber import lay_rubber
from hrp2_sim_bridge.physics.pybullet.urdf import load_robot
from hrp2_sim_bridge.physics.states import BodyState, Reactions

# Numbers in a row of `read_frames`: links, numbers of a link, numbers of the base.
_LINKS, _LINK_VALUES, _BASE_VALUES = 4, 16, 13
FRAME_VALUES = _LINKS * _LINK_VALUES + _BASE_VALUES
_LOCK = 1e5  # largest torque of a lock [N m]
_FASTEST_JOINT = 1000.0  # limit of PyBullet's own clamp, faster than any joint [rad/s]


class RobotBody:
    """HRP-2 standing in a posture on the floor.

    Args:
        client: Client of PyBullet.
        robot: Configuration of the robot.
        posture: Joint angles, (30,) [rad].
        rubber: Rubber under each sole; None means rigid soles.
        start: x [m], y [m] and heading [rad] of the middle between the soles.

    Attributes:
        body: PyBullet's index of the robot.
        link_names: Names of the links in PyBullet's order, without the base.
        joint_index: PyBullet's index of each joint by its name.
        soles: PyBullet's index of each sole by its side.
        contact_link: PyBullet's index of the link that hits the door.
        sensed_mass: Masses beyond the force sensors, (B,) [kg].
        sensed_inertia: Principal moments of these bodies in their axes, (B, 3) [kg m^2].

    Raises:
        ModelError: PyBullet changed a mass, an inertia or an inertial frame.
        RobotConfigError: The configuration lacks something that the simulation needs.
    """

    def __init__(
        self,
        client: Any,
        robot: RobotConfig,
        posture: Array,
        *,
        rubber: SoleRubber | None = None,
        start: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self._client = client
        self.body = load_robot(client, robot)
        infos = [client.getJointInfo(self.body, i) for i in range(client.getNumJoints(self.body))]
        self.link_names = tuple(info[12].decode() for info in infos)
        self.joint_index = {info[1].decode(): index for index, info in enumerate(infos)}
        self._joints = [self.joint_index[name] for name in robot.joint_names]
        link_index = {name: index for index, name in enumerate(self.link_names)}
        self.soles = {side: link_index[robot.feet[side].sole] for side in SIDES}
        sensors = [needed(robot.feet[side].sensor_joint, "sensor_joint") for side in SIDES]
        wrists = [] if robot.wrist_sensors is None else [
            robot.wrist_sensors[side] for side in SIDES]
        sensors += [wrist.joint for wrist in wrists]
        self._hands = [link_index[wrist.link] for wrist in wrists]
        self._sensors = [self.joint_index[name] for name in sensors]
        imu = link_index[needed(robot.imu_frame, "imu_frame")]
        self.contact_link = link_index[robot.contact_link]
        self._frames = [*self.soles.values(), self.contact_link, imu]
        self._override_defaults([info[2] for info in infos])
        self._anchor_soles()
        if rubber is not None:
            lay_rubber(client, self.body, self.soles.values(), rubber)
        for sensor in self._sensors:
            client.enableJointForceTorqueSensor(self.body, sensor, 1)
        # PyBullet reports the pose of the base's inertial frame.
        self._base_offset = client.getDynamicsInfo(self.body, -1)[3:5]
        self._offset_back = client.invertTransform(*self._base_offset)
        self.sensed_mass, self.sensed_inertia = self._sensed_bodies()
        self._push = partial(
            client.setJointMotorControlArray, self.body, self._joints, client.TORQUE_CONTROL)
        masses = [client.getDynamicsInfo(self.body, index)[0]
                  for index in range(-1, len(self.link_names))]
        self._shares = np.array(masses) / sum(masses)  # of the robot's mass, the base's first
        self._watched = [*self._joints, *self._sensors]
        self._held: list[int] = []
        self._place(posture, start)
        self._states = client.getJointStates(self.body, self._watched)

    def _override_defaults(self, joint_types: list[int]) -> None:
        """Remove damping and default motors, and set the friction that suits the floor's."""
        client = self._client
        for index in range(-1, len(joint_types)):
            # One call for each setting: together with a damping or a speed, PyBullet ignores the
            # friction (github.com/bulletphysics/bullet3, issues 3314 and 4133).
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
        """Let the soles' friction hold a place, not only a speed.

        Without anchors the soles creep by 0.3 mm in 25 s.
        """
        for sole in self.soles.values():
            self._client.changeDynamics(self.body, sole, frictionAnchor=1)

    def _sensed_bodies(self) -> tuple[Array, Array]:
        """Return mass (B,) and principal inertia (B, 3) beyond each force sensor.

        Raises:
            ModelError: The inertial frame, in which the sensor reports, is not the link's own.
        """
        bodies = [*self.soles.values(), *self._hands]
        infos = [self._client.getDynamicsInfo(self.body, index) for index in bodies]
        for index, info in zip(bodies, infos, strict=True):
            if np.abs(info[3]).max() > 1e-9 or abs(abs(info[4][3]) - 1.0) > 1e-9:
                raise ModelError(
                    self.link_names[index], info[3:5], "the link's own frame", "inertial frame"
                )
        return np.array([info[0] for info in infos]), np.array([info[2] for info in infos])

    def _place(self, posture: Array, start: Sequence[float]) -> None:
        client = self._client
        for joint, angle in zip(self._joints, posture, strict=True):
            client.resetJointState(self.body, joint, float(angle), 0.0)
        x, y, heading = start
        self._set_base(np.zeros(3), heading)
        feet = np.array([self.frame(self.soles[side]).position for side in SIDES])
        middle = [feet[:, 0].mean(), feet[:, 1].mean(), feet[:, 2].min()]
        self._set_base(np.array([x, y, 0.0]) - middle, heading)

    def _set_base(self, position: Array, heading: float) -> None:
        turn = [0.0, 0.0, math.sin(heading / 2.0), math.cos(heading / 2.0)]
        pose = self._client.multiplyTransforms(position.tolist(), turn, *self._base_offset)
        self._client.resetBasePositionAndOrientation(self.body, *pose)

    def hold(self, joints: Sequence[int]) -> None:
        """Lock these joints where they are, and release the others."""
        for index in self._held:
            self._client.setJointMotorControl2(
                self.body, self._joints[index], self._client.VELOCITY_CONTROL, force=0.0)
        self._held = list(joints)
        for index in self._held:
            self._client.setJointMotorControl2(
                self.body, self._joints[index], self._client.VELOCITY_CONTROL,
                targetVelocity=0.0, force=_LOCK)

    def push(self, torque: Array) -> None:
        """Apply torques (30,) [N m] to the joints during the coming step."""
        self._push(forces=torque.tolist())

    def push_links(self, force: Array) -> None:
        """Apply a force (3,) [N] in the world during the coming step, shared by the masses."""
        client = self._client
        places = [client.getBasePositionAndOrientation(self.body)[0]]
        places += [state[0] for state in client.getLinkStates(
            self.body, range(len(self.link_names)), 0, 1)]
        for link, (place, share) in enumerate(zip(places, self._shares, strict=True), start=-1):
            client.applyExternalForce(
                self.body, link, (share * force).tolist(), place, client.WORLD_FRAME)

    def read_reactions(self) -> Reactions:
        """Return force and torque on each body beyond a force sensor, in its frame, (B, 6)."""
        self._states = self._client.getJointStates(self.body, self._watched)
        return [state[2] for state in self._states[-len(self._sensors):]]

    def joint_state(self) -> Array:
        """Return positions [rad] and velocities [rad/s] after the last step, (2, 30)."""
        position, velocity, _, _ = zip(*self._states[:-len(self._sensors)], strict=True)
        return np.array((position, velocity))

    def read_frames(self) -> list[float]:
        """Return the numbers that PyBullet has for left sole, right sole, contact link, IMU, base.

        `link_states` and `base_states` compute states from them. A link has its CoM [m], origin
        [m], quaternion x, y, z, w and velocities [m/s] and [rad/s]; the base has no origin.
        """
        client = self._client
        row: list[float] = []
        # Without forward kinematics (the last 1) these would be the states before the last step.
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
        """Return states (T, 4) of left sole, right sole, contact link and IMU from T rows."""
        links = rows[:, :-_BASE_VALUES].reshape(len(rows), _LINKS, _LINK_VALUES)
        com, origin, turn = links[..., :3], links[..., 3:6], links[..., 6:10]
        linear, angular = links[..., 10:13], links[..., 13:]
        # PyBullet's velocity is that of the CoM.
        return BodyState(origin, turn, linear + cross(angular, origin - com), angular)

    def base_states(self, rows: Array) -> BodyState:
        """Return states (T,) of base_link, not of its inertial frame, from T rows."""
        com, turn, linear, angular = np.split(rows[:, -_BASE_VALUES:], (3, 7, 10), axis=-1)
        offset, own = (np.array(part) for part in self._offset_back)
        arm = rotation(turn) @ offset
        placed = np.stack(quaternion_product([*turn.T], [*own]), axis=-1)
        return BodyState(com + arm, placed, linear + cross(angular, arm), angular)

    def hand_states(self) -> BodyState:
        """Return states (B - 2,) of the hands beyond force sensors."""
        if not self._hands:
            return BodyState(np.empty((0, 3)), np.empty((0, 4)), np.empty((0, 3)), np.empty((0, 3)))
        states = self._client.getLinkStates(self.body, self._hands, 1, 1)
        com, origin, turn, linear, angular = (
            np.array([state[i] for state in states]) for i in (0, 4, 5, 6, 7))
        return BodyState(origin, turn, linear + cross(angular, origin - com), angular)

    def tilt(self) -> float:
        """Return the angle between base_link's z axis and the vertical [rad]."""
        client = self._client
        pose = client.getBasePositionAndOrientation(self.body)
        x, y, _, _ = client.multiplyTransforms(*pose, *self._offset_back)[1]
        return math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y)))

    def frame(self, link: int) -> BodyState:
        """Return the state of a link's own frame, the link given by PyBullet's index."""
        state = self._client.getLinkState(self.body, link, 1, 1)
        com, origin, turn, linear, angular = (np.array(state[i]) for i in (0, 4, 5, 6, 7))
        return BodyState(origin, turn, linear + cross(angular, origin - com), angular)

    def contact_sphere(self) -> BodyState:
        """Return the state of point B, the middle of the sphere that hits the door."""
        return self.frame(self.contact_link)
