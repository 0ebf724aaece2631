"""The joints' position servos, within the motors' torques and speeds.

A servo keeps to the speed of its reference as stiffly as its motor's torque allows, and takes a
position error back with a time constant. A step-by-step stiffer servo makes the robot rock after a
hit, which a real one, with its gains, does not.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

_BRACE_TOLERANCE = np.deg2rad(5.0)
_BRACE_TORQUE = 3000.0  # what the arm leaning on the trunk may carry at a joint [N m]


class JointServos:
    """One servo a joint.

    Args:
        client: of PyBullet.
        body: the robot there.
        joints: PyBullet's indices of the 30 joints.
        robot: configuration.
        time_constant: with which a position error decays [s].
    """

    def __init__(
        self, client: Any, body: int, joints: list[int], robot: RobotConfig, time_constant: float
    ) -> None:
        self._drive = partial(
            client.setJointMotorControlArray, body, joints, client.POSITION_CONTROL,
            velocityGains=[1.0] * len(joints),
        )
        self._time_constant = time_constant
        self._gains = [0.0] * len(joints)
        self._speed_limit = robot.velocity_limit
        self._torque_limit = robot.effort_limit
        self.braced_indices = [robot.index(name) for name in robot.braced_joints]
        self._braced_limit = np.array(robot.effort_limit)
        self._braced_limit[self.braced_indices] = _BRACE_TORQUE
        self._posture_indices = [robot.index(name) for name in robot.braced_posture]
        self._braced_posture = np.array(list(robot.braced_posture.values()))
        self.forces: list[float] = robot.effort_limit.tolist()

    def limit_torques(self, reference: Array, *, brace: bool, share: float) -> bool:
        """Choose the torque limits.

        Args:
            reference: (30,) commanded posture [rad].
            brace: whether braced joints may carry more than their motors in the braced posture.
            share: of the motors' limits that is allowed otherwise.

        Returns:
            True when braced.
        """
        error = np.abs(reference[self._posture_indices] - self._braced_posture)
        braced = brace and bool(error.max() < _BRACE_TOLERANCE)
        self.forces = (self._braced_limit if braced else share * self._torque_limit).tolist()
        return braced

    def set_step(self, step: float) -> None:
        """Keep to the time constant at another physics step [s]."""
        # PyBullet's gain is the share of the error that is taken back in a step.
        self._gains = [min(step / self._time_constant, 1.0)] * len(self._gains)

    def within_speed(self, targets: Array, position: Array, step: float) -> Array:
        """Let no servo ask its motor for more speed than it has.

        Args:
            targets: (K, 30) reference at the ends of physics steps [rad].
            position: (30,) where the joints are [rad].
            step: length of a step [s].

        Returns:
            Targets (K, 30); a joint too far behind for its servo's gain comes at its motor's speed.
        """
        speed = np.abs(targets[-1] - targets[0]) / (step * (len(targets) - 1))
        reach = (self._speed_limit - speed) * self._time_constant
        behind = np.abs(targets[0] - position) > np.maximum(reach, 0.0)
        if not behind.any():
            return targets
        way = np.outer(step * np.arange(len(targets)), self._speed_limit)
        return np.where(behind, np.clip(targets, position - way, position + way), targets)

    def command(self, positions: list[float], velocities: list[float]) -> None:
        """Targets of all servos for the coming physics step.

        Args:
            positions: 30 references at its start [rad].
            velocities: 30 mean speeds of the reference over it [rad/s]; so a servo that is where
                it should be arrives exactly on the reference at the end.
        """
        self._drive(
            targetPositions=positions, targetVelocities=velocities, forces=self.forces,
            positionGains=self._gains,
        )
