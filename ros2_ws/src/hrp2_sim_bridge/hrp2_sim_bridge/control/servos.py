"""The joints' position servos: their targets, within the motors' torques and speeds.

A servo keeps the speed of its reference as stiffly as its motor's torque allows, and corrects a
position error with a time constant. A servo that corrected the error within one physics step would
make the robot rock after a hit, which the gains of a real servo do not.
"""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

_BRACE_TOLERANCE = np.deg2rad(5.0)  # largest error of the posture in which the brace holds [rad]
_BRACE_TORQUE = 3000.0  # torque that the arm leaning on the trunk may carry at a joint [N m]


class JointServos:
    """One servo for each joint.

    Args:
        robot: Configuration of the robot.
        time_constant: Time constant with which a position error decays [s].

    Attributes:
        forces: Torque limits (30) that `limit_torques` chose last [N m].
    """

    def __init__(self, robot: RobotConfig, time_constant: float) -> None:
        self._time_constant = time_constant
        self._speed_limit = robot.velocity_limit
        self._torque_limit = robot.effort_limit
        self._braced_limit = np.array(robot.effort_limit)
        self._braced_limit[[robot.index(name) for name in robot.braced_joints]] = _BRACE_TORQUE
        self._posture_indices = [robot.index(name) for name in robot.braced_posture]
        self._braced_posture = np.array(list(robot.braced_posture.values()))
        self.forces: list[float] = robot.effort_limit.tolist()

    def limit_torques(self, reference: Array, *, brace: bool, share: float) -> bool:
        """Choose the torque limits of a tick.

        Args:
            reference: Commanded posture, (30,) [rad].
            brace: Whether braced joints may carry more than their motors in the braced posture.
            share: Share of the motors' limits that is allowed without the brace.

        Returns:
            True if the brace holds.
        """
        error = np.abs(reference[self._posture_indices] - self._braced_posture)
        braced = brace and bool(error.max() < _BRACE_TOLERANCE)
        self.forces = (self._braced_limit if braced else share * self._torque_limit).tolist()
        return braced

    def within_speed(self, targets: Array, position: Array, step: float) -> Array:
        """Limit the targets so that no servo asks its motor for more speed than it has.

        Args:
            targets: References at the start of K - 1 physics steps and at the end of the last one,
                (K, 30) [rad].
            position: Present joint positions, (30,) [rad].
            step: Length of a physics step [s].

        Returns:
            Targets (K, 30) [rad]. A joint that is too far behind for its servo's gain approaches
            its reference at its motor's speed.
        """
        speed = np.abs(targets[-1] - targets[0]) / (step * (len(targets) - 1))
        reach = (self._speed_limit - speed) * self._time_constant
        behind = np.abs(targets[0] - position) > np.maximum(reach, 0.0)
        if not behind.any():
            return targets
        travel = np.outer(step * np.arange(len(targets)), self._speed_limit)
        return np.where(
            behind, np.clip(targets, position - travel, position + travel), targets
        )
