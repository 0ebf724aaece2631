"""The reference of the joints, which behaves like ros2_control's JointTrajectoryController."""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.knots import Knots
from humanoid_motion.spline import JointReference, Spline
from humanoid_motion.tolerances import SPEED_OVERSHOOT

from robot_driver.errors import TrajectoryRefusedError
from robot_driver.trajectory_checks import (
    CheckedTrajectory,
    JointLimits,
    check_arrays,
    check_spline,
    require,
)

PERIOD = 0.005  # control period of the driver [s]
_STOP_TIME = 0.15  # duration of the braking after an empty trajectory [s]
_LATEST_START = 60.0  # longest wait for a start; a later stamp comes from another clock [s]
_BRAKES = (1.0, 0.5, 0.25, 0.1)  # shares of the stop time that are tried for a braking
_SAME_TIME = 1e-9  # largest difference of equal times [s]
_AT_REST = 1e-6  # speed below which a joint counts as at rest [rad/s]


class TrajectoryDriver:
    """Reference of all joints as a function of time; only accepted trajectories change it.

    Without a trajectory the joints hold their position. A trajectory is checked as a whole before
    its first sample, and a refused one changes nothing. A later trajectory replaces the present one
    at its start time: from the reference that is in force then it goes to the first point to come.
    Where its first points are due already, the reference may differ from where it should be by the
    distance that a joint covers in one tick.

    Args:
        limits: Names and limits of the N joints.
        position: Positions of the joints at rest at the start, (N,) [rad].

    Attributes:
        limits: Names and limits of the joints.
    """

    def __init__(self, limits: JointLimits, position: Array) -> None:
        self.limits = limits
        self._splines: list[Spline] = []
        self.reset(position)

    def reset(self, position: Array, now: float = 0.0) -> None:
        """Discard every trajectory and rest at positions (N,) [rad] from now on [s].

        Raises:
            TrajectoryRefusedError: The positions are not N finite numbers.
        """
        rest = np.array(position, dtype=float)
        wanted = (len(self.limits.names),)
        require(rest.shape == wanted and np.isfinite(rest).all(), "posture to rest in", "",
                rest.shape, wanted)
        self._splines = [Spline(np.array([now]), rest[None])]

    def sample(self, time: float) -> JointReference:
        """Return the reference at a time [s], not earlier than that of the last `accept`."""
        splines = self._splines
        for spline in reversed(splines):
            if time >= spline.start - _SAME_TIME:
                return spline.sample(max(time, spline.start))
        return splines[0].sample(time)

    def positions(self, times: Array) -> Array:
        """Return the reference positions (T, N) [rad] at increasing times (T,) [s]."""
        begun = [index for index, spline in enumerate(self._splines)
                 if times[0] >= spline.start - _SAME_TIME]
        first = begun[-1] if begun else 0  # of the splines that have begun, the last one counts
        out = self._splines[first].positions(np.maximum(times, self._splines[first].start))
        for spline in self._splines[first + 1:]:
            started = times >= spline.start - _SAME_TIME
            if started.any():
                out[started] = spline.positions(np.maximum(times[started], spline.start))
        return out

    def remaining(self, now: float) -> Knots:
        """Return the motion that is made from a time [s] on, until rest; its times count from it.

        The time is not earlier than that of the last `accept`. Between the knots the motion is a
        quintic only if it was in the trajectories that were accepted.
        """
        splines = self._splines
        times = [now]
        for index, spline in enumerate(splines):
            until = splines[index + 1].start if index + 1 < len(splines) else math.inf
            times += [time for time in (spline.start, *spline.times[1:])
                      if times[-1] + _SAME_TIME < time < until - _SAME_TIME]
        if len(times) == 1:
            times.append(now + _STOP_TIME)
        states = [self.sample(time) for time in times]
        return Knots(
            np.array(times) - now,
            *(np.array([getattr(state, name) for state in states])
              for name in ("position", "velocity", "acceleration")))

    def is_moving(self, time: float) -> bool:
        """Return True while a trajectory is being followed or waits for its start."""
        return time < self._splines[-1].end

    def accept(self, message: TrajectoryArrays, stamp: float, now: float) -> None:
        """Accept a trajectory, or refuse it as a whole; one without points means stop.

        Its clock starts at the stamp [s], or now [s] where the stamp is 0.

        Raises:
            TrajectoryRefusedError: The trajectory is refused; the error has the joint, the value
                and the limit.
        """
        if message.is_stop:
            self.stop(now)
            return
        require(np.isfinite(stamp) and stamp >= 0.0, "stamp [s]", "", float(stamp),
                ">= 0 and finite")
        require(stamp <= now + _LATEST_START,
                "stamp [s] too far ahead: is it from the driver's clock (use_sim_time)? Stamp", "",
                float(stamp), now + _LATEST_START)
        checked = check_arrays(message, self.limits)
        origin = now if stamp == 0.0 else stamp
        end = float(origin + checked.times[-1])
        require(end >= now - _SAME_TIME, "the trajectory had ended before it arrived, end [s]", "",
                end, f"after {now:.6g}")
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            spline = self._spline_from(checked, origin, now)
        check_spline(spline, self.limits, SPEED_OVERSHOOT)
        # Straight lines have corners in any case, and end at their last point.
        splines = self._with_brake(spline) if checked.velocity is not None else [spline]
        for brake in splines[1:]:
            check_spline(brake, self.limits, SPEED_OVERSHOOT)
        self._append(splines, now)

    def stop(self, now: float) -> None:
        """Brake every joint within the stop time and hold; discard waiting trajectories."""
        state = self.sample(now)
        self._append([self._brake(state, now)], now)

    def _spline_from(self, checked: CheckedTrajectory, origin: float, now: float) -> Spline:
        """Build the motion in absolute time: from the present reference to the points to come."""
        times = origin + checked.times
        start = max(origin, now)
        due = times <= start + _SAME_TIME
        if due.any():
            # Overdue: the reference must be close to where it should be by now.
            on_time = Spline(times, checked.position, checked.velocity, checked.acceleration)
            self._check_jump(on_time.sample(start).position, start, PERIOD)
            if due.all():
                return Spline(times[-1:], checked.position[-1:])
        else:
            self._check_jump(checked.position[0], start, max(times[0] - start, PERIOD))
        here = self.sample(start)

        def joined(first: Array, rest: Array | None) -> Array | None:
            return None if rest is None else np.vstack([first, rest[~due]])

        return Spline(
            np.concatenate([[start], times[~due]]),
            np.vstack([here.position, checked.position[~due]]),
            joined(here.velocity, checked.velocity),
            joined(here.acceleration, checked.acceleration))

    def _check_jump(self, target: Array, start: float, duration: float) -> None:
        speed = np.abs(target - self.sample(start).position) / duration
        allowed = self.limits.velocity * SPEED_OVERSHOOT
        joint = int(np.argmax(speed / allowed))
        require(speed[joint] <= allowed[joint],
                "jump from the reference to the first point, speed [rad/s]",
                self.limits.names[joint], float(speed[joint]), float(allowed[joint]))

    def _with_brake(self, spline: Spline) -> list[Spline]:
        """Add a braking motion if the last point still moves."""
        end = spline.end_state()
        if np.abs(end.velocity).max() < _AT_REST:
            return [spline]
        return [spline, self._brake(end, spline.end)]

    def _brake(self, state: JointReference, now: float) -> Spline:
        """Brake within the stop time, or faster if the motion would otherwise violate a limit."""
        for share in _BRAKES:
            brake = self._brake_within(state, now, share * _STOP_TIME)
            try:
                check_spline(brake, self.limits, SPEED_OVERSHOOT)
            except TrajectoryRefusedError:
                continue
            break
        return brake

    def _brake_within(self, state: JointReference, now: float, duration: float) -> Spline:
        # The end position of a braking whose velocity is a cubic of time.
        end = state.position + state.velocity * duration / 2 + state.acceleration * duration**2 / 12
        end = np.clip(
            end,
            np.minimum(self.limits.lower, state.position),
            np.maximum(self.limits.upper, state.position))
        zero = np.zeros_like(end)
        return Spline(
            np.array([now, now + duration]),
            np.vstack([state.position, end]),
            np.vstack([state.velocity, zero]),
            np.vstack([state.acceleration, zero]))

    def _append(self, splines: list[Spline], now: float) -> None:
        start = max(splines[0].start, now)
        kept = [old for old in self._splines if old.start < start - _SAME_TIME]
        # Of the splines that have started, only the last one is still needed.
        started = [old for old in kept if old.start <= now]
        self._splines = started[-1:] + [old for old in kept if old.start > now] + splines
