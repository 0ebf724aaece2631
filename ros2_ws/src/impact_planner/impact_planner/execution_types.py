"""What an execution is made of: its plan, its thresholds, what it sends and what it measures."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from .errors import InvalidRequest
from .knots import Knots
from .plan_types import ENDINGS

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
    NOT_FOLLOWED = "not followed"
    NOT_HELD = "not held"


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
        lead: From sending the whole motion to its start; a loaded machine takes its time [s].
        splice: The same for an early contact [s].
        judged_after: From the last point of the hold to its judgement [s].
        early: A door that moves so long before the switch is an early contact [s].
        door_moves: Angular velocity of the door that tells of a contact [rad/s].
        late: A door that has not moved so long after the planned contact is missed [s].
        settle: Time after the planned contact at which v'_rB is read [s].
        brake: Duration of coming to rest after an early contact [s].
        peak_drop: Angle below the largest one at which the door has stopped opening [rad].
        fall_tilt: Tilt of the trunk that counts as a fall [rad].
        tracking: A joint further than this from its reference does not follow [rad].
        held_within: A door further than this from the desired angle is not held [rad].
    """

    lead: float = 0.5
    splice: float = 0.005
    judged_after: float = 0.2
    early: float = 0.01
    door_moves: float = 0.15
    late: float = 0.3
    settle: float = 0.03
    brake: float = 0.3
    peak_drop: float = 0.0009
    fall_tilt: float = float(np.radians(30.0))
    tracking: float = 0.1
    held_within: float = float(np.radians(5.0))


@dataclass(frozen=True)
class ExecutablePlan:
    """What the execution needs of a plan.

    Attributes:
        phases: Knots of each phase by name; those of `cam` go on past the switch. With a hold, a
            retreat is what a cancel past the point of no return ends in.
        contact_time: Planned, from the start of the run-up [s].
        switch_time: From the start of the run-up to that of `post` [s].
        post_ratio: Speed along the path after the hit over that before it.
        point_of_no_return: Later than this before the contact a stop loses balance [s].
        desired_angle: That the door is to be held at [rad].
        stop_duration: In which a stop slows the run-up down to rest [s].

    Raises:
        InvalidRequest: One of the phases is missing.
    """

    phases: dict[str, Knots]
    contact_time: float
    switch_time: float
    post_ratio: float
    point_of_no_return: float
    desired_angle: float
    stop_duration: float

    def __post_init__(self) -> None:
        """Checks the phases."""
        missing = [name for name in SENT_AT_START if name not in self.phases]
        if not set(ENDINGS) & set(self.phases):
            missing.append(" or ".join(ENDINGS))
        if missing:
            raise InvalidRequest(f"the plan has no phase {', '.join(missing)}",
                                 quantity="phases", value=", ".join(missing))

    @property
    def ending(self) -> str:
        """Name of the phase that follows the door's peak."""
        return next(name for name in ENDINGS if name in self.phases)


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
