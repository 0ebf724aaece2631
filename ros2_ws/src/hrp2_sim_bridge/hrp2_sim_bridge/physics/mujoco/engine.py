"""MuJoCo behind the interface that the world uses."""

from __future__ import annotations

import logging
import math
import os
import sys
from collections.abc import Collection, Sequence
from time import perf_counter
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError
from door_model.door.frame import THRESHOLD
from hrp2_description.robot import SIDES

from hrp2_sim_bridge.errors import DivergedError, SimulatorMissingError
from hrp2_sim_bridge.physics.engine import (
    NO_TOUCH,
    DoorState,
    Engine,
    FloorContact,
    Reactions,
    Scene,
    Touch,
    sensed_links,
)
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.physics.mujoco.model import FLOOR, HINGE, LEAF, build

_LOG = logging.getLogger(__name__)
_FRAME = 1.0 / 60.0  # period with which the window is redrawn, in simulated time [s]
_XYZW = [1, 2, 3, 0]  # places of x, y, z, w in MuJoCo's quaternions


def load_mujoco() -> Any:
    """Import and return the module `mujoco`.

    Raises:
        SimulatorMissingError: MuJoCo is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise SimulatorMissingError("MuJoCo", "'pip install mujoco'") from error
    if mujoco.get_mju_user_warning() is None:
        # MuJoCo would write its warnings to a file in the working directory.
        mujoco.set_mju_user_warning(_LOG.warning)
    return mujoco


class Window:
    """A window that shows MuJoCo's data while the simulation runs.

    Raises:
        SettingError: There is no display for a window.
    """

    def __init__(self, model: Any, data: Any) -> None:
        if sys.platform == "linux" and not (
            os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        ):
            # MuJoCo would write to stderr from another thread and show nothing.
            raise SettingError("gui", True, "false where DISPLAY names no display")
        import mujoco.viewer

        self._data = data
        self._viewer = mujoco.viewer.launch_passive(
            model, data, show_left_ui=False, show_right_ui=False)
        camera = self._viewer.cam
        camera.lookat[:] = 0.0, -0.2, 0.7
        camera.distance, camera.azimuth, camera.elevation = 2.6, 210.0, -18.0
        self._next = 0.0

    def update(self) -> None:
        """Redraw the window if its last picture is old; a window that was closed stays closed."""
        if self._data.time >= self._next and self._viewer.is_running():
            self._viewer.sync()
            self._next = self._data.time + _FRAME

    def close(self) -> None:
        """Close the window."""
        self._viewer.close()


class MuJoCoEngine(Engine):
    """Robot, door, its frame and floor in MuJoCo; the methods are those of `Engine`.

    A joint's torque is a force of MuJoCo's generalized coordinates. Contacts and sensors are those
    of the last step; poses are those after it.

    Attributes:
        model: MuJoCo's model; None before the first `reset`.
        data: MuJoCo's data.
    """

    name = "mujoco"

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
        first, last = model.body(robot.root_link).id, model.body(LEAF).id
        self.link_names = tuple(model.body(index).name for index in range(first, last))
        self._joints = [model.joint(name).id for name in robot.joint_names]
        self._q, self._dq = model.jnt_qposadr[self._joints], model.jnt_dofadr[self._joints]
        self._holds = [model.equality(name).id for name in robot.joint_names]
        hinge = model.joint(HINGE).id
        self._door_q, self._door_dq = int(model.jnt_qposadr[hinge]), int(model.jnt_dofadr[hinge])
        sensed = [model.body(link).id for link in sensed_links(robot)]
        # Index in `link_names` of each geom's link; -1 of the others.
        self._link_of = [body - first if first <= body < last else -1
                         for body in model.geom_bodyid.tolist()]
        self._leaf = model.geom(LEAF).id
        boxes = {box.name: int(model.geom(box.name).id) for box in scene.frame_boxes}
        self._walls = {geom for name, geom in boxes.items() if name != THRESHOLD}
        self._floors = {int(model.geom(FLOOR).id), *boxes.values()} - self._walls
        shapes = np.flatnonzero(np.isin(model.geom_bodyid, range(first, last)))
        touching = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
        self._shapes = [int(shape) for shape in shapes if shape in touching]
        # Views on MuJoCo's memory.
        self._force, self._reactions = data.qfrc_applied, data.sensordata.reshape(-1, 6)
        self._position, self._velocity = data.qpos, data.qvel
        self._pushed = data.xfrc_applied[first:last, :3]
        masses = model.body_mass[first:last]
        self._shares = masses / masses.sum()  # of the robot's mass
        self._place(scene, sensed[: len(SIDES)])
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
        if self._window is not None:
            self._window.update()
        reactions: Reactions = self._reactions.tolist()
        return reactions

    def joint_state(self) -> Array:
        """Return positions and velocities of the joints, (2, J)."""
        return np.array([self._position[self._q], self._velocity[self._dq]])

    def read_base(self) -> list[float]:
        """Return MuJoCo's coordinates of the base.

        Raises:
            DivergedError: One of them is not finite.
        """
        row = self._position[:7].tolist() + self._velocity[:6].tolist()
        if not math.isfinite(sum(row)):
            raise DivergedError("MuJoCo", float(self.data.time))
        return row

    def base_states(self, rows: Array) -> Array:
        """Return states of base_link, (T, 13)."""
        turn = rows[:, 3:7][:, _XYZW]
        # MuJoCo's angular velocity of a free body is in the body's own axes.
        angular = (rotation(turn) @ rows[:, 10:, None])[..., 0]
        return np.concatenate([rows[:, :3], turn, rows[:, 7:10], angular], axis=1)

    def door_state(self) -> DoorState:
        """Return the leaf's angle and angular velocity."""
        return DoorState(
            float(self._position[self._door_q]), float(self._velocity[self._door_dq]))

    def leaf_distance(self, most: float) -> float:
        """Return the distance between robot and leaf, at most `most` [m]."""
        self._mujoco.mj_kinematics(self.model, self.data)
        nearest = most
        for shape in self._shapes:
            nearest = self._mujoco.mj_geomDistance(
                self.model, self.data, shape, self._leaf, nearest, None)
        return nearest

    def touch(self) -> Touch:
        """Return the contact between robot and leaf."""
        places, forces = self._contacts({self._leaf})
        total = sum(forces)
        if not total > 0.0:
            return NO_TOUCH
        contact, most = self.data.contact, places[forces.index(max(forces))]
        return Touch(total, self._link(contact.geom[most].tolist()), contact.pos[most].tolist())

    def frame_force(self) -> float:
        """Return the normal forces of frame and wall on the robot, summed [N]."""
        return float(sum(self._contacts(self._walls)[1]))

    def floor_contacts(self) -> list[FloorContact]:
        """Return the contacts between robot and floor or threshold."""
        contact = self.data.contact
        places, forces = self._contacts(self._floors)
        if not places:
            return []
        return [
            FloorContact(self.link_names[self._link(pair)], point, push, distance)
            for pair, point, push, distance in zip(
                contact.geom[places].tolist(), contact.pos[places].tolist(),
                (np.array(forces)[:, None] * contact.frame[places, :3]).tolist(),
                contact.dist[places].tolist(), strict=True)]

    def _contacts(self, others: Collection[int]) -> tuple[list[int], list[float]]:
        """Return indices and normal forces [N] of the contacts between the robot and geoms."""
        contact = self.data.contact
        places = [place for place, (one, two) in enumerate(contact.geom.tolist())
                  if one in others or two in others]
        if not places:
            return [], []
        return places, self.data.efc_force[contact.efc_address[places]].tolist()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def _place(self, scene: Scene, soles: Sequence[int]) -> None:
        """Put the robot with its soles on the floor, with x, y and heading of their middle."""
        x, y, heading = scene.start
        self._position[self._q] = scene.posture
        self._position[:3] = 0.0
        self._position[3:7] = math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0)
        self._mujoco.mj_kinematics(self.model, self.data)
        feet = self.data.xpos[soles]
        self._position[:3] = x - feet[:, 0].mean(), y - feet[:, 1].mean(), -feet[:, 2].min()

    def _link(self, geoms: Sequence[int]) -> int:
        """Return the index in `link_names` of the robot's link in a pair of geoms."""
        return max(self._link_of[geom] for geom in geoms)
