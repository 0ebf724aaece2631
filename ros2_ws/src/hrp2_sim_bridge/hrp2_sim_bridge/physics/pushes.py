"""Pushes on the robot from outside: constant forces for a while, as of somebody who shoves it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError

from hrp2_sim_bridge.physics.engine import Engine

_LARGEST_IMPULSE = 200.0  # of all pushes that act: 58 kg then move at 3.4 m/s [N s]
_DURATION = (0.001, 10.0)  # shortest and longest push [s]


class _Push(NamedTuple):
    begin: float
    end: float
    force: Array


class RobotPushes:
    """Pushes on the robot's center of mass.

    Each link bears the share of the force that it has of the robot's mass, so that a push alone
    turns nothing: it changes the speed of all links alike.

    Args:
        engine: Engine in which the robot stands.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._pushes: list[_Push] = []
        self._acting = False

    def add(self, impulse: Array, duration: float, now: float) -> None:
        """Push, beginning now, with a constant force.

        Args:
            impulse: Impulse in the world, (3,) [N s].
            duration: Duration of the push [s].
            now: Time at which it begins [s].

        Raises:
            SettingError: The duration is out of its range, the impulse is not three finite numbers,
                or all pushes that act are together too strong.
        """
        shortest, longest = _DURATION
        if not shortest <= duration <= longest:
            raise SettingError("duration", duration, f"from {shortest:g} to {longest:g} s")
        push = np.array(impulse, dtype=float)
        if push.shape != (3,) or not np.isfinite(push).all():
            raise SettingError("impulse", push.tolist(), "three finite numbers")
        self._pushes = [one for one in self._pushes if now < one.end]
        strength = float(np.linalg.norm(push)) + sum(
            float(np.linalg.norm(one.force)) * (one.end - one.begin) for one in self._pushes)
        if strength > _LARGEST_IMPULSE:
            raise SettingError(
                "impulse of all pushes that act", f"{strength:g} N s",
                f"at most {_LARGEST_IMPULSE:g} N s")
        self._pushes.append(_Push(now, now + duration, push / duration))

    def act(self, now: float, duration: float) -> None:
        """Let the pushes act in the coming physics steps.

        Args:
            now: Time at which the steps begin [s].
            duration: Duration of the steps [s]; the force is the mean over it, so that the impulse
                is exact whenever a push begins and ends.
        """
        if not (self._pushes or self._acting):
            return
        force = np.zeros(3)
        for push in self._pushes:
            common = min(push.end, now + duration) - max(push.begin, now)
            force += push.force * (max(common, 0.0) / duration)
        self._pushes = [push for push in self._pushes if push.end > now + duration]
        self._engine.push_robot(force)
        self._acting = bool(force.any())
