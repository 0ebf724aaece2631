"""The data that all states of an execution share: plan, thresholds and measurements."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion import samples

from motion_execution.hit.contact import ContactDetector
from motion_execution.hit.types import (
    AFTER_HIT,
    APPROACH,
    RUN_UP,
    ExecutablePlan,
    Measured,
)
from motion_execution.settings import ExecutionSettings

_RECENT = 30  # number of the last door angles, from which the end of a hold is judged
_KEPT = 8  # number of speeds before the contact from which the mean is taken, with
_IN_CONTACT = 2  # number of the newest of them, which may already be measured in the contact


@dataclass
class Run:
    """The data of an execution that outlive its states.

    Args:
        plan: The plan.
        settings: Thresholds.
        joint_names: Joint names in the order of the knots' columns; may be empty.
        speed: Function that returns the speed of point B [m/s] from joint positions (J,) [rad],
            joint speeds (J,) [rad/s] and the IMU's angular velocity (3,) [rad/s].
        detector: Detects the contact.
        approach: Names of the phases up to the first that goes towards the door, `cam` or `probe`.

    Attributes:
        measured: Measurements until now.
        door_angles: Last angles of the door, at most 30, the newest at the end [rad].
        starts: Times at which the phases began or will begin, by their names, on the robot's clock
            [s]; empty before the start.
        joints_stamp: Stamp of the last joint state [s].
        lag: Time by which the present event lags behind the present [s].
        stop_requested: Whether a stop was requested on which no state has acted yet.
        turned_round: Whether the door's peak was detected.
        later: Time after the planned contact at which the leaf is expected: a probe may find it
            farther away [s].
        steady: Time before and after that in which a contact is expected [s].
    """

    plan: ExecutablePlan
    settings: ExecutionSettings
    joint_names: Sequence[str]
    speed: Callable[[Array, Array, Array], float]
    detector: ContactDetector
    approach: tuple[str, ...] = APPROACH
    measured: Measured = field(default_factory=Measured)
    door_angles: deque[float] = field(default_factory=lambda: deque(maxlen=_RECENT))
    starts: dict[str, float] = field(default_factory=dict)
    joints_stamp: float = -np.inf
    lag: float = 0.0
    stop_requested: bool = False
    turned_round: bool = False
    later: float = 0.0
    steady: float = field(init=False)
    _before: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _after: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Expect the contact as the plan does."""
        self.steady = self.plan.steady_time

    @property
    def planned_contact(self) -> float:
        """Time of the planned contact on the robot's clock [s]; infinite while a probe goes on."""
        return self.starts.get(RUN_UP, np.inf) + self.plan.contact_time

    @property
    def door_angle(self) -> float:
        """Last angle of the door [rad]; 0 before the first one."""
        return self.door_angles[-1] if self.door_angles else 0.0

    def present(self, now: float) -> float:
        """Time on the robot's clock at which an event with the stamp `now` is handled [s]."""
        return max(now, self.joints_stamp) + self.lag

    def phase_at(self, now: float, phase: str) -> str:
        """Name of the phase at a time before the contact.

        Args:
            now: Time of the robot's clock [s].
            phase: Name that is returned if no phase has begun.
        """
        begun = [name for name in self.approach if now >= self.starts[name]]
        return begun[-1] if begun else phase

    def past_no_return(self, now: float) -> bool:
        """Whether the point of no return, shortly before the planned contact, has passed.

        Args:
            now: Time of the robot's clock [s].
        """
        if now < self.starts.get(RUN_UP, np.inf):
            return False
        return now > self.planned_contact - self.plan.point_of_no_return

    def on_measured(self, now: float, sample: samples.Measured, phase: str) -> None:
        """Measure the speed of B in the run-up, until the contact is detected, and after the hit.

        B trembles after the hit, so that speed is a mean. The newest speeds are left out of the
        mean before it, since the contact may have begun already.

        Args:
            now: Stamp of the sample [s].
            sample: What was measured.
            phase: Name of the present phase.
        """
        if phase not in (RUN_UP, AFTER_HIT):
            return
        speed = self.speed(sample.position, sample.velocity, sample.imu.angular_velocity)
        measured, hit = self.measured, not np.isnan(self.measured.contact_time)
        if not hit and now <= self.planned_contact + self.plan.steady_time:
            self._before.append(speed)
            before = list(self._before)
            measured.v_rb = float(np.mean(before[:-_IN_CONTACT] or before))
        begin, end = self.settings.after_hit
        if hit and begin <= now - measured.contact_time <= end:
            self._after.append(speed)
            measured.v_rb_post = float(np.mean(self._after))
