"""Wrenches of the feet's force sensors, wherever these are, as forces of the floor on the soles."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES
from humanoid_motion.pinocchio_model import inertia_beyond
from humanoid_motion.robot_model import RobotModel

_KEPT = 60  # readings that an offset is the mean of, 0.3 s at 200 Hz
_STEADY = (5.0, 0.5)  # largest standard deviation of a force [N] and a torque [N m] meanwhile


class FootSensors:
    """Moves wrenches to the soles, and takes offset and weight of the feet away.

    Args:
        robot: The robot; `foot_sensors` of its file says what its sensors report.
        offsets: What each sensor reports without any load, by side, (6,) [N, N m].

    Raises:
        RobotConfigError: The feet's weight counts, but no `sensor_joint` says what they are.
    """

    def __init__(self, robot: RobotModel, offsets: Mapping[str, Array]) -> None:
        self._model, self._offsets = robot.model, offsets
        given = robot.config.foot_sensors
        self._sign = -1.0 if given.reversed else 1.0
        self._soles = {side: self._model.frames[self._model.getFrameId(robot.feet[side].frame)]
                       for side in SIDES}
        self._weights = dict.fromkeys(SIDES, np.zeros(6))
        self._raw: dict[str, deque[tuple[str, Array]]] = {
            side: deque(maxlen=_KEPT) for side in SIDES}
        if given.compensated:
            return
        for side in SIDES:
            joint = robot.config.feet[side].sensor_joint
            if joint is None:
                raise RobotConfigError(
                    f"sensor_joint of the {side} foot, whose weight its sensor bears", value=None,
                    limit="a fixed joint of the URDF")
            self._weights[side] = self._weight(side, joint)

    def at_sole(self, side: str, frame: str, wrench: Array) -> Array | str:
        """Return the force and torque of the floor on a sole in its frame, (6,) [N, N m].

        Soles are taken as level, so that a foot of 2 kg that is tilted by 5 deg errs by 2 N.

        Args:
            side: left or right.
            frame: Name of the frame in which the sensor reports; empty, and one that the URDF
                lacks, stand for the sole's.
            wrench: What it reports, (6,) [N, N m].

        Returns:
            The wrench, or a sentence that says why there is none.
        """
        sole, name = self._soles[side], frame.rpartition("/")[2]
        self._raw[side].append((name, wrench))
        placed = self._placed(side, name)
        if isinstance(placed, str):
            return placed
        row = self._sign * (wrench - self._offsets[side])
        if placed is not sole:
            force = pin.Force(row[:3], row[3:])
            row = np.asarray((sole.placement.actInv(placed.placement)).act(force).vector)
        return np.asarray(row + self._weights[side])

    def offset(self, side: str) -> Array | str:
        """Return what a sensor reports of a foot in the air, (6,) [N, N m], or why it is unknown.

        It is the mean of the last readings, without the foot's own weight.
        """
        raw = self._raw[side]
        if len(raw) < _KEPT:
            return f"only {len(raw)} readings have arrived, {_KEPT} are needed"
        rows = np.array([row for _, row in raw])
        spread = rows.std(axis=0).reshape(2, 3).max(axis=1)
        if (spread > _STEADY).any():
            return (f"its readings vary by {spread[0]:.1f} N and {spread[1]:.2f} N m, at most "
                    f"{_STEADY[0]:g} N and {_STEADY[1]:g} N m are allowed: hold the foot still")
        placed = self._placed(side, raw[-1][0])
        if isinstance(placed, str):
            return placed
        weight = self._weights[side]
        here = placed.placement.actInv(self._soles[side].placement).act(
            pin.Force(weight[:3], weight[3:])).vector
        return np.asarray(rows.mean(axis=0) + self._sign * here)

    def _placed(self, side: str, name: str) -> pin.Frame | str:
        """Return the frame of a name, fixed to the foot, or why it cannot be one of the sensor."""
        sole, model = self._soles[side], self._model
        if not name or not model.existFrame(name):
            return sole
        found = model.frames[model.getFrameId(name)]
        if found.parentJoint == sole.parentJoint:
            return found
        return (f"its frame_id is {name}, which is not fixed to {sole.name}: is it the sensor of "
                "another foot or link?")

    def _weight(self, side: str, joint: str) -> Array:
        """Return the force and torque about the sole that carry what is below a sensor, (6,)."""
        total = inertia_beyond(self._model, joint)
        lever = self._soles[side].placement.actInv(total.lever)
        up = np.array([0.0, 0.0, total.mass * GRAVITY])
        return np.concatenate([up, np.cross(lever, up)])
