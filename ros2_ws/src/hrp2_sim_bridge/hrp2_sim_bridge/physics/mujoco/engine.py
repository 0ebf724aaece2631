"""MuJoCo behind the interface that the world uses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, needed

from hrp2_sim_bridge.errors import DivergedError, ModelError
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.frames import cross, rotation
from hrp2_sim_bridge.physics.mujoco.library import Window, load_mujoco
from hrp2_sim_bridge.physics.mujoco.model import BASE, HINGE, LEAF, build, sensed_links
from hrp2_sim_bridge.physics.scene import Scene
from hrp2_sim_bridge.physics.states import (
    NO_TOUCH,
    BodyState,
    DoorState,
    FloorContact,
    Reactions,
    Touch,
)

# A row of `read_frames`: numbers of each body and of the robot's CoM, about which MuJoCo's
# velocities are.
_BODIES = 5  # left sole, right sole, contact link, IMU, base
_BODY_VALUES = 13  # position, quaternion w, x, y, z, angular velocity, linear velocity
_XYZW = [1, 2, 3, 0]  # places of x, y, z, w in MuJoCo's quaternions


class MuJoCoEngine(Engine):
    """Robot, door and floor in MuJoCo; the methods are those of `Engine`.

    A joint's torque is a force of MuJoCo's generalized coordinates. Contacts and sensors are those
    of the last step; poses are those after it.

    Attributes:
        model: MuJoCo's model; None before the first `reset`.
        data: MuJoCo's data.
    """

    name = "mujoco"
    frame_values = _BODIES * _BODY_VALUES + 3

    def __init__(self) -> None:
        self._mujoco = load_mujoco()
        self.model: Any = None
        self.data: Any = None
        self.stepping_time = 0.0
        self._window: Window | None = None

    def reset(self, scene: Scene) -> None:
        """Build a scene; if it shall be seen, in a new window.

        Raises:
            SettingError: There is no display for the window.
            ModelError: MuJoCo refuses the robot or changed its mass.
            RobotConfigError: The robot's configuration lacks something that the simulation needs.
        """
        self.close()
        robot = scene.robot
        self._built = build(self._mujoco, scene)
        self.model = model = self._built.raw
        self.data = data = self._mujoco.MjData(model)
        first, last = model.body(BASE).id, model.body(LEAF).id
        self.link_names = tuple(model.body(index).name for index in range(first, last))
        self._first_link = first
        self._joints = [model.joint(name).id for name in robot.joint_names]
        self._q, self._dq = model.jnt_qposadr[self._joints], model.jnt_dofadr[self._joints]
        self._holds = [model.equality(name).id for name in robot.joint_names]
        hinge = model.joint(HINGE).id
        self._door_q, self._door_dq = int(model.jnt_qposadr[hinge]), int(model.jnt_dofadr[hinge])
        soles = [model.body(robot.feet[side].sole).id for side in SIDES]
        imu = model.body(needed(robot.imu_frame, "imu_frame")).id
        self._frames = [*soles, model.body(robot.contact_link).id, imu, first]
        sensed = [model.body(link).id for link in sensed_links(robot)]
        self._hands = sensed[len(SIDES):]
        self.sensed_mass = model.body_mass[sensed].copy()
        self.sensed_inertia = np.array([self._principal_inertia(body) for body in sensed])
        # Index in `link_names` of each geom's link; -1 of the leaf and the floor.
        self._link_of = [body - first if first <= body < last else -1
                         for body in model.geom_bodyid.tolist()]
        self._leaf = model.geom(LEAF).id
        self._floor = model.geom("floor").id
        shapes = np.flatnonzero(np.isin(model.geom_bodyid, range(first, last)))
        touching = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
        self._shapes = [int(shape) for shape in shapes if shape in touching]
        # Views on MuJoCo's memory.
        self._force, self._reactions = data.qfrc_applied, data.sensordata.reshape(-1, 6)
        self._position, self._velocity = data.qpos, data.qvel
        self._pushed = data.xfrc_applied[first:last, :3]
        masses = model.body_mass[first:last]
        self._shares = masses / masses.sum()  # of the robot's mass
        self._moved = True
        self._place(scene.posture, scene.settings.start)
        if scene.settings.gui:
            self._window = Window(model, data)

    def set_time_step(self, step: float) -> None:
        """Set the length of the coming physics steps [s]; the surfaces stay as stiff."""
        self._built.set_time_step(step)

    def hold(self, joints: Sequence[int]) -> None:
        """Lock these joints where they are; those that are locked already stay where they are."""
        active, held = self.data.eq_active, {self._holds[joint] for joint in joints}
        for joint, hold in enumerate(self._holds):
            if hold in held and not active[hold]:
                self.model.eq_data[hold, 0] = self._position[self._q[joint]]
            active[hold] = hold in held

    def push_robot(self, force: Array) -> None:
        """Push the robot with a force (3,) [N] in all coming steps, shared by the links' masses."""
        self._pushed[:] = np.outer(self._shares, force)

    def step(self, torque: Array, door_torque: float) -> Reactions:
        """Take a physics step; return force and torque at the force sensors."""
        self._force[self._dq] = torque
        self._force[self._door_dq] = door_torque
        begin = perf_counter()
        self._mujoco.mj_step(self.model, self.data)
        self.stepping_time += perf_counter() - begin
        self._moved = True
        if self._window is not None:
            self._window.update()
        reactions: Reactions = self._reactions.tolist()
        return reactions

    def joint_state(self) -> Array:
        """Return positions and velocities of the joints, (2, 30)."""
        return np.array([self._position[self._q], self._velocity[self._dq]])

    def read_frames(self) -> list[float]:
        """Return poses and velocities of the soles, contact link, IMU and base.

        Raises:
            DivergedError: A pose or a velocity is no finite number.
        """
        row: list[float] = self._bodies(self._frames).ravel().tolist()
        if not all(map(math.isfinite, row)):
            raise DivergedError("MuJoCo", float(self.data.time))
        row += self.data.subtree_com[self._first_link].tolist()
        return row

    def link_states(self, rows: Array) -> BodyState:
        """Return states (T, 4) of left sole, right sole, contact link and IMU."""
        return _states(rows).at((slice(None), slice(_BODIES - 1)))

    def hand_states(self) -> BodyState:
        """Return states (B - 2,) of the hands beyond force sensors."""
        return _body_states(self._bodies(self._hands), self.data.subtree_com[self._first_link])

    def base_states(self, rows: Array) -> BodyState:
        """Return states (T,) of base_link."""
        return _states(rows).at((slice(None), _BODIES - 1))

    def tilt(self) -> float:
        """Return the angle between base_link's z axis and the vertical [rad]."""
        _, x, y, _ = self._position[3:7]
        return math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y)))

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""
        return DoorState(
            float(self._position[self._door_q]), float(self._velocity[self._door_dq])
        )

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""
        self._follow()
        nearest = most
        for shape in self._shapes:
            nearest = self._mujoco.mj_geomDistance(
                self.model, self.data, shape, self._leaf, nearest, None
            )
        return nearest

    def touch(self) -> Touch:
        """Return the contact between robot and leaf."""
        contact, leaf = self.data.contact, self._leaf
        pairs = contact.geom.tolist()
        places = [place for place, pair in enumerate(pairs) if leaf in pair]
        if not places:
            return NO_TOUCH
        forces = self.data.efc_force[contact.efc_address[places]].tolist()
        total = sum(forces)
        if not total > 0.0:
            return NO_TOUCH
        most = places[forces.index(max(forces))]
        return Touch(total, self._link(pairs[most]), contact.pos[most].tolist())

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor."""
        contact, floor = self.data.contact, self._floor
        pairs = contact.geom.tolist()
        places = [place for place, pair in enumerate(pairs) if floor in pair]
        if not places:
            return []
        force = self.data.efc_force[contact.efc_address[places]]
        return [
            FloorContact(self.link_names[self._link(pairs[place])], point, push, distance)
            for place, point, push, distance in zip(
                places, contact.pos[places].tolist(),
                (force[:, None] * contact.frame[places, :3]).tolist(),
                contact.dist[places].tolist(), strict=True)
        ]

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def _place(self, posture: Array, start: Sequence[float]) -> None:
        """Put the robot with its soles on the floor, with x, y and heading of their middle."""
        x, y, heading = start
        self._position[self._q] = posture
        self._position[:3] = 0.0
        self._position[3:7] = math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0)
        self._follow()
        feet = self.data.xpos[self._frames[: len(SIDES)]]
        self._position[:3] = x - feet[:, 0].mean(), y - feet[:, 1].mean(), -feet[:, 2].min()
        self._moved = True

    def _follow(self) -> None:
        """Let poses and velocities of the bodies follow those of the joints."""
        if self._moved:
            for compute in (
                self._mujoco.mj_kinematics, self._mujoco.mj_comPos, self._mujoco.mj_comVel
            ):
                compute(self.model, self.data)
            self._moved = False

    def _bodies(self, bodies: Sequence[int]) -> Array:
        """Return the numbers of bodies after the last step, (B, 13)."""
        self._follow()
        data, places = self.data, np.array(bodies, dtype=int)
        return np.concatenate(
            [data.xpos[places], data.xquat[places], data.cvel[places]], axis=1)

    def _link(self, geoms: Sequence[int]) -> int:
        """Return the index in `link_names` of the robot's link in a pair of geoms."""
        return max(self._link_of[geom] for geom in geoms)

    def _principal_inertia(self, body: int) -> Array:
        """Return the moments of inertia (3) of a body about its frame's axes [kg m^2].

        Raises:
            ModelError: The frame's axes are no principal axes at the center of mass.
        """
        model = self.model
        turn = rotation(model.body_iquat[body][_XYZW])
        inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
        moments = np.diag(inertia)
        if np.abs(model.body_ipos[body]).max() > 1e-9 or not np.allclose(
            inertia, np.diag(moments), atol=1e-9
        ):
            raise ModelError(
                model.body(body).name, inertia.tolist(), "the link's own frame", "inertial frame"
            )
        return moments.copy()


def _states(rows: Array) -> BodyState:
    """Return states (T, 5) of all bodies from T rows of `MuJoCoEngine.read_frames`."""
    return _body_states(
        rows[:, :-3].reshape(len(rows), _BODIES, _BODY_VALUES), rows[:, None, -3:])


def _body_states(bodies: Array, com: Array) -> BodyState:
    """Return states (...) from numbers of bodies (..., 13) and the robot's CoM, (..., 3) [m]."""
    position, quaternion, angular = bodies[..., :3], bodies[..., 3:7], bodies[..., 7:10]
    arm = position - com
    return BodyState(
        position, quaternion[..., _XYZW], bodies[..., 10:] + cross(angular, arm), angular
    )
