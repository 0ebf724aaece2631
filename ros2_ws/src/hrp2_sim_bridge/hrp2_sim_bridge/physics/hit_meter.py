"""Measurement of the contact between robot and leaf."""

from __future__ import annotations

from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.states import NO_TOUCH, Touch


class HitMeter:
    """Measures the contact in each step and averages its force over a millisecond.

    Args:
        engine: Engine in which robot and door are.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
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

    def take(self) -> Touch:
        """Finish a millisecond: its mean force, with link and point of the last contact in it."""
        if self._latest is NO_TOUCH:
            return NO_TOUCH
        touch = Touch(self._force, self._latest.link, self._latest.point)
        self._force, self._latest = 0.0, NO_TOUCH
        return touch
