"""Trajectory driver with the manners of ros2_control's JointTrajectoryController."""

from __future__ import annotations

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.spline import JointState, Spline

from hrp2_sim_bridge.control.trajectory import (
    CheckedTrajectory,
    JointLimits,
    TrajectoryArrays,
    check_arrays,
    check_spline,
)
from hrp2_sim_bridge.errors import TrajectoryRefusedError

_DEFAULT_VELOCITY_FACTOR = 1.1
_DEFAULT_STOP_TIME = 0.15  # [s]
_DEFAULT_TICK = 0.005  # [s], HRP-2's control period
_LATEST_START = 60.0  # a trajectory that starts later is stamped by another clock [s]
_BRAKES = (1.0, 0.5, 0.25, 0.1)  # shares of the stop time that are tried
_SAME_TIME = 1e-9  # [s]


class TrajectoryDriver:
    """Reference of all joints as a function of time, changed only by accepted trajectories.

    Silence means hold. A trajectory is checked as a whole before its first sample, and a refused
    one changes nothing. A later trajectory takes over at its start time, until then the one before
    goes on.

    Args:
        limits: names and limits of the N joints.
        position: (N,) where the joints rest at first [rad].
        velocity_factor: speed allowed for the way to the first point and between points, as a
            multiple of the limit; points themselves must respect the limit.
        stop_time: duration of the braking after an empty trajectory [s].
        tick: control period [s]; a first point at time 0 may differ from the reference by what the
            joint covers in one tick.
    """

    def __init__(
        self,
        limits: JointLimits,
        position: Array,
        *,
        velocity_factor: float = _DEFAULT_VELOCITY_FACTOR,
        stop_time: float = _DEFAULT_STOP_TIME,
        tick: float = _DEFAULT_TICK,
    ) -> None:
        self.limits = limits
        self._velocity_factor = velocity_factor
        self._stop_time = stop_time
        self._tick = tick
        self._splines: list[Spline] = []
        self.reset(position)

    def reset(self, position: Array, now: float = 0.0) -> None:
        """Forget every trajectory and rest at a position (N,) [rad]."""
        rest = np.array(position, dtype=float)
        if rest.shape != (len(self.limits.names),) or not np.isfinite(rest).all():
            raise TrajectoryRefusedError(
                "posture to rest in", "", rest.shape, (len(self.limits.names),)
            )
        self._splines = [Spline(np.array([now]), rest[None])]

    def sample(self, time: float) -> JointState:
        """Reference at a time [s], not earlier than the last `accept`."""
        splines = self._splines
        for spline in reversed(splines):
            if time >= spline.start - _SAME_TIME:
                return spline.sample(max(time, spline.start))
        return splines[0].sample(time)

    def positions(self, times: Array) -> Array:
        """Reference positions (T, N) at rising times (T,) [s], as `sample` has them."""
        out = self._splines[0].positions(times)
        for spline in self._splines[1:]:
            begun = times >= spline.start - _SAME_TIME
            if begun.any():
                out[begun] = spline.positions(np.maximum(times[begun], spline.start))
        return out

    def is_moving(self, time: float) -> bool:
        """True while a trajectory is under way or waits for its start."""
        return time < self._splines[-1].end

    def accept(self, message: TrajectoryArrays, stamp: float, now: float) -> None:
        """Take a trajectory over, or refuse it whole.

        Args:
            message: the trajectory; without points it means stop.
            stamp: when its clock starts [s]; 0 means now.
            now: current time [s].

        Raises:
            TrajectoryRefusedError: names the joint, the value and the limit.
        """
        if message.is_stop:
            self.stop(now)
            return
        if not np.isfinite(stamp) or stamp < 0.0:
            raise TrajectoryRefusedError("stamp [s]", "", float(stamp), ">= 0 and finite")
        if stamp > now + _LATEST_START:
            raise TrajectoryRefusedError(
                "stamp [s] too far ahead, is it by the driver's clock (use_sim_time)?", "",
                float(stamp), now + _LATEST_START,
            )
        checked = check_arrays(message, self.limits)
        origin = now if stamp == 0.0 else stamp
        if origin + checked.times[-1] < now - _SAME_TIME:
            raise TrajectoryRefusedError(
                "the trajectory ended before it came, at [s]", "",
                float(origin + checked.times[-1]), float(now),
            )
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            spline = self._spline_from(checked, origin, now)
        check_spline(spline, self.limits, self._velocity_factor)
        # Straight lines have corners anyway and end on their last point.
        splines = self._with_brake(spline) if checked.velocity is not None else [spline]
        for brake in splines[1:]:
            check_spline(brake, self.limits, self._velocity_factor)
        self._append(splines, now)

    def stop(self, now: float) -> None:
        """Brake every joint smoothly within the stop time and hold; drops what waited."""
        state = self.sample(now)
        self._append([self._brake(state, now)], now)

    def _spline_from(self, checked: CheckedTrajectory, origin: float, now: float) -> Spline:
        """Absolute times; starts from the reference unless the first point is due at the start."""
        times = origin + checked.times
        start = max(origin, now)
        late = np.searchsorted(times, start + _SAME_TIME, side="right")
        if late > 1 or (late == 1 and times[0] < start - _SAME_TIME):
            # Overdue: go on inside the message's own spline, if the reference is close to it.
            spline = Spline(times, checked.position, checked.velocity, checked.acceleration)
            self._check_jump(spline.sample(start).position, start, self._tick)
            return spline
        if late == 1:
            self._check_jump(checked.position[0], start, self._tick)
            times = times.copy()
            times[0] = start
            return Spline(times, checked.position, checked.velocity, checked.acceleration)
        self._check_jump(checked.position[0], start, max(times[0] - start, self._tick))
        here = self.sample(start)

        def joined(first: Array, rest: Array | None) -> Array | None:
            return None if rest is None else np.vstack([first, rest])

        return Spline(
            np.concatenate([[start], times]),
            np.vstack([here.position, checked.position]),
            joined(here.velocity, checked.velocity),
            joined(here.acceleration, checked.acceleration),
        )

    def _check_jump(self, target: Array, start: float, duration: float) -> None:
        speed = np.abs(target - self.sample(start).position) / duration
        allowed = self.limits.velocity * self._velocity_factor
        if (speed > allowed).any():
            joint = int(np.argmax(speed / allowed))
            raise TrajectoryRefusedError(
                "jump from the reference to the first point, speed [rad/s]",
                self.limits.names[joint], float(speed[joint]), float(allowed[joint]),
            )

    def _with_brake(self, spline: Spline) -> list[Spline]:
        """A last point that still moves is followed by a brake, not by a jolt."""
        end = spline.end_state()
        if np.abs(end.velocity).max() < 1e-6:
            return [spline]
        return [spline, self._brake(end, spline.end)]

    def _brake(self, state: JointState, now: float) -> Spline:
        """As softly as the stop time allows, but harder where that would break a limit."""
        for share in _BRAKES:
            brake = self._brake_within(state, now, share * self._stop_time)
            try:
                check_spline(brake, self.limits, self._velocity_factor)
            except TrajectoryRefusedError:
                continue
            break
        return brake

    def _brake_within(self, state: JointState, now: float, duration: float) -> Spline:
        # With no position asked, velocity falls as a cubic: this is where that ends.
        end = state.position + state.velocity * duration / 2 + state.acceleration * duration**2 / 12
        end = np.clip(
            end,
            np.minimum(self.limits.lower, state.position),
            np.maximum(self.limits.upper, state.position),
        )
        zero = np.zeros_like(end)
        return Spline(
            np.array([now, now + duration]),
            np.vstack([state.position, end]),
            np.vstack([state.velocity, zero]),
            np.vstack([state.acceleration, zero]),
        )

    def _append(self, splines: list[Spline], now: float) -> None:
        start = max(splines[0].start, now)
        kept = [old for old in self._splines if old.start < start - _SAME_TIME]
        # Of those already started only the last one still counts.
        begun = [old for old in kept if old.start <= now]
        self._splines = begun[-1:] + [old for old in kept if old.start > now] + splines
