"""Runs a plan: what to send to the driver, and when, from what a robot can feel.

A state machine without ROS: it is told joint states and door angles and answers with trajectories.
The motion up to the door's peak goes out as one trajectory, because the switch from the run-up to
the motion after the hit must be right to a millisecond; a door that moves earlier than planned
brings the switch forward. The arm goes out on the door's measured peak.
"""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidRequest
from .knots import Knots
from .post import continue_from
from .splice import concatenate, cut, duration, slowed, without_first

Array = NDArray[np.float64]

APPROACH = ("prepare", "shift", "step", "back", "cam")
SCALED = APPROACH[:-1]  # the run-up and what follows keep their speed
SENT_AT_START = (*APPROACH, "post")


class Outcome(enum.Enum):
    """How an execution ended."""

    RUNNING = "running"
    SUCCESS = "success"
    NO_CONTACT = "no contact"
    STOPPED = "stopped"
    FELL = "fell"


def missing_phases(phases: Collection[str]) -> list[str]:
    """Phases that an execution needs and a plan with the given ones lacks."""
    return [name for name in (*SENT_AT_START, "hold") if name not in phases]


@dataclass(frozen=True)
class Command:
    """A trajectory for the driver.

    Attributes:
        stamp: When its times count from, on the robot's clock [s].
        knots: The trajectory; None means stop.
    """

    stamp: float
    knots: Knots | None


@dataclass(frozen=True)
class ExecutionSettings:
    """Thresholds of the execution.

    Attributes:
        lead: From sending a trajectory to its start [s].
        splice: The same for an early contact [s].
        early: A door that moves so long before the switch is an early contact [s].
        door_moves: Angular velocity of the door that tells of a contact [rad/s].
        late: A door that has not moved so long after the planned contact is missed [s].
        settle: Time after the planned contact at which v'_rB is read [s].
        brake: Duration of coming to rest after an early contact [s].
        peak_drop: Angle below the largest one at which the door has stopped opening [rad].
        fall_tilt: Tilt of the trunk that counts as a fall [rad].
    """

    lead: float = 0.2
    splice: float = 0.005
    early: float = 0.01
    door_moves: float = 0.15
    late: float = 0.3
    settle: float = 0.03
    brake: float = 0.3
    peak_drop: float = 0.0009
    fall_tilt: float = float(np.radians(30.0))


@dataclass(frozen=True)
class ExecutablePlan:
    """What the execution needs of a plan.

    Attributes:
        phases: Knots of each phase by name; those of `cam` go on past the switch.
        contact_time: Planned, from the start of the run-up [s].
        switch_time: From the start of the run-up to that of `post` [s].
        post_ratio: Speed along the path after the hit over that before it.
        point_of_no_return: Later than this before the contact a stop loses balance [s].
    """

    phases: dict[str, Knots]
    contact_time: float
    switch_time: float
    post_ratio: float
    point_of_no_return: float


@dataclass
class Measured:
    """What the execution felt; NaN where it did not get that far.

    Attributes:
        contact_time: When the door was seen to move, on the robot's clock [s].
        contact_delay: The same against the plan [s].
        v_rb: Speed of B before the contact, from the joints [m/s].
        v_rb_post: And after it [m/s].
        omega_door: Largest angular velocity of the door [rad/s].
        peak_angle: Largest angle of the door [rad].
        peak_time: From the contact [s].
        held_angle: Angle of the door at the end [rad].
    """

    contact_time: float = np.nan
    contact_delay: float = np.nan
    v_rb: float = np.nan
    v_rb_post: float = np.nan
    omega_door: float = np.nan
    peak_angle: float = np.nan
    peak_time: float = np.nan
    held_angle: float = np.nan


