"""What happens to the robot from outside: pushes, a fall, and the contact with the leaf."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import SettingError

from hrp2_sim_bridge.physics.engine import NO_TOUCH, Engine, Touch

_LARGEST_IMPULSE = 200.0  # of all pushes that act: 58 kg then move at 3.4 m/s [N s]
_DURATION = (0.001, 10.0)  # shortest and longest push [s]
_FALLEN_TILT = math.radians(30.0)  # tilt of the base beyond which the robot has fallen [rad]


class _Push(NamedTuple):
    begin: float
    end: float
    force: Array


class RobotPushes:
    """Pushes on the robot's center of mass: constant forces for a while.

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
        """Push with a constant force from now on [s]: an impulse (3,) [N s] over a duration [s].

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
        """Let the pushes act in the physics steps of a duration [s] that begins now [s].

        The force is the mean over it, so that the impulse is exact whenever a push begins and ends.
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


class FallWatch:
    """Watches the base's tilt and the links that touch the floor.

    Args:
        soles: Names of the links that may touch the floor.

    Attributes:
        reason: What indicated the fall first; empty while the robot stands.
        max_tilt: Largest angle between the base's z axis and the vertical since the start [rad].
    """

    def __init__(self, soles: Collection[str]) -> None:
        self._soles = soles
        self.reason = ""
        self.max_tilt = 0.0

    def update(self, engine: Engine, base: Array) -> bool:
        """Examine the robot after a tick; return True in the tick in which it has fallen.

        The state of base_link is a row of `Engine.base_states`, (13,).
        """
        x, y = base[3:5].tolist()
        tilt = math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y)))
        self.max_tilt = max(self.max_tilt, tilt)
        if self.reason:
            return False
        if tilt > _FALLEN_TILT:
            self.reason = f"base tilted by {math.degrees(tilt):.0f} deg"
        touching = {
            contact.link for contact in engine.floor_contacts()
            if contact.link not in self._soles and contact.distance <= 0.0}
        if touching:
            self.reason = f"on the floor: {', '.join(sorted(touching))}"
        return bool(self.reason)


class HitMeter:
    """Measures the contact with the leaf in each step and averages its force over a millisecond.

    Args:
        engine: Engine in which robot and door are.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._force, self._latest = 0.0, NO_TOUCH

    def add_step(self, share: float) -> None:
        """Measure the contact after a physics step, which is a share of the millisecond."""
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
