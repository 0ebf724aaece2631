"""PyBullet behind the interface that the world uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from operator import itemgetter
from time import perf_counter
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES

from hrp2_sim_bridge.errors import DivergedError
from hrp2_sim_bridge.physics.engine import (
    NO_TOUCH,
    DoorState,
    Engine,
    FloorContact,
    Reactions,
    Scene,
    Touch,
    sensed_links,
    sensor_joints,
)
from hrp2_sim_bridge.physics.frames import cross, quaternion_product, rotation
from hrp2_sim_bridge.physics.kinematics import sensed_bodies
from hrp2_sim_bridge.physics.pybullet.client import connect, load_pybullet, prepare
from hrp2_sim_bridge.physics.pybullet.door_frame import FrameBodies
from hrp2_sim_bridge.physics.pybullet.leaf import LeafBody
from hrp2_sim_bridge.physics.pybullet.robot import link_names, load_robot

# Entries of PyBullet's contact points.
_LINK, _POINT, _NORMAL, _DISTANCE, _FORCE = 3, 6, 7, 8, 9
_LOCK = 1e5  # largest torque of a lock [N m]


class PyBulletEngine(Engine):
    """Robot, door, its frame and floor in PyBullet; the methods are those of `Engine`.

    Attributes:
        client: Client of PyBullet; None before the first `reset` and after `close`.
        body: PyBullet's index of the robot.
        leaf: The door's leaf in PyBullet.
        frame: The frame and the wall in PyBullet.
        floor: PyBullet's index of the floor.
    """

    name = "pybullet"

    def __init__(self) -> None:
        """Import PyBullet.

        Raises:
            SimulatorMissingError: It is not installed.
        """
        load_pybullet()
        self.client: Any = None
        self.stepping_time = 0.0

    def reset(self, scene: Scene) -> None:
        """Build a scene on a new physics server, or in the window if there is one.

        Raises:
            SimulatorMissingError: PyBullet is not installed.
            SettingError: There is no display for the window.
            ModelError: PyBullet changed a mass, an inertia or an inertial frame of the robot.
            RobotConfigError: The robot's configuration lacks something that the simulation needs.
        """
        settings, robot = scene.settings, scene.robot
        if self.client is not None and not settings.gui:
            self.close()
        if self.client is None:
            # Nothing of the last run can remain in a new physics server.
            self.client = connect(settings.gui)
        client = self.client
        self._time, self._step = 0.0, settings.time_step_coarse
        self.floor = prepare(client, self._step, settings.iterations, settings.friction)
        self.body = body = load_robot(client, robot, scene.sole_rubber)
        self.link_names = link_names(client, body)
        indices = {client.getJointInfo(body, index)[1].decode(): index
                   for index in range(len(self.link_names))}
        self._joints = [indices[name] for name in robot.joint_names]
        sensors = [indices[name] for name in sensor_joints(robot)]
        self._to_frames = []
        for sensor, place in zip(sensors, sensed_bodies(robot).places, strict=True):
            client.enableJointForceTorqueSensor(body, sensor, 1)
            # PyBullet reports in the inertial frame of the link beyond the sensor.
            inertial = pin.XYZQUATToSE3(np.hstack(client.getDynamicsInfo(body, sensor)[3:5]))
            self._to_frames.append(place.actInv(inertial))
        self._in_frames = all(place.isIdentity(1e-9) for place in self._to_frames)
        links = [self.link_names.index(link) for link in sensed_links(robot)]
        masses = [client.getDynamicsInfo(body, index)[0]
                  for index in range(-1, len(self.link_names))]
        self._shares = np.array(masses) / sum(masses)  # of the robot's mass, the base's first
        self._root = robot.root_link
        self._held: list[int] = []
        self._outside: Array | None = None
        self._place(scene, links[: len(SIDES)])
        self.leaf = LeafBody(
            client, scene.door, scene.door_distance, scene.hinge_x, scene.contact,
            settings.leaf_friction)
        self.frame = FrameBodies(
            client, scene.frame_boxes, self.leaf.body, settings.leaf_friction, settings.friction)
        self._push = partial(
            client.setJointMotorControlArray, body, self._joints, client.TORQUE_CONTROL)
        watched = [*self._joints, *sensors]
        self._read = partial(client.getJointStates, body, watched)
        self._states = self._read()

    def _place(self, scene: Scene, soles: Sequence[int]) -> None:
        """Put the robot with its soles on the floor, with x, y and heading of their middle."""
        client, body = self.client, self.body
        # PyBullet's pose of the base is that of its inertial frame.
        offset = client.getDynamicsInfo(body, -1)[3:5]
        self._offset_back = client.invertTransform(*offset)
        for joint, angle in zip(self._joints, scene.posture, strict=True):
            client.resetJointState(body, joint, float(angle), 0.0)
        x, y, heading = scene.start
        turn = [0.0, 0.0, math.sin(heading / 2.0), math.cos(heading / 2.0)]

        def put(position: Sequence[float]) -> None:
            client.resetBasePositionAndOrientation(
                body, *client.multiplyTransforms(position, turn, *offset))

        put([0.0, 0.0, 0.0])
        feet = np.array([state[4] for state in client.getLinkStates(body, soles, 0, 1)])
        put([x - feet[:, 0].mean(), y - feet[:, 1].mean(), -feet[:, 2].min()])

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s]."""
        self._step = step
        self.client.setTimeStep(step)

    def hold(self, joints: Sequence[int]) -> None:
        """Lock these joints where they are, and release the others."""
        motor = partial(self.client.setJointMotorControl2, self.body)
        mode = self.client.VELOCITY_CONTROL
        for index in self._held:
            motor(self._joints[index], mode, force=0.0)
        self._held = list(joints)
        for index in self._held:
            motor(self._joints[index], mode, targetVelocity=0.0, force=_LOCK)

    def push_robot(self, force: Array) -> None:
        """Push the robot with a force (3,) [N] in all coming steps, shared by the links' masses."""
        self._outside = force if force.any() else None

    def _push_links(self, force: Array) -> None:
        client = self.client
        places = [client.getBasePositionAndOrientation(self.body)[0]]
        places += [state[0] for state in client.getLinkStates(
            self.body, range(len(self.link_names)), 0, 1)]
        for link, (place, share) in enumerate(zip(places, self._shares, strict=True), start=-1):
            client.applyExternalForce(
                self.body, link, (share * force).tolist(), place, client.WORLD_FRAME)

    def step(self, torque: Array, door_torque: float) -> Reactions:
        """Take a physics step; return force and torque at the force sensors."""
        self._push(forces=torque.tolist())
        if self._outside is not None:
            self._push_links(self._outside)
        self.leaf.apply_torque(door_torque)
        begin = perf_counter()
        self.client.stepSimulation()
        self.stepping_time += perf_counter() - begin
        self._time += self._step
        self._states = self._read()
        read = [state[2] for state in self._states[len(self._joints):]]
        return read if self._in_frames else [
            place.act(pin.Force(np.array(wrench))).vector.tolist()
            for place, wrench in zip(self._to_frames, read, strict=True)]

    def joint_state(self) -> Array:
        """Return positions and velocities of the joints, (2, J)."""
        position, velocity, _, _ = zip(*self._states[: len(self._joints)], strict=True)
        return np.array((position, velocity))

    def read_base(self) -> list[float]:
        """Return position, quaternion and velocities of the base's inertial frame.

        Raises:
            DivergedError: One of them is not finite.
        """
        place, turn = self.client.getBasePositionAndOrientation(self.body)
        linear, angular = self.client.getBaseVelocity(self.body)
        row = [*place, *turn, *linear, *angular]
        if not math.isfinite(sum(row)):
            raise DivergedError("PyBullet", self._time)
        return row

    def base_states(self, rows: Array) -> Array:
        """Return states of base_link, not of its inertial frame, (T, 13)."""
        com, turn, linear, angular = rows[:, :3], rows[:, 3:7], rows[:, 7:10], rows[:, 10:]
        offset, own = self._offset_back
        arm = rotation(turn) @ np.array(offset)
        placed = np.stack(quaternion_product([*turn.T], own), axis=-1)
        return np.concatenate([com + arm, placed, linear + cross(angular, arm), angular], axis=1)

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""
        return self.leaf.state()

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""
        points = self.client.getClosestPoints(self.body, self.leaf.body, most)
        return min((point[_DISTANCE] for point in points), default=most)

    def touch(self) -> Touch:
        """Return the contact between robot and leaf."""
        contacts = self.client.getContactPoints(self.body, self.leaf.body)
        if not contacts:
            return NO_TOUCH
        most = max(contacts, key=itemgetter(_FORCE))
        total = sum(contact[_FORCE] for contact in contacts)
        return Touch(total, most[_LINK], most[_POINT]) if total > 0.0 else NO_TOUCH

    def frame_force(self) -> float:
        """Return the normal forces of frame and wall on the robot, summed [N]."""
        return float(sum(contact[_FORCE] for contact in self._contacts(self.frame.walls)))

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor or threshold."""
        names = (*self.link_names, self._root)  # PyBullet's index of the base is -1
        return [
            FloorContact(
                names[contact[_LINK]], contact[_POINT],
                [contact[_FORCE] * part for part in contact[_NORMAL]], contact[_DISTANCE])
            for contact in self._contacts([self.floor, *self.frame.thresholds])]

    def _contacts(self, others: Sequence[int]) -> list[Any]:
        """Return PyBullet's contact points between the robot and bodies."""
        return [contact for other in others
                for contact in self.client.getContactPoints(self.body, other)]

    def close(self) -> None:
        """Disconnect from the physics server."""
        if self.client is not None:
            self.client.disconnect()
            self.client = None
