"""Hands that yield to the forces that the wrists' sensors measure.

The displacement of each compliant hand (`admittance.py`) is added to the commanded posture by the
joints of its arm, with the least motion of these joints. Legs, chest and the other arm keep their
reference. Ranges and speeds of the joints are kept; what an arm cannot reach leaves the
displacement again, so that nothing winds up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.documents import checked
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES, needed
from humanoid_motion.chain import Chain
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.pinocchio_model import free_floating_model, joint_columns
from humanoid_motion.spline import JointReference

from hrp2_sim_bridge.control.admittance import Admittance, HandImpedance, shortened
from hrp2_sim_bridge.physics.engine import SimulatedRobot
from hrp2_sim_bridge.physics.frames import cross, rotation
from hrp2_sim_bridge.settings import TICK

_DAMPING = 0.02  # of the arm's inverse kinematics, for a stretched arm [m]
_SPEED_SHARE = 0.5  # share of a joint's largest speed that the displacement may use
_PASSES = 3  # times that joints at a bound are left out
_DECAY = 0.02  # share of the motion beside that of the hand that decays in a tick
_SLACK = 0.005  # distance by which an arm may be behind its hand's displacement [m]
_NOTHING = 1e-4  # correction at which the arm of a stiff hand is back at its reference [rad]
_SMOOTHING = 0.1  # time constant of the load [s]


class _Hand(NamedTuple):
    """Pose of a hand and its Jacobian by its own C joints, in the axes of base_link."""

    place: Array
    turn: Array
    jacobian: Array


class HandCompliance:
    """Corrects the reference of the arms once in each control tick; at first both are stiff.

    Args:
        robot: Configuration of the robot.

    Attributes:
        load: Force of the surroundings on both hands together and its moment about the origin of
            base_link, in the axes of base_link, smoothed, (6,) [N, N m]; None while both are stiff.
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        self._robot = robot
        self._model = free_floating_model(robot)
        self._data = self._model.createData()
        self._q_index, self._v_index = joint_columns(self._model, robot.joint_names)
        links = [sensor.link for sensor in map((robot.wrist_sensors or {}).get, SIDES) if sensor]
        self._frames = [self._model.getFrameId(link) for link in links]
        self._imu = self._model.getFrameId(robot.imu_frame)
        chains = [set(Chain(self._model, robot.joint_names, link).columns) for link in links]
        self._columns = [  # of the joints that move one hand but not the other
            np.array(sorted(chain - set.intersection(*chains))) for chain in chains]
        self._q = pin.neutral(self._model)
        self._fastest = _SPEED_SHARE * TICK * robot.velocity_limit
        self.reset()

    @property
    def active(self) -> bool:
        """Whether a hand is compliant or not yet back at its commanded place."""
        return any(hand.active for hand in self._hands) or bool(self._after.any())

    def displacement(self, side: str) -> Array:
        """Return the displacement of the hand of a side in the world, (3,) [m]."""
        return self._hands[SIDES.index(side)].place

    def reset(self) -> None:
        """Make both hands stiff at once."""
        count = len(self._robot.joint_names)
        self._hands = [Admittance() for _ in SIDES]
        self._before, self._after = np.zeros(count), np.zeros(count)
        self._begin = 0.0
        self.load: Array | None = None

    def comply(
        self, side: str, stiffness: float = -1.0, damping: float = -1.0, mass: float = -1.0
    ) -> None:
        """Make a hand compliant, change its impedance, or make it stiff, or refuse as a whole.

        Args:
            side: "left" or "right".
            stiffness: Stiffness [N/m]; a negative one makes the hand stiff.
            damping: Damping [N s/m]; a negative one is that of `HandImpedance`.
            mass: Mass [kg]; a negative one is that of `HandImpedance`.

        Raises:
            SettingError: There is no such side, its wrist has no force sensor, or a value is out of
                its range.
        """
        sides = SIDES[: len(self._frames)]
        if side not in sides:
            raise SettingError(
                "side of a hand with a force sensor", side, " or ".join(sides) or "none")
        values = {"stiffness": stiffness, "damping": damping, "mass": mass}
        given = {name: value for name, value in values.items() if not value < 0.0}
        impedance = checked(HandImpedance, given)
        self._hands[SIDES.index(side)].change(impedance if "stiffness" in given else None)

    def offsets(self, times: Array) -> Array:
        """Return joint corrections (T, J) [rad] at times (T,) [s] in the last update's tick."""
        share = ((times - self._begin) / TICK).clip(0.0, 1.0)[:, None]
        return np.asarray(self._before + share * (self._after - self._before))

    def update(self, sample: TickSample, reference: Callable[[float], JointReference]) -> None:
        """Choose the correction for the end of the tick that begins now.

        It follows from what was measured by now, and from the uncorrected reference at times [s].
        """
        self._before, self._begin = self._after, sample.time
        position = reference(sample.time + TICK).position
        stiff = self._poses(position)
        poses = self._poses(position + self._before)
        imu = pin.updateFramePlacement(self._model, self._data, self._imu).rotation
        base = rotation(sample.imu.orientation).dot(imu.T)  # base_link in the world
        wrenches = (sample.left_hand_wrench, sample.right_hand_wrench)
        after, load = np.zeros_like(self._before), np.zeros(6)
        for index, (hand, pose) in enumerate(zip(self._hands, poses, strict=True)):
            wrench, columns = needed(wrenches[index], "wrist_sensors"), self._columns[index]
            force, torque = pose.turn.dot(wrench[:3]), pose.turn.dot(wrench[3:])
            if np.isfinite(wrench).all():
                load += np.concatenate([force, torque + cross(pose.place, force)])
            if hand.active:
                hand.update(base.dot(force))
            elif not self._before[columns].any():
                continue
            target = stiff[index].place + base.T.dot(hand.place)
            correction, missed = self._reach(index, position, pose, target)
            if hand.active:  # its displacement waits for an arm that is at a bound
                hand.keep_to(hand.place - base.dot(missed - shortened(missed, _SLACK)))
            elif np.abs(correction).max() < _NOTHING:
                continue
            after[columns] = correction
        self._after = after
        if self.load is not None:
            load = self.load + TICK / (TICK + _SMOOTHING) * (load - self.load)
        self.load = load if self.active else None

    def _poses(self, position: Array) -> list[_Hand]:
        self._q[self._q_index] = position
        pin.computeJointJacobians(self._model, self._data, self._q)
        found = []
        for frame, columns in zip(self._frames, self._columns, strict=True):
            pose = pin.updateFramePlacement(self._model, self._data, frame)
            jacobian = pin.getFrameJacobian(
                self._model, self._data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            found.append(_Hand(np.array(pose.translation), np.array(pose.rotation),
                               jacobian[:3, self._v_index[columns]]))
        return found

    def _reach(
        self, index: int, position: Array, pose: _Hand, target: Array
    ) -> tuple[Array, Array]:
        """Change the correction of an arm by one step of damped least squares.

        What moves the joints but not the hand decays, so that the correction stays small.

        Args:
            index: 0 for the left hand, 1 for the right one.
            position: Commanded posture, (J,) [rad].
            pose: The hand with the present correction.
            target: Wanted place of the hand in the axes of base_link, (3,) [m].

        Returns:
            Correction of the arm's joints, (C,) [rad], and the way to the target that is left,
            (3,) [m].
        """
        robot, columns, jacobian = self._robot, self._columns[index], pose.jacobian
        here, error = self._before[columns], target - pose.place
        low = np.minimum(robot.lower - position, 0.0)[columns] - here
        high = np.maximum(robot.upper - position, 0.0)[columns] - here
        change, free = np.zeros(len(columns)), np.ones(len(columns), dtype=bool)
        for _ in range(_PASSES):
            part = jacobian[:, free]
            inverse = part.T.dot(np.linalg.inv(part.dot(part.T) + _DAMPING**2 * np.eye(3)))
            idle = here[free] - inverse.dot(part.dot(here[free]))
            left = error - jacobian[:, ~free].dot(change[~free])
            change[free] = inverse.dot(left) - _DECAY * idle
            bounded = change.clip(low, high)
            within, change = bounded == change, bounded
            free &= within
            if within.all() or not free.any():
                break
        change /= max(1.0, np.abs(change / self._fastest[columns]).max())
        return here + change, error - jacobian.dot(change)
