"""What an execution is made of: its plan, its thresholds, what it sends and what it measures."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots

from impact_planner.errors import InvalidRequest
from impact_planner.task.settings import ENDINGS

RUN_UP, AFTER_HIT = "cam", "post"
APPROACH = ("prepare", "shift", "step", "back", RUN_UP)
SCALED = APPROACH[:-1]  # the run-up keeps its speed
PLANNED = (*APPROACH, AFTER_HIT)

MISSED = ("no contact: neither feet nor door told of one until the run-up had come to rest; the "
          "door stands farther than planned or is open")


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
        splice: The same for a stop, or for a contact that was felt late [s].
        judged_after: From the last point of the hold to its judgement [s].
        felt_force: Force of the floor on the feet towards the door that tells of a contact [N].
        felt_after: From the contact's begin to the stamp of the wrenches that tell of it: a mean
            over a tick passes `felt_force` 2 to 7 ms after the begin [s].
        door_moves: Angular velocity of the door that tells of a contact that was not felt [rad/s].
        late: A door that has not moved so long after the end of the run-up is missed [s].
        settle: Time after the contact's begin at which v'_rB is read [s].
        peak_drop: Angle below the largest one at which the door has stopped opening [rad].
        back_to_plan: In which a retreat from a door that stood elsewhere is as planned again [s].
        fall_tilt: Tilt of the trunk that counts as a fall [rad].
        tracking: A joint further than this from its reference does not follow [rad].
        hold_within: A door whose peak is further from the desired angle is not caught [rad].
        slower: Multiple of the planned time in which the door must be seen to turn round.
        stale: An angle of the door whose stamp is further from the joints' is passed over [s].
        held_within: A door further than this from the desired angle is not held [rad].
    """

    lead: float = 0.5
    splice: float = 0.005
    judged_after: float = 0.2
    felt_force: float = 80.0
    felt_after: float = 0.0045
    door_moves: float = 0.15
    late: float = 0.1
    settle: float = 0.02
    peak_drop: float = 0.0009
    back_to_plan: float = 0.6
    fall_tilt: float = float(np.radians(30.0))
    tracking: float = 0.1
    hold_within: float = float(np.radians(6.0))
    slower: float = 3.0
    stale: float = 2.0
    held_within: float = float(np.radians(2.0))

    def __post_init__(self) -> None:
        """Checks what is a parameter of the node.

        Raises:
            InvalidRequest: A force out of range.
        """
        if not 0.0 < self.felt_force < np.inf:
            raise InvalidRequest(f"felt_force must be above 0 N, not {self.felt_force:g}",
                                 quantity="felt_force [N]", value=self.felt_force, limit=0.0)


@dataclass(frozen=True)
class ExecutablePlan:
    """What the execution needs of a plan.

    Attributes:
        phases: Knots of each phase by name; those of `cam` go on past the contact, to rest. With a
            hold, a retreat is what a cancel past the point of no return ends in.
        contact_time: Planned, from the start of the run-up [s].
        steady_time: So long before that the run-up has its full speed at least [s].
        switch_delay: So long after the contact's begin the legs keep their speed [s].
        slow_down: In which they then take up the speed after the hit [s].
        rest_duration: From there to rest [s].
        post_ratio: Speed along the path after the hit over that before it.
        point_of_no_return: Later than this before the contact a stop loses balance [s].
        desired_angle: That the door is to be held at [rad].
        stop_duration: In which a stop slows the run-up down to rest [s].

    Raises:
        InvalidRequest: One of the phases is missing.
    """

    phases: dict[str, Knots]
    contact_time: float
    steady_time: float
    switch_delay: float
    slow_down: float
    rest_duration: float
    post_ratio: float
    point_of_no_return: float
    desired_angle: float
    stop_duration: float

    @classmethod
    def of(cls, plan: Any, phases: dict[str, Knots]) -> ExecutablePlan:
        """From a plan or its message, which have the same names, and its phases' knots."""
        return cls(
            phases=phases,
            contact_time=plan.contact_time,
            steady_time=0.5 * plan.steady_way / plan.v_com,
            switch_delay=plan.switch_time - plan.contact_time,
            slow_down=plan.slow_down,
            rest_duration=plan.rest_duration,
            post_ratio=plan.v_com_post / plan.v_com,
            point_of_no_return=plan.point_of_no_return,
            desired_angle=plan.desired_opening_angle,
            stop_duration=plan.stop_duration,
        )

    def __post_init__(self) -> None:
        """Checks the phases."""
        missing = [name for name in PLANNED if name not in self.phases]
        if not set(ENDINGS) & set(self.phases):
            missing.append(" or ".join(ENDINGS))
        if missing:
            raise InvalidRequest(f"the plan has no phase {', '.join(missing)}",
                                 quantity="phases", value=", ".join(missing))

    @property
    def ending(self) -> str:
        """Name of the phase that follows the door's peak."""
        return next(name for name in ENDINGS if name in self.phases)

    @property
    def switch_time(self) -> float:
        """From the start of the run-up to that of `post` at the planned contact [s]."""
        return self.contact_time + self.switch_delay


