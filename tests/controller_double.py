"""A double of ros2_control's JointTrajectoryController, with its rules instead of ours.

J is joint_trajectory_controller.cpp, T is trajectory.cpp of ros2_controllers 4.42 (jazzy), with the
parameters of docs/hardware.md. It takes the place of the driver's reference in a simulated world:
the joints move from each command to the next one, without delay.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from humanoid_motion.driver_interface import TrajectoryArrays
from humanoid_motion.spline import JointReference, Spline
from robot_driver.trajectory_checks import JointLimits

PERIOD = 0.005
EPSILON = 1.1920929e-7  # std::numeric_limits<float>::epsilon()


@dataclass
class Message:
    """A trajectory as the controller keeps it: in its own order of joints, with what it has."""

    stamp: float
    times: np.ndarray
    levels: list[np.ndarray]  # positions, then velocities and accelerations where there are any
    before: tuple[float, JointReference] | None = None  # T: the point before the message


class ControllerDouble:
    """The controller as a driver of a simulated world, which calls `positions` once a cycle.

    Attributes:
        rejected: Why trajectories were refused: no publisher is told, a goal's client is.
        results: How goals have ended that are over: code and words.
        steps: Largest change of a command in a cycle, by joint [rad].
    """

    def __init__(self, limits: JointLimits, position: np.ndarray) -> None:
        self.limits = limits
        self.reset(position)

    def reset(self, position: np.ndarray, now: float = 0.0) -> None:
        """Activate it: it holds the measured positions (J1254)."""
        self.rejected: list[str] = []
        self.results: list[tuple[int, str]] = []
        self.steps = np.zeros(len(self.limits.names))
        self._goal = False
        self._new: Message | None = None
        rest = np.array(position, dtype=float)
        still = JointReference(rest, np.zeros_like(rest), np.zeros_like(rest))
        self._now: Message | None = Message(now, np.zeros(1), [rest[None]], (now, still))
        self._last = now, still  # last_commanded_time_ and last_commanded_state_
        self._cycle = -math.inf
        self._commands = rest, rest  # of the last two cycles

    # -- what it is sent ------------------------------------------------------------------------

    def accept(self, message: TrajectoryArrays, stamp: float, now: float) -> None:
        """Take a trajectory of the topic: the next cycle begins with it (J1484)."""
        why = self._invalid(message, stamp, now)
        if why:
            self.rejected.append(why)
            return
        order = [list(message.joint_names).index(name) for name in self.limits.names]
        levels = [np.array(rows, dtype=float)[:, order] for rows in (
            message.positions, message.velocities, message.accelerations) if any(map(len, rows))]
        if not any(map(len, message.velocities)) and any(map(len, message.accelerations)):
            levels = [np.zeros_like(levels[0])]  # T315-365: commands 0 rad
        self._new = Message(stamp, np.array(message.times, dtype=float), levels)

    def send_goal(self, message: TrajectoryArrays, stamp: float, now: float) -> bool:
        """Take a goal of the action; one under way is aborted (J2119). Return if it is accepted."""
        before = len(self.rejected)
        self.accept(message, stamp, now)
        if len(self.rejected) > before:
            return False
        if self._goal:
            self.results.append((-1, "Current goal preempted by new incoming action."))
        self._goal = True
        return True

    def cancel(self, measured: np.ndarray) -> None:
        """Cancel the goal: it holds the measured positions from the next cycle on (J1552)."""
        self._goal = False
        self._new = Message(0.0, np.zeros(1), [np.array(measured)[None]])

    def stop(self, now: float) -> None:
        """Hold the last command; a fallen robot's hardware does that."""
        self.reset(self._commands[1], now)

    def _invalid(self, message: TrajectoryArrays, stamp: float, now: float) -> str:
        """Why a trajectory is refused (J1666-1816); limits, jumps and NaN are no reason."""
        names = list(message.joint_names)
        if len(names) != len(self.limits.names):
            return "Joints on incoming trajectory don't match the controller joints."
        if message.is_stop:
            return "Empty trajectory received."
        if set(names) - set(self.limits.names):
            return "Incoming joint doesn't match the controller's joints."
        if any(map(len, message.velocities)) and max(map(abs, message.velocities[-1])) > EPSILON:
            return "Velocity of last trajectory point is not zero"
        if stamp != 0.0 and stamp + message.times[-1] < now:
            return "Received trajectory with non-zero start time that ends in the past"
        if (np.diff(message.times) <= 0.0).any():
            return "Time between points is not strictly increasing"
        rows = [*message.positions, *filter(len, message.velocities),
                *filter(len, message.accelerations)]
        return "" if all(len(row) == len(names) for row in rows) else "Mismatch"

    # -- what it commands -----------------------------------------------------------------------

    def positions(self, times: np.ndarray) -> np.ndarray:
        """Positions of the joints within a cycle, (T, J): they move to the cycle's command."""
        begin = float(times[0])
        if begin > self._cycle + 0.5 * PERIOD:
            self._update(begin)
        share = np.clip((times - self._cycle) / PERIOD, 0.0, 1.0)[:, None]
        return (1.0 - share) * self._commands[0] + share * self._commands[1]

    def sample(self, time: float) -> JointReference:
        """The state that it would command for a time."""
        assert self._now is not None
        return self._at(self._now, max(time, self._last[0]))

    def is_moving(self, time: float) -> bool:
        """Whether its trajectory has not ended."""
        return self._now is not None and time < self._now.stamp + self._now.times[-1]

    def _update(self, time: float) -> None:
        self._cycle = time
        if self._new is not None:
            self._now, self._new = self._new, None  # J277: the old motion is forgotten
            self._now.before = self._last           # interpolate_from_desired_state (J313)
            self._now.stamp = self._now.stamp or time  # T126
        command = self._at(self._now, time + PERIOD)
        self._last = time, command  # J452: the label is this cycle's time, the state the next one's
        self._commands = self._commands[1], command.position
        self.steps = np.fmax(self.steps, np.abs(self._commands[1] - self._commands[0]))

    @staticmethod
    def _at(message: Any, time: float) -> JointReference:
        """T: sample the trajectory, between the point before it, its points, and after its end."""
        times, levels = message.stamp + message.times, message.levels
        last = int(np.searchsorted(times, time, side="right"))
        if last == len(times):
            still = np.zeros_like(levels[0][-1])
            return JointReference(levels[0][-1], still, still)
        if last == 0:
            begin, state = message.before
            first = (state.position, state.velocity, state.acceleration)
            ends = [np.array([one, rows[0]]) for one, rows in zip(first, levels, strict=False)]
            return Spline(np.array([begin, times[0]]), *ends).sample(time)
        return Spline(times[last - 1:last + 1], *(rows[last - 1:last + 1] for rows in levels)
                      ).sample(time)
