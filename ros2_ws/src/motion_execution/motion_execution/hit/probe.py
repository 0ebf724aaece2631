"""The probe: before the run-up the elbow touches the leaf slowly.

::

    Approach -> Searching -> Touched -> Returning -> RunUp
                    |           |
                    +-----------+-----> Retreat (no leaf, a locked one, one elsewhere) -> Ended

The robot follows the path of the run-up at a speed at which it can stop at any time. Each
trajectory that is sent ends where the run-up begins, so that the driver goes back by itself. A leaf
that gives is then hit where it was found; one that does not is locked. A bolt with play lets the
leaf move, too, and passes for a free one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import Command
from humanoid_motion.splice import concatenate, cut, duration
from impact_planner.motion.post import back_along, continue_from
from impact_planner.motion.slow_path import RAMP, slow_path, ways_along
from robot_driver.motion import Outcome

from motion_execution.hit import reasons
from motion_execution.hit.contact import Contact, ContactDetector, Sensor
from motion_execution.hit.preflight import DOOR_TOLERANCE
from motion_execution.hit.state import Reaction, Reference
from motion_execution.hit.states import RunUp, TowardsDoor, there_and_back
from motion_execution.hit.types import PROBE, RUN_UP, ExecutablePlan
from motion_execution.settings import ExecutionSettings

SPEED = 0.05  # of B on its way to the leaf [m/s]
_STOPS = 0.2  # time from the touch to rest, in which B goes on by some 5 mm [s]
_SHORTEST = 0.05  # shortest such time, where the path ends [s]
_BACK = 0.4  # time of the way back as a share of that of the way to the leaf
_RESTS = 0.3  # time at the leaf, in which its encoder shows whether it gives [s]
# The accelerometer shows a touch at that speed by 2.7 to 3.4 m/s^2 and the slow motion by 0.15, the
# feet by 44 to 60 N and 8 N at most: threshold [m/s^2], and share of the hit's [-].
_DECELERATION, _FELT = 1.0, 25.0 / 80.0
# Angle by which a leaf has moved, two counts of its encoder [rad]. The touch opens a door with a
# closer of size 4 by 0.08 deg, the paper's by 0.27 deg.
_MOVES = 0.0008
_SURE = 0.005  # largest error of the place that the probe finds [m]
_SHUT = 5.0  # longest time until the leaf has fallen shut after the probe [s]
_KEPT = 200  # number of the last joint states, 1 s at 200 Hz


class LeafProbe:
    """What the probe of an execution knows and has felt.

    Args:
        plan: The plan.
        settings: Thresholds of the execution.
        away: Horizontal unit vector away from the door in the IMU's frame, (3,).
        reach: Function that returns the way of B towards the door [m] at joint positions (J,)
            [rad].

    Attributes:
        path: The slow motion from the start of the run-up to its end.
        off: Distance by which the leaf stands farther away than planned; NaN before a touch [m].
    """

    def __init__(self, plan: ExecutablePlan, settings: ExecutionSettings, away: Array,
                 reach: Callable[[Array], float]) -> None:
        run_up = plan.phases[RUN_UP]
        self._time, self._ways = ways_along(run_up, reach)
        self.path = slow_path(run_up, self._time, self._ways, SPEED)
        self._reach, self._contact_time = reach, plan.contact_time
        self._felt = _FELT * settings.felt_force
        self._detector = ContactDetector(replace(
            settings, contact_deceleration=_DECELERATION, felt_force=self._felt), away)
        self._joints: deque[tuple[float, Array]] = deque(maxlen=_KEPT)
        self._rest: float | None = None  # angle of the leaf before the touch [rad]
        self._most, self._force = -np.inf, 0.0  # largest angle [rad] and force [N]
        self.off = np.nan

    @property
    def gives(self) -> bool:
        """Whether the leaf has moved as one that is not locked does."""
        return self._rest is not None and self._most - self._rest >= _MOVES

    @property
    def felt(self) -> bool:
        """Whether something has resisted, as the feet show."""
        return self._force >= self._felt

    def shut(self, angle: float) -> bool:
        """Whether the leaf, at an angle [rad], is back where it stood before the touch."""
        return self._rest is not None and abs(angle - self._rest) <= DOOR_TOLERANCE

    def later(self, off: float) -> float:
        """Compute how much later than planned B meets a leaf farther away by `off` [m], in [s]."""
        planned = float(np.interp(self._contact_time, self._time, self._ways))
        return float(np.interp(planned + off, self._ways, self._time)) - self._contact_time

    def on_joints(self, now: float, position: Array) -> None:
        """Keep joint positions, (J,) [rad], with their stamp [s]."""
        self._joints.append((now, position))

    def on_door(self, now: float, angle: float) -> Contact | None:
        """Handle the door's angle [rad], with its stamp [s]; the first one is that at rest."""
        if self._rest is None:
            self._rest = angle
        self._most = max(self._most, angle)
        return Contact(now, now, Sensor.DOOR) if angle - self._rest >= _MOVES else None

    def on_imu(self, now: float, force: Array) -> Contact | None:
        """Handle the specific force in the IMU's frame, (3,) [m/s^2], with its stamp [s]."""
        return self._detector.on_imu(now, force)

    def on_feet(self, now: float, force: float) -> Contact | None:
        """Handle the floor's force on both feet towards the door [N], with its stamp [s]."""
        self._force = max(self._force, force)
        return self._detector.on_feet(now, force)

    def touched(self, begin: float) -> None:
        """Find the leaf from the joints at the begin of a contact [s]."""
        _, position = min(self._joints, key=lambda kept: abs(kept[0] - begin))
        planned = float(np.interp(self._contact_time, self._time, self._ways))
        self.off = self._reach(position) - planned