@dataclass
class Execution:
    """State of one run of a plan.

    Args:
        plan: The plan.
        speed_of_b: Speed of point B towards the door from joint positions and speeds [m/s].
        settings: Thresholds.
        speed_scale: Slows down the phases before the run-up, 0 < speed_scale <= 1.

    Raises:
        InvalidRequest: A scale out of range, or a plan without one of the phases.
    """

    plan: ExecutablePlan
    speed_of_b: Callable[[Array, Array], float]
    settings: ExecutionSettings = field(default_factory=ExecutionSettings)
    speed_scale: float = 1.0

    def __post_init__(self) -> None:
        """Checks the scale and the phases."""
        if not 0.0 < self.speed_scale <= 1.0:
            raise InvalidRequest(
                f"speed_scale {self.speed_scale} is not above 0 and at most 1",
                quantity="speed_scale", value=self.speed_scale, limit=(0.0, 1.0))
        missing = missing_phases(self.plan.phases)
        if missing:
            raise InvalidRequest(f"the plan has no phase {', '.join(missing)}",
                                 quantity="phases", value=", ".join(missing))
        self.outcome = Outcome.RUNNING
        self.phase = APPROACH[0]
        self.measured = Measured()
        self.door_angle = 0.0
        self._starts: dict[str, float] = {}
        self._end = np.inf
        self._speeds: deque[float] = deque(maxlen=6)
        self._held: deque[float] = deque(maxlen=30)
        self._stop_asked = False

    # -- motion -------------------------------------------------------------------------------

    def start(self, now: float) -> Command:
        """Everything up to the door's peak, as one trajectory.

        Args:
            now: The robot's clock [s].
        """
        stamp = at = now + self.settings.lead
        parts = []
        for name in SENT_AT_START:
            knots = self.plan.phases[name]
            if name in SCALED:
                knots = slowed(knots, self.speed_scale)
            elif name == "cam":
                knots = cut(knots, self.plan.switch_time)
            self._starts[name] = at
            at += duration(knots)
            parts.append(knots)
        self._end = at
        return Command(stamp, concatenate(parts))

    @property
    def planned_contact(self) -> float:
        """When the contact is planned, on the robot's clock [s]."""
        return self._starts["cam"] + self.plan.contact_time

    def on_joint_state(self, now: float, position: Array, velocity: Array) -> list[Command]:
        """Takes a joint state and answers with what to send.

        Args:
            now: Stamp of the joint state [s].
            position: (30,) [rad].
            velocity: (30,) [rad/s].
        """
        if self.outcome is not Outcome.RUNNING:
            return []
        if self.phase == "hold":
            if now >= self._end:
                self.measured.held_angle = float(np.mean(self._held))
                self.outcome = Outcome.SUCCESS
            return []
        for name, start in self._starts.items():
            if now >= start:
                self.phase = name
        if self._stop_asked and not self.past_no_return(now):
            self.outcome = Outcome.STOPPED
            return [Command(0.0, None)]
        if self.phase in ("cam", "post"):
            self._watch_b(now, self.speed_of_b(position, velocity))
        touched = not np.isnan(self.measured.contact_time)
        if not touched and now > self.planned_contact + self.settings.late:
            self.outcome = Outcome.NO_CONTACT
        return []

    def _watch_b(self, now: float, speed: float) -> None:
        """Speeds of B around the hit."""
        if self.phase == "cam":
            self._speeds.append(speed)
            self.measured.v_rb = float(np.mean(self._speeds))
        elif now >= self.planned_contact + self.settings.settle and np.isnan(
                self.measured.v_rb_post):
            self.measured.v_rb_post = speed

    # -- door ---------------------------------------------------------------------------------

    def on_door(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Takes an angle of the door and answers with what to send.

        Args:
            now: Stamp of the angle [s].
            angle: [rad].
            velocity: [rad/s].
        """
        self.door_angle = angle
        self._held.append(angle)
        if self.outcome is not Outcome.RUNNING or self.phase not in ("cam", "post"):
            return []
        if np.isnan(self.measured.contact_time):
            return self._contact(now) if velocity > self.settings.door_moves else []
        return self._follow_opening(now, angle, velocity)

    def _contact(self, now: float) -> list[Command]:
        """The door moves: as planned, or so early that the robot must not push on."""
        self.measured.contact_time = now
        self.measured.contact_delay = now - self.planned_contact
        if now > self._starts["post"] - self.settings.early:
            return []
        self.phase = "post"
        stamp = now + self.settings.splice
        path_time = float(np.clip(stamp - self._starts["cam"], 0.0, self.plan.switch_time))
        knots = continue_from(self.plan.phases["cam"], path_time, self.plan.post_ratio,
                              self.settings.brake)
        self._starts["post"] = stamp
        self._end = stamp + duration(knots)
        return [Command(stamp, knots)]

    def _follow_opening(self, now: float, angle: float, velocity: float) -> list[Command]:
        """Waits for the door's peak; then the arm goes out."""
        measured = self.measured
        measured.omega_door = float(np.fmax(measured.omega_door, velocity))
        if not measured.peak_angle >= angle:
            measured.peak_angle, measured.peak_time = angle, now - measured.contact_time
        if measured.peak_angle - angle < self.settings.peak_drop:
            return []
        self.phase = "hold"
        hold = without_first(self.plan.phases["hold"])  # the driver starts from where it is
        self._starts["hold"] = now
        self._end = now + self.settings.lead + float(hold.time[-1])
        return [Command(now, hold)]

    # -- stop ---------------------------------------------------------------------------------

    def past_no_return(self, now: float) -> bool:
        """Whether a stop would lose balance, so that the hit must be completed."""
        if now < self._starts.get("cam", np.inf):
            return False
        return now > self.planned_contact - self.plan.point_of_no_return

    def stop(self) -> None:
        """Asks for a stop: at the next joint state, unless the hit must be completed."""
        self._stop_asked = True

    def on_tilt(self, tilt: float) -> list[Command]:
        """Takes the trunk's tilt [rad] and stops where the robot falls."""
        if self.outcome is Outcome.RUNNING and tilt > self.settings.fall_tilt:
            self.outcome = Outcome.FELL
            return [Command(0.0, None)]
        return []

    # -- progress -----------------------------------------------------------------------------

    def progress(self, now: float) -> float:
        """Share of the phase that has passed, 0 to 1."""
        start = self._starts.get(self.phase, now)
        later = [time for time in self._starts.values() if time > start]
        end = min(later, default=self._end)
        return float(np.clip((now - start) / max(end - start, 1e-9), 0.0, 1.0))
