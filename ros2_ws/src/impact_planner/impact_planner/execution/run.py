"""What all states of an execution share: the plan, the thresholds and what was measured."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from door_impact_common.arrays import Array

from impact_planner.execution.speed_of_b import SpeedOfB
from impact_planner.execution.types import (
    AFTER_HIT,
    APPROACH,
    RUN_UP,
    ExecutablePlan,
    ExecutionSettings,
    Measured,
)

_RECENT = 30  # number of door angles from which the end of a hold is judged


class DoorAngles:
    """The door's angles that an execution has accepted.

    Attributes:
        angle: Angle that was accepted last [rad]; 0 before the first one.
        recent: Last angles, the newest at the end [rad].
    """

    def __init__(self) -> None:
        self.angle = 0.0
        self.recent: deque[float] = deque(maxlen=_RECENT)
        self._stamp = -np.inf

    def accept(self, now: float, angle: float, velocity: float) -> bool:
        """Keep an angle if it is newer than the last one and a number.

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
    """The part of an execution that outlives each state.

    Args:
        plan: The plan.
        settings: Thresholds.
        joint_names: Joint names in the order of the knots' columns; may be empty.
        speed: Speed of point B from joints and gyro.

    Attributes:
        measured: What was measured until now.
        door: Angles of the door that were accepted.
        starts: When each phase began or will begin, by its name, on the robot's clock [s]. It is
            empty before the start.
        joints_stamp: Stamp of the last joint state [s].
        stop_requested: Whether a stop was requested that no state has acted on yet.
        turned_round: Whether the door's peak was detected.
    """

    plan: ExecutablePlan
    settings: ExecutionSettings
    joint_names: Sequence[str]
    speed: SpeedOfB
    measured: Measured = field(default_factory=Measured)
    door: DoorAngles = field(default_factory=DoorAngles)
    starts: dict[str, float] = field(default_factory=dict)
    joints_stamp: float = -np.inf
    stop_requested: bool = False
    turned_round: bool = False

    @property
    def planned_contact(self) -> float:
        """Time of the planned contact on the robot's clock [s]."""
        return self.starts[RUN_UP] + self.plan.contact_time

    def phase_at(self, now: float, phase: str) -> str:
        """The phase up to the run-up that the clock is in; `phase` before the first one begins."""
        begun = [name for name in APPROACH if now >= self.starts[name]]
        return begun[-1] if begun else phase

    def past_no_return(self, now: float) -> bool:
        """Whether a stop at this time would lose balance, from shortly before the contact on."""
        if now < self.starts.get(RUN_UP, np.inf):
            return False
        return now > self.planned_contact - self.plan.point_of_no_return

    def on_joints(self, now: float, position: Array, velocity: Array, phase: str) -> None:
        """Keep a joint state, (30,) [rad] and (30,) [rad/s], and measure the speed of B."""
        self.speed.joints = (now, position, velocity)
        self._measure_speed(phase)

    def on_gyro(self, now: float, rate: Array, phase: str) -> None:
        """Keep an angular velocity of the IMU, (3,) [rad/s], and measure the speed of B."""
        self.speed.rate = (now, rate)
        self._measure_speed(phase)

    def _measure_speed(self, phase: str) -> None:
        """Measure the speed of B before and after the hit.

        The speed before the hit is measured until the contact is detected, the one after the hit
        once, when the contact is over.
        """
        pair = self.speed.now() if phase in (RUN_UP, AFTER_HIT) else None
        if pair is None:
            return
        now, speed = pair
        measured, hit = self.measured, not np.isnan(self.measured.contact_time)
        if not hit and now <= self.planned_contact + self.plan.steady_time:
            measured.v_rb = self.speed.before_contact(speed)
        elif hit and np.isnan(measured.v_rb_post) and (
                now >= measured.contact_time + self.settings.settle):
            measured.v_rb_post = speed
