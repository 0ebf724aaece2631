"""The torques on the door's leaf: closer, friction, stops and pushes by hand."""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.errors import SettingError
from door_model.door.config import DoorConfig

from hrp2_sim_bridge.physics.engine import DoorState

_TABLE_STEP = 5e-4  # step of the table of the closer's torque [rad]
_BELOW_CLOSED = 0.05  # range of the table below the closed door [rad]
_ABOVE_STOP = 0.04  # range of the table above the outer stop [rad]
_WIDEST = 2.0  # angle of the outer stop, unless the linkage has a smaller range [rad]
_LINKAGE_MARGIN = 0.05  # angle between the outer stop and the end of the linkage's range [rad]
_STOP_STIFFNESS = 1.5e6  # stiffness of the stops [N m/rad]: 18 N m push the leaf in by 0.0007 deg
_STOP_DAMPING_RATIO = 1.5
_PUSH_IMPULSE = 200.0  # largest angular impulse of a push by hand, with a margin [N m s]
# Greatest speed to which pushes bring the leaf, with a margin: no hand is as fast as the edge of a
# leaf then is, 14 m/s. door_encoder takes a leaf faster than its `max_speed` for an error [rad/s].
FASTEST_PUSHED = 16.0
_PUSH_DURATION = (0.001, 10.0)  # shortest and longest push [s]


class CloserTorque:
    """The closer's torque about the hinge, eqs. (12) and (13), interpolated in fine tables.

    Args:
        config: Configuration of the door.
        widest: Largest opening angle that is ever asked for [rad].
    """

    def __init__(self, config: DoorConfig, widest: float) -> None:
        lowest = max(-_BELOW_CLOSED, config.linkage.closing_limit() + 1e-3)
        angles = np.arange(lowest, widest + _TABLE_STEP, _TABLE_STEP)
        f, eta = config.linkage.f_and_eta(angles)
        door, self._angles = config.door(), angles
        self._spring = eta * (config.k_c * f + config.tau_c0_prime)
        self._opening, self._closing = (
            door.viscosity(angles, sign) * eta**2 for sign in (1.0, -1.0))

    def __call__(self, angle: float, velocity: float) -> float:
        """Return the torque on the leaf [N m], negative when it closes the door."""
        damping = self._opening if velocity > 0.0 else self._closing
        spring, drag = (
            float(np.interp(angle, self._angles, table)) for table in (self._spring, damping))
        return -spring - drag * velocity


class DoorLoad:
    """Everything that turns the leaf about its hinge, except the robot.

    Args:
        config: Configuration of the door.
        opens_to: Opening angle of a bolt or a stop before the outer one [rad]; None: there is none.

    Attributes:
        widest: Opening angle of the outer stop [rad].
    """

    def __init__(self, config: DoorConfig, opens_to: float | None = None) -> None:
        self.widest = min(_WIDEST, config.linkage.opening_limit() - _LINKAGE_MARGIN)
        if opens_to is not None:
            self.widest = min(self.widest, opens_to)
        self._config = config
        self._closer = CloserTorque(config, self.widest + _ABOVE_STOP)
        self._stop_damping = 2.0 * _STOP_DAMPING_RATIO * math.sqrt(_STOP_STIFFNESS * config.i_a)
        self._pushes: list[tuple[float, float, float]] = []

    def push(self, impulse: float, duration: float, now: float, state: DoorState) -> None:
        """Push the leaf by hand from now on [s]: the torque is half a sine of a duration [s].

        A positive angular impulse about the hinge [N m s] opens the door.

        Raises:
            SettingError: The push, or all pushes that act together, exceed what a hand can do, or
                the push is not a number.
        """
        shortest, longest = _PUSH_DURATION
        if not shortest <= duration <= longest:
            raise SettingError("duration", duration, f"from {shortest:g} to {longest:g} s")
        if not abs(impulse) <= _PUSH_IMPULSE:
            raise SettingError("impulse", impulse, f"at most {_PUSH_IMPULSE:g} N m s")
        self._pushes = [push for push in self._pushes if now < push[0] + push[1]]
        inertia = self._config.i_a
        fastest = state.velocity + (impulse + sum(push[2] for push in self._pushes)) / inertia
        if abs(fastest) > FASTEST_PUSHED and fastest * impulse > 0.0:
            raise SettingError(
                "speed of the leaf after all pushes that act", f"{fastest:.1f} rad/s",
                f"at most {FASTEST_PUSHED:g} rad/s")
        self._pushes.append((now, duration, impulse))

    @property
    def pushed(self) -> bool:
        """Whether a push by hand acts."""
        return bool(self._pushes)

    def torque(self, state: DoorState, now: float, duration: float) -> float:
        """Return the torque of closer, friction, stops and pushes on the leaf [N m].

        It acts from now [s] for a duration [s].
        """
        # In the middle of the duration: a torque with a delay takes damping from the closer.
        angle = state.angle + 0.5 * duration * state.velocity
        torque = self._closer(angle, state.velocity) + self._hand(now + 0.5 * duration)
        friction, inertia = self._config.friction, self._config.i_a
        if friction:
            # Friction is limited to the torque that brings the leaf to rest.
            stopping = torque + inertia * state.velocity / duration
            torque -= min(max(stopping, -friction), friction)
        return torque + self._stops(state, torque, duration)

    def _hand(self, time: float) -> float:
        if not self._pushes:
            return 0.0
        torque = 0.0
        for begin, duration, impulse in self._pushes:
            share = (time - begin) / duration
            if 0.0 <= share <= 1.0:
                torque += impulse * math.pi / (2.0 * duration) * math.sin(math.pi * share)
        if time > self._pushes[0][0] + self._pushes[0][1]:
            self._pushes.pop(0)
        return torque

    def _stops(self, state: DoorState, torque: float, step: float) -> float:
        """Return the torque of the frame (closed door) or of the outer stop [N m].

        Each is a spring-damper that cannot pull. The torque tau is computed implicitly, so that it
        is stable at any step h: for a penetration e and a velocity w,
        tau = -(k (e + h w') + c w') with w' = w + h (tau + other torques) / I.
        """
        inertia = self._config.i_a
        for edge, side in ((0.0, 1.0), (self.widest, -1.0)):
            inside = (edge - state.angle) * side
            if inside > 0.0:
                free = (state.velocity + step * torque / inertia) * side
                gain = step * _STOP_STIFFNESS + self._stop_damping
                push = _STOP_STIFFNESS * inside - gain * free
                return side * max(push, 0.0) / (1.0 + gain * step / inertia)
        return 0.0
