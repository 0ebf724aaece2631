"""The plan, the thresholds, the commands and the measurements of an execution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from humanoid_motion.knots import Knots
from impact_planner.errors import InvalidRequest
from impact_planner.task.settings import ENDINGS

RUN_UP, AFTER_HIT = "cam", "post"
PROBE = "probe"  # phase before the run-up in which the leaf is touched; it is not of the plan
APPROACH = ("prepare", "shift", "step", "back", RUN_UP)
SCALED = APPROACH[:-1]  # phases that speed_scale slows down; the run-up keeps its speed
PLANNED = (*APPROACH, AFTER_HIT)


_LONGEST = 5.0  # longest time of a plan's contact, stop or rest; the planner's are below 2 s
_FASTEST = 2.0  # largest speed of the CoM of a plan [m/s]; the planner's are below 0.5 m/s
_RANGES = {  # least and largest plausible number of a plan, in its own unit
    "contact_time": (0.05, _LONGEST),  # a run-up takes time
    "steady_time": (0.0, _LONGEST),
    "switch_delay": (0.0, 0.2),
    "slow_down": (0.0, 0.5),
    "rest_duration": (0.05, _LONGEST),
    "post_ratio": (-1.0, 1.0),
    "point_of_no_return": (0.0, _LONGEST),
    "desired_angle": (0.0, np.pi),
    "stop_duration": (0.05, _LONGEST),
}


@dataclass(frozen=True)
class ExecutablePlan:
    """The part of a plan that an execution needs.

    Attributes:
        phases: Knots of each phase by its name. Those of `cam` continue past the contact and come
            to rest. A plan with a hold may also have a retreat, in which a stop past the point of
            no return ends.
        contact_time: Time from the start of the run-up to the planned contact [s].
        steady_time: Time before and after the planned contact during which the run-up has its full
            speed [s].
        switch_delay: Time after the begin of the contact during which the legs keep their speed
            [s].
        slow_down: Time in which the legs then change to the speed after the hit [s].
        rest_duration: Time from the end of `slow_down` to rest [s].
        post_ratio: Ratio of the speed along the path after the hit to the speed before it.
        point_of_no_return: Time before the planned contact after which a stop loses balance [s].
        desired_angle: Largest angle that the door is to reach [rad].
        held_angle: Angle at which it is to be held then [rad]; NaN: it is not.
        stop_duration: Time in which a stop slows the run-up down to rest [s].

    Raises:
        InvalidRequest: A phase is missing, or a number is out of its range.
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
    held_angle: float
    stop_duration: float

    @classmethod
    def of(cls, plan: Any, phases: dict[str, Knots]) -> ExecutablePlan:
        """Make it from a plan or the plan's message, which share their names.

        Args:
            plan: The plan or its message.
            phases: Knots of the plan's phases and branches by name.

        Raises:
            InvalidRequest: A phase is missing, or a number is out of its range.
        """
        if not 0.0 < plan.v_com <= _FASTEST:
            raise InvalidRequest(
                f"v_com of the plan is {plan.v_com:g} m/s, must be above 0 and at most "
                f"{_FASTEST:g} m/s", quantity="v_com [m/s]", value=plan.v_com, limit=_FASTEST)
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
            held_angle=plan.held_angle,
            stop_duration=plan.stop_duration,
        )

    def __post_init__(self) -> None:
        """Check the phases and every number: a plan's message may come from anywhere."""
        missing = [name for name in PLANNED if name not in self.phases]
        if not set(ENDINGS) & set(self.phases):
            missing.append(" or ".join(ENDINGS))
        if missing:
            raise InvalidRequest(f"the plan has no phase {', '.join(missing)}",
                                 quantity="phases", value=", ".join(missing))
        run_up = float(self.phases[RUN_UP].time[-1])
        ranges = dict(_RANGES)
        for name in ("contact_time", "point_of_no_return", "switch_time"):  # within the run-up
            least, most = ranges.get(name, (0.0, run_up))
            ranges[name] = least, min(most, run_up)
        if "hold" in self.phases:
            ranges["held_angle"] = _RANGES["desired_angle"]
        for name, (least, most) in ranges.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise InvalidRequest(
                    f"{name} of the plan is {value:g}, must be from {least:g} to {most:g}",
                    quantity=name, value=value, limit=(least, most))

    @property
    def ending(self) -> str:
        """Name of the phase that follows the door's peak."""
        return next(name for name in ENDINGS if name in self.phases)

    @property
    def switch_time(self) -> float:
        """Time from the start of the run-up to the start of `post` at the planned contact [s]."""
        return self.contact_time + self.switch_delay


@dataclass
class Measured:
    """Measurements of an execution; NaN for those that it did not reach.

    Attributes:
        contact_sensor: What showed the contact: imu, feet or door; empty without a contact.
        contact_time: Begin of the contact as this sensor showed it, on the robot's clock [s].
        contact_delay: Time from the planned contact to the begin of the contact [s].
        switch_latency: Time from the begin of the contact to the switch to the motion after the
            hit [s].
        v_rb: Speed of B towards the door before the contact, from joints and gyro [m/s].
        v_rb_post: Speed of B towards the door after the contact, from joints and gyro [m/s].
        omega_door: Largest angular velocity of the door [rad/s].
        peak_angle: Largest angle of the door [rad].
        peak_time: Time from the begin of the contact to the door's peak [s].
        held_angle: Angle of the door at the end of a hold [rad].
        leaf_off: Distance by which the probe found the leaf farther away than planned [m].
    """

    contact_sensor: str = ""
    contact_time: float = np.nan
    contact_delay: float = np.nan
    switch_latency: float = np.nan
    v_rb: float = np.nan
    v_rb_post: float = np.nan
    omega_door: float = np.nan
    peak_angle: float = np.nan
    peak_time: float = np.nan
    held_angle: float = np.nan
    leaf_off: float = np.nan