@dataclass
class Measured:
    """What the execution felt; NaN where it did not get that far.

    Attributes:
        contact_time: When the contact began, as the feet or the door told, on the robot's clock
            [s].
        contact_delay: The same against the plan [s].
        switch_latency: From there to the switch to the motion after the hit [s].
        v_rb: Speed of B before the contact, from joints and gyro [m/s].
        v_rb_post: And after it [m/s].
        omega_door: Largest angular velocity of the door [rad/s].
        peak_angle: Largest angle of the door [rad].
        peak_time: From the contact [s].
        held_angle: Angle of the door at the end [rad].
    """

    contact_time: float = np.nan
    contact_delay: float = np.nan
    switch_latency: float = np.nan
    v_rb: float = np.nan
    v_rb_post: float = np.nan
    omega_door: float = np.nan
    peak_angle: float = np.nan
    peak_time: float = np.nan
    held_angle: float = np.nan


def held_verdict(
    angles: Sequence[float], desired: float, within: float
) -> tuple[Outcome, str]:
    """Whether a door stands still near an angle, and what is said where it does not.

    Args:
        angles: The last ones heard [rad].
        desired: [rad].
        within: So far it may be off, and move [rad].
    """
    held, spread = float(np.mean(angles)), float(np.ptp(angles))
    if max(abs(held - desired), spread) <= within:
        return Outcome.SUCCESS, ""
    return Outcome.NOT_HELD, (
        f"the door is not held: it stands at {np.degrees(held):.1f} deg and moved by "
        f"{np.degrees(spread):.1f} deg in the end, {np.degrees(desired):.1f} deg were desired, "
        f"{np.degrees(within):.1f} deg off or moved are allowed")


def too_far_off(peak: float, desired: float) -> str:
    """What is said of a door that is not caught, for angles [rad]."""
    return (f"the door opened to {np.degrees(peak):.1f} deg, {np.degrees(desired):.1f} deg were "
            "desired: too far off for the arm to meet it as planned")


def off_track(
    position: Array, wanted: Array, names: Sequence[str], limit: float, where: str
) -> str:
    """What is said of a robot that does not follow; empty where it does.

    Args:
        position: Of the joints, (J,) [rad].
        wanted: Where they are to be, (J,) [rad].
        names: Of the joints; may be empty.
        limit: So far a joint may be off [rad].
        where: What put them there.
    """
    off = np.abs(position - wanted)
    worst = int(np.argmax(off))
    if off[worst] <= limit:
        return ""
    name = names[worst] if names else f"joint {worst}"
    return (f"{name} is {off[worst]:.3f} rad from where {where}, more than {limit:g} rad; the "
            "driver refused the trajectory or cannot follow it")