@dataclass(frozen=True, kw_only=True)
class _Probing(TowardsDoor):
    """A state of the probe, in which a stop is the driver's own: the robot is slow.

    Attributes:
        probe: What it knows and has felt.
    """

    probe: LeafProbe

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> Reaction:
        """End if a stop is requested, change the state at its time, check the joints."""
        if self.run.stop_requested:
            return self.stop_driver(Outcome.STOPPED, reasons.stopped(self.phase))
        self.probe.on_joints(now, position)
        if now >= self.end:
            return self._over(now, position)
        return self.compared(now, position)

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Note the angle."""
        self.probe.on_door(now, angle)
        return Reaction(self)

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """Note the force."""
        self.probe.on_feet(now, force)
        return Reaction(self)

    def _over(self, now: float, position: Array) -> Reaction:
        """React when the time of the state is over."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Searching(_Probing):
    """The elbow goes slowly towards the leaf."""

    def on_door(self, now: float, angle: float, velocity: float) -> Reaction:
        """Stop if the leaf has moved."""
        return self._touched(self.probe.on_door(now, angle))

    def on_specific_force(self, now: float, force: Array) -> Reaction:
        """Stop if the leaf slows the trunk down."""
        return self._touched(self.probe.on_imu(now, force))

    def on_foot_forces(self, now: float, force: float) -> Reaction:
        """Stop if the leaf pushes the robot back."""
        return self._touched(self.probe.on_feet(now, force))

    def _touched(self, contact: Contact | None) -> Reaction:
        """Come to rest at the leaf, and go back from there."""
        if contact is None or contact.begin < self.begin + RAMP:
            return Reaction(self)
        run, path = self.run, self.probe.path
        self.probe.touched(contact.begin)
        run.measured.leaf_off = self.probe.off
        stamp = run.present(contact.shown) + run.settings.splice
        since, last = stamp - self.begin, float(path.time[-1])
        stops = float(np.clip(2.0 * (last - since), _SHORTEST, _STOPS))
        since = min(since, last - 0.5 * stops)
        reached = since + 0.5 * stops
        knots = concatenate([continue_from(path, since, 1.0, stops).held_until(stops + _RESTS),
                             back_along(cut(path, reached), _BACK * reached)])
        return Reaction(
            Touched(run=run, phase=PROBE, begin=self.begin, end=stamp + stops + _RESTS,
                    sent=Reference(stamp, knots), probe=self.probe), (Command(stamp, knots),))

    def _over(self, now: float, position: Array) -> Reaction:
        if now <= self.end + self.run.settings.late:
            return self.compared(now, position)
        return self.follow_back(self.end, Outcome.NO_CONTACT, reasons.NO_LEAF)


@dataclass(frozen=True, kw_only=True)
class Touched(_Probing):
    """The robot comes to rest at the leaf, and the leaf shows whether it gives."""

    def _over(self, now: float, position: Array) -> Reaction:
        run, probe = self.run, self.probe
        if not probe.gives:
            return self.follow_back(self.end, *(
                (Outcome.LOCKED, reasons.locked(probe.off)) if probe.felt else
                (Outcome.NO_CONTACT, reasons.NOT_FELT)))
        run.later = probe.later(probe.off)
        if abs(run.later) > run.plan.steady_time:
            return self.follow_back(self.end, Outcome.NO_CONTACT, reasons.elsewhere(probe.off))
        run.steady = probe.later(probe.off + _SURE) - run.later
        return Reaction(Returning(
            run=run, phase=PROBE, begin=self.begin,
            end=self.sent.end + run.settings.judged_after, sent=self.sent, probe=probe))


@dataclass(frozen=True, kw_only=True)
class Returning(_Probing):
    """The robot goes back to the start of the run-up, and the leaf falls shut."""

    def _over(self, now: float, position: Array) -> Reaction:
        run, angle = self.run, self.run.door_angle
        if not self.probe.shut(angle):
            if now < self.end + _SHUT:
                return self.compared(now, position)
            return self.ended(Outcome.NO_CONTACT, reasons.stays_open(angle))
        run_up, stamp = run.plan.phases[RUN_UP], now + run.settings.lead
        run.starts[RUN_UP] = stamp
        sent = Reference(stamp, there_and_back(
            run_up, run.settings.goes_back, run.settings.back_from_miss))
        return Reaction(
            RunUp(run=run, phase=RUN_UP, begin=stamp, end=stamp + duration(run_up), sent=sent),
            (sent.from_here(now),))
