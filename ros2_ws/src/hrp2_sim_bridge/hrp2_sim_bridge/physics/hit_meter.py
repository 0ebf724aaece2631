"""Measurement of the contact between robot and leaf, and of the load that the brace carries."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.states import NO_TOUCH, Touch
from hrp2_sim_bridge.settings import SAMPLE

CONTACT_FORCE = 5.0  # normal force above which the brace's load counts as that of a contact [N]


class HitMeter:
    """Measures the contact each millisecond and sums the braced joints' impulses over the run.

    Args:
        engine: Engine in which robot and door are.
        robot: Configuration that names the braced joints and the limits of their motors.

    Attributes:
        carried_impulse: Angular impulses that the braced joints carried during contact, (B,)
            [N m s].
        brace_impulse: Part of the carried impulses beyond the motors' limits, which the brace
            itself carried, (B,) [N m s].
        motor_impulse: Largest impulses that the motors could have given in that time, (B,) [N m s].
    """

    def __init__(self, engine: Engine, robot: RobotConfig) -> None:
        self._engine = engine
        self._indices = [robot.index(name) for name in robot.braced_joints]
        self._limit = robot.effort_limit[self._indices]
        self.clear()

    def clear(self) -> None:
        """Forget every contact and start all sums at zero."""
        self.carried_impulse = np.zeros(len(self._indices))
        self.brace_impulse = np.zeros(len(self._indices))
        self.motor_impulse = np.zeros(len(self._indices))
        self._force, self._latest = 0.0, NO_TOUCH

    def add_step(self, share: float) -> None:
        """Measure the contact after a physics step.

        Args:
            share: Length of the step as a share of the millisecond.
        """
        touch = self._engine.touch()
        if touch.force > 0.0:
            self._force += share * touch.force
            self._latest = touch

    def take(self, torque: Array, *, braced: bool) -> Touch:
        """Finish a millisecond.

        Args:
            torque: Torques of the motors at its end, (30,) [N m].
            braced: Whether the brace holds.

        Returns:
            Mean force over the millisecond, with link and point of the last contact in it.
        """
        if self._latest is NO_TOUCH:
            return NO_TOUCH
        touch = Touch(self._force, self._latest.link, self._latest.point)
        self._force, self._latest = 0.0, NO_TOUCH
        if braced and touch.force > CONTACT_FORCE:
            load = np.abs(torque[self._indices])
            self.carried_impulse += load * SAMPLE
            self.brace_impulse += np.maximum(load - self._limit, 0.0) * SAMPLE
            self.motor_impulse += self._limit * SAMPLE
        return touch
