"""PyBullet behind the interface that the world uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import itemgetter
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array

from hrp2_sim_bridge.errors import DivergedError
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.pybullet.client import connect, load_pybullet, prepare
from hrp2_sim_bridge.physics.pybullet.leaf import LeafBody
from hrp2_sim_bridge.physics.pybullet.robot_body import FRAME_VALUES, RobotBody
from hrp2_sim_bridge.physics.scene import Scene
from hrp2_sim_bridge.physics.states import (
    NO_TOUCH,
    BodyState,
    DoorState,
    FloorContact,
    Reactions,
    Touch,
)

# Entries of PyBullet's contact points.
_LINK, _POINT, _NORMAL, _DISTANCE, _FORCE = 3, 6, 7, 8, 9


class PyBulletEngine(Engine):
    """Robot, door and floor in PyBullet; the methods are those of `Engine`.

    Attributes:
        client: Client of PyBullet; None before the first `reset` and after `close`.
        robot: The robot in PyBullet.
        leaf: The door's leaf in PyBullet.
        floor: PyBullet's index of the floor.
    """

    name = "pybullet"
    frame_values = FRAME_VALUES

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
            ModelError: PyBullet changed a mass or an inertia of the robot.
            RobotConfigError: The robot's configuration lacks something that the simulation needs.
        """
        settings = scene.settings
        if self.client is not None and not settings.gui:
            self.close()
        if self.client is None:
            # Nothing of the last run can remain in a new physics server.
            self.client = connect(settings.gui)
        self._time, self._step = 0.0, settings.time_step_coarse
        self.floor = prepare(self.client, self._step, settings.iterations, settings.friction)
        self.robot = RobotBody(
            self.client, scene.robot, scene.posture, rubber=scene.sole_rubber,
            start=settings.start,
        )
        self.leaf = LeafBody(
            self.client, scene.door, scene.door_distance, scene.hinge_x, scene.contact,
            settings.leaf_friction,
        )
        self._outside = np.zeros(3)
        self.link_names = self.robot.link_names
        self.sensed_mass = self.robot.sensed_mass
        self.sensed_inertia = self.robot.sensed_inertia

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s]."""
        self._step = step
        self.client.setTimeStep(step)

    def hold(self, joints: Sequence[int]) -> None:
        """Lock these joints where they are, and release the others."""
        self.robot.hold(joints)

    def push_robot(self, force: Array) -> None:
        """Push the robot with a force (3,) [N] in all coming steps, shared by the links' masses."""
        self._outside = force

    def step(self, torque: Array, door_torque: float) -> Reactions:
        """Take a physics step; return force and torque at the force sensors."""
        self.robot.push(torque)
        if self._outside.any():
            self.robot.push_links(self._outside)
        self.leaf.apply_torque(door_torque)
        begin = perf_counter()
        self.client.stepSimulation()
        self.stepping_time += perf_counter() - begin
        self._time += self._step
        return self.robot.read_reactions()

    def joint_state(self) -> Array:
        """Return positions and velocities of the joints, (2, 30)."""
        return self.robot.joint_state()

    def read_frames(self) -> list[float]:
        """Return PyBullet's own numbers for the links that matter and the base.

        Raises:
            DivergedError: One of them is not finite.
        """
        row = self.robot.read_frames()
        if not all(map(math.isfinite, row)):
            raise DivergedError("PyBullet", self._time)
        return row

    def link_states(self, rows: Array) -> BodyState:
        """Return states (T, 4) of left sole, right sole, contact link and IMU."""
        return self.robot.link_states(rows)

    def hand_states(self) -> BodyState:
        """Return states (B - 2,) of the hands beyond force sensors."""
        return self.robot.hand_states()

    def base_states(self, rows: Array) -> BodyState:
        """Return states (T,) of base_link."""
        return self.robot.base_states(rows)

    def tilt(self) -> float:
        """Return the angle between base_link's z axis and the vertical [rad]."""
        return self.robot.tilt()

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""
        return self.leaf.state()

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""
        points = self.client.getClosestPoints(self.robot.body, self.leaf.body, most)
        return min((point[_DISTANCE] for point in points), default=most)

    def touch(self) -> Touch:
        """Return the contact between robot and leaf."""
        contacts = self.client.getContactPoints(self.robot.body, self.leaf.body)
        if not contacts:
            return NO_TOUCH
        most = max(contacts, key=itemgetter(_FORCE))
        total = sum(contact[_FORCE] for contact in contacts)
        return Touch(total, most[_LINK], most[_POINT]) if total > 0.0 else NO_TOUCH

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor."""
        names = (*self.link_names, "base_link")  # PyBullet's index of the base is -1
        return [
            FloorContact(
                names[contact[_LINK]], contact[_POINT],
                [contact[_FORCE] * part for part in contact[_NORMAL]], contact[_DISTANCE],
            )
            for contact in self.client.getContactPoints(self.robot.body, self.floor)
        ]

    def close(self) -> None:
        """Disconnect from the physics server."""
        if self.client is not None:
            self.client.disconnect()
            self.client = None
