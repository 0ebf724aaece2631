"""The data that all states of an execution share: plan, thresholds and measurements."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array

from motion_execution.hit.contact import ContactDetector
from motion_execution.hit.speed_of_b import SpeedOfB
from motion_execution.hit.types import (
    AFTER_HIT,
    APPROACH,
    RUN_UP,
    ExecutablePlan,
    Measured,
)
from motion_execution.settings import ExecutionSettings

_RECENT = 30  # number of the last door angles, from which the end of a hold is judged


class DoorAngles:
    """The door's angles that an execution has accepted.

    Attributes:
        angle: Angle that was accepted last [rad]; 0 before the first one.
        recent: Last accepted angles, at most 30, the newest at the end [rad].
    """

    def __init__(self) -> None:
        self.angle = 0.0
        self.recent: deque[float] = deque(maxlen=_RECENT)
        self._stamp = -np.inf

    def accept(self, now: float, angle: float, velocity: float) -> bool:
        """Keep an angle if it is a number and newer than the last accepted angle.

        Args:
            now: Stamp of the angle [s].
            angle: Angle of the door [rad].
            velocity: Angular velocity of the door [rad/s].

        Returns:
            Whether the angle was kept.
        """
        if now <= self._stamp or not np.isfinite([angle, velocity]).all():
            return False
        self._stamp = now
        self.angle = angle
        self.recent.append(angle)
        return True


@dataclass
class Run:
    """The data of an execution that outlive its states.

    Args:
        plan: The plan.
        settings: Thresholds.
        joint_names: Joint names in the order of the knots' columns; may be empty.
        speed: Calculates the speed of point B from joints and gyro.
        detector: Detects the contact.
        approach: Names of the phases up to the first that goes towards the door, `cam` or `probe`.

    Attributes:
        measured: Measurements until now.
        door: Angles of the door that were accepted.
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
    speed: SpeedOfB
    detector: ContactDetector
    approach: tuple[str, ...] = APPROACH
    measured: Measured = field(default_factory=Measured)
    door: DoorAngles = field(default_factory=DoorAngles)
    starts: dict[str, float] = field(default_factory=dict)
    joints_stamp: float = -np.inf
    lag: float = 0.0
    stop_requested: bool = False
    turned_round: bool = False
    later: float = 0.0
    steady: float = field(init=False)

    def __post_init__(self) -> None:
        """Expect the contact as the plan does."""
        self.steady = self.plan.steady_time

    @property
    def planned_contact(self) -> float:
        """Time of the planned contact on the robot's clock [s]; infinite while a probe goes on."""
        return self.starts.get(RUN_UP, np.inf) + self.plan.contact_time

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

    def on_joints(self, now: float, position: Array, velocity: Array, phase: str) -> None:
        """Measure the speed of B with a new joint state.

        Args:
            now: Stamp of the joint state [s].
            position: Joint positions, (J,) [rad].
            velocity: Joint speeds, (J,) [rad/s].
            phase: Name of the present phase.
        """
        self.speed.joints = (now, position, velocity)
        self._measure_speed(phase)

    def on_gyro(self, now: float, rate: Array, phase: str) -> None:
        """Measure the speed of B with a new reading of the gyro.

        Args:
            now: Stamp of the reading [s].
            rate: Angular velocity in the IMU's frame, (3,) [rad/s].
            phase: Name of the present phase.
        """
        self.speed.rate = (now, rate)
        self._measure_speed(phase)

    def _measure_speed(self, phase: str) -> None:
        """Measure the speed of B during the run-up and after the hit.

        The speed before the hit is measured again and again until the contact is detected. The
        speed after the hit is a mean, since B trembles.
        """
        pair = self.speed.now() if phase in (RUN_UP, AFTER_HIT) else None
        if pair is None:
            return
        now, speed = pair
        measured, hit = self.measured, not np.isnan(self.measured.contact_time)
        if not hit and now <= self.planned_contact + self.plan.steady_time:
            measured.v_rb = self.speed.before_contact(speed)
        begin, end = self.settings.after_hit
        if hit and begin <= now - measured.contact_time <= end:
            measured.v_rb_post = self.speed.after_contact(speed)
