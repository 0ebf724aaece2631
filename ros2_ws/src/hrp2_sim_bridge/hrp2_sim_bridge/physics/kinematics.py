"""Poses and velocities of links, computed by Pinocchio from the states of base and joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import RobotConfig
from humanoid_motion.pinocchio_model import free_floating_model, inertia_beyond, joint_columns
from scipy.spatial.transform import Rotation

from hrp2_sim_bridge.physics.engine import SimulatedRobot, sensed_links, sensor_joints
from hrp2_sim_bridge.physics.frames import cross, into_frame, rotation


@dataclass(frozen=True)
class LinkStates:
    """Poses and velocities of links' frames in the world.

    Attributes:
        position: Positions of the frames' origins, (..., 3) [m].
        turn: Rotation matrices of the frames, (..., 3, 3).
        linear: Velocities of the frames' origins, (..., 3) [m/s].
        angular: Angular velocities, (..., 3) [rad/s].
    """

    position: Array
    turn: Array
    linear: Array
    angular: Array

    @property
    def quaternion(self) -> Array:
        """Orientations x, y, z, w, (..., 4)."""
        flat = Rotation.from_matrix(self.turn.reshape(-1, 3, 3)).as_quat()
        return np.asarray(flat.reshape(*self.turn.shape[:-2], 4))

    def at(self, index: Any) -> LinkStates:
        """Return the states at an index of the leading axes."""
        return LinkStates(
            self.position[index], self.turn[index], self.linear[index], self.angular[index])


class SensedBodies:
    """What the force sensors bear: all that is fixed beyond them, in frames of `sensed_links`.

    Args:
        robot: Configuration of the robot.

    Attributes:
        mass: Masses, (B,) [kg].
        center: Centers of mass, (B, 3) [m].
        inertia: Moments of inertia about the frames' origins, (B, 3, 3) [kg m^2].
        carriers: Names of the links just beyond the sensors.
        places: Poses of the frames in the carriers, of type ``pinocchio.SE3``.

    Raises:
        RobotConfigError: A sensor is in no fixed joint above its sole or hand.
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        model, joints = free_floating_model(robot), sensor_joints(robot)
        for link, joint in zip(sensed_links(robot), joints, strict=True):
            _require_above(model, link, joint)
        frames = [model.frames[model.getFrameId(link)].placement for link in sensed_links(robot)]
        bodies = [frame.actInv(inertia_beyond(model, joint))
                  for frame, joint in zip(frames, joints, strict=True)]
        self.mass = np.array([body.mass for body in bodies])
        self.center = np.array([body.lever for body in bodies])
        self.inertia = np.array([body.matrix()[3:, 3:] for body in bodies])
        children = [next(frame for frame in model.frames if frame.type == pin.FrameType.BODY
                         and frame.parentFrame == model.getFrameId(joint)) for joint in joints]
        self.carriers = [child.name for child in children]
        self.places = [child.placement.actInv(frame)
                       for child, frame in zip(children, frames, strict=True)]


sensed_bodies = lru_cache(maxsize=8)(SensedBodies)  # of a robot, of which there are few


def _require_above(model: Any, link: str, joint: str) -> None:
    frame = model.frames[model.getFrameId(link)]
    between = []
    while (frame := model.frames[frame.parentFrame]).type != pin.FrameType.JOINT:
        between.append(frame.name)
    if joint not in between:
        raise RobotConfigError(f"joint of the force sensor above {link}", value=joint, limit=[
            name for name in between if model.frames[model.getFrameId(name)].type
            == pin.FrameType.FIXED_JOINT])


class Kinematics:
    """Computes states of some links, and of the center of mass.

    Args:
        robot: Configuration of the robot, whose URDF is the model.
        links: Names of L links.
    """

    def __init__(self, robot: RobotConfig, links: Sequence[str]) -> None:
        self._model = model = free_floating_model(robot)
        self._data = data = model.createData()
        self._q_columns, self._v_columns = joint_columns(model, robot.joint_names)
        frames = [model.frames[model.getFrameId(link)] for link in links]
        # Each link is fixed to a moving body. These are views of the memory to which Pinocchio
        # writes the bodies' states.
        bodies = [(data.oMi[frame.parentJoint], data.v[frame.parentJoint]) for frame in frames]
        self._places = [pose.translation for pose, _ in bodies]
        self._turns = [pose.rotation for pose, _ in bodies]
        self._linear = [twist.linear for _, twist in bodies]
        self._angular = [twist.angular for _, twist in bodies]
        self._offsets = np.array([frame.placement.translation for frame in frames])
        self._own_turns = np.array([frame.placement.rotation for frame in frames])

    def states(self, base: Array, joints: Array) -> tuple[LinkStates, Array]:
        """Compute the states at T times.

        Args:
            base: States of base_link as `Engine.base_states` returns them, (T, 13).
            joints: Positions [rad] and velocities [rad/s] of the joints, (T, 2, J).

        Returns:
            States (T, L) of the links; positions [m] and velocities [m/s] of the CoM, (T, 2, 3).
        """
        count, links = len(base), len(self._offsets)
        model, data = self._model, self._data
        q, v = np.zeros((count, model.nq)), np.zeros((count, model.nv))
        q[:, :7] = base[:, :7]
        q[:, self._q_columns], v[:, self._v_columns] = joints[:, 0], joints[:, 1]
        # Pinocchio expresses the velocities of a body in the body's own axes.
        turn = rotation(base[:, 3:7])
        v[:, :3] = into_frame(turn, base[:, 7:10])
        v[:, 3:6] = into_frame(turn, base[:, 10:13])
        place, turn = np.empty((count, links, 3)), np.empty((count, links, 3, 3))
        linear, angular = np.empty((count, links, 3)), np.empty((count, links, 3))
        com = np.empty((count, 2, 3))
        for row in range(count):
            pin.centerOfMass(model, data, q[row], v[row])
            place[row], turn[row] = self._places, self._turns
            linear[row], angular[row] = self._linear, self._angular
            com[row] = data.com[0], data.vcom[0]
        offset = self._offsets
        linear += cross(angular, np.broadcast_to(offset, angular.shape))
        return LinkStates(
            place + (turn @ offset[:, :, None])[..., 0], turn @ self._own_turns,
            (turn @ linear[..., None])[..., 0], (turn @ angular[..., None])[..., 0]), com
