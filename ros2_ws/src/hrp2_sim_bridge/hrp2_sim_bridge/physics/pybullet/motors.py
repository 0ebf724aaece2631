"""The motors of the joints: PyBullet's position control."""

from __future__ import annotations

from functools import partial
from typing import Any


class JointMotors:
    """One motor for each joint.

    Args:
        client: Client of PyBullet.
        body: PyBullet's index of the robot.
        joints: PyBullet's indices of the 30 joints.
        time_constant: Time constant with which a position error decays [s].
        limits: Torque limits of the motors (30) [N m].

    Attributes:
        limits: Torque limits (30) that hold in the coming steps [N m].
    """

    def __init__(
        self, client: Any, body: int, joints: list[int], time_constant: float, limits: list[float]
    ) -> None:
        self._drive = partial(
            client.setJointMotorControlArray, body, joints, client.POSITION_CONTROL,
            velocityGains=[1.0] * len(joints),
        )
        self._time_constant = time_constant
        self._gains = [0.0] * len(joints)
        self.limits = limits

    def set_time_step(self, step: float) -> None:
        """Keep the time constant with another physics step [s]."""
        # PyBullet's gain is the share of the position error that is corrected in one step.
        self._gains = [min(step / self._time_constant, 1.0)] * len(self._gains)

    def command(self, positions: list[float], velocities: list[float]) -> None:
        """Set the targets of all motors for the coming physics step.

        Args:
            positions: 30 reference positions at the start of the step [rad].
            velocities: 30 mean velocities of the reference over the step [rad/s]; a joint without
                a position error then arrives exactly at the reference at the end of the step.
        """
        self._drive(
            targetPositions=positions, targetVelocities=velocities, forces=self.limits,
            positionGains=self._gains,
        )
