"""What is asked for: the request for a plan, checked and completed, and with it the task."""

from __future__ import annotations

import math
from dataclasses import dataclass

from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import InvalidRequest
from impact_planner.task.experience import Experience
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import ENDINGS, RUN_UPS, PlannerSettings


@dataclass(frozen=True)
class PlanRequest:
    """A request; None stands for the learned or configured value.

    Attributes:
        desired_opening_angle: Largest opening angle that the door is to reach [rad].
        initial_angle: Opening angle of the door at the hit [rad].
        restitution: Coefficient of restitution of the leaf's surface, 0 (plastic) to 1. Together
            with `effective_mass` it is that of the hit as a whole: eqs. (2) to (4) then use both
            numbers in place of the model's.
        effective_mass: Effective mass of the robot at B, in place of the model's [kg].
        door_distance: Distance from the origin of odom to the closed leaf's face [m].
        l_b: Distance from the hinge to B along the leaf [m]; None means that the configured place
            of the hinge decides.
        run_up: Time law of the run-up, a member of `RUN_UPS`.
        ending: Last phase of the motion, a member of `ENDINGS`.
    """

    desired_opening_angle: float
    initial_angle: float | None = None
    restitution: float | None = None
    effective_mass: float | None = None
    door_distance: float | None = None
    l_b: float | None = None
    run_up: str | None = None
    ending: str | None = None


@dataclass(frozen=True)
class ResolvedRequest:
    """A checked request with defaults filled in; fields without a comment are `PlanRequest`'s.

    Attributes:
        angle: Largest opening angle that the door is to reach [rad].
        initial_angle: Opening angle of the door at the hit [rad].
        restitution: Coefficient of restitution of the leaf's surface.
        apparent_restitution: Coefficient of restitution of the hit as a whole; None means that the
            model decides, as it does for the effective mass [kg].
        mass_factor: Learned factor on the model's effective mass.
        door_distance: Distance from the origin of odom to the closed leaf's face [m]; None means
            that the door stands where the step ends.
        l_b: Distance from the hinge to B [m]; None means that the place of the hinge decides.
    """

    angle: float
    initial_angle: float
    restitution: float
    apparent_restitution: float | None
    effective_mass: float | None
    mass_factor: float
    door_distance: float | None
    l_b: float | None
    run_up: str
    ending: str


@dataclass(frozen=True)
class Task:
    """What a plan is made from."""

    robot: RobotModel
    known: KnownDoor
    wanted: ResolvedRequest
    settings: PlannerSettings


def resolve(
    request: PlanRequest, settings: PlannerSettings, known: KnownDoor
) -> ResolvedRequest:
    """Fill in a request from experience and settings, in this order, and check every value.

    Raises:
        InvalidRequest: A number is not finite or outside its range, or a word is unknown.
    """
    angle = _number("desired_opening_angle [rad]", request.desired_opening_angle)
    if angle > math.pi:
        # Fewer degrees than 5 are no opening that somebody would ask for.
        hint = f"; {angle:g} deg would be {math.radians(angle):.4g} rad" * (5.0 <= angle <= 180.0)
        raise InvalidRequest(
            f"desired_opening_angle is {angle:.4g} rad, which is {math.degrees(angle):.0f} deg, "
            f"must be at most {math.pi:.4g} rad{hint}",
            quantity="desired_opening_angle [rad]", value=angle, limit=math.pi)
    initial, learned = request.initial_angle, known.experience or Experience.none(
        settings.restitution)
    restitution = learned.restitution if request.restitution is None else request.restitution
    both = request.restitution is not None and request.effective_mass is not None
    return ResolvedRequest(
        angle=angle,
        initial_angle=_number(
            "initial_angle [rad]", settings.initial_angle if initial is None else initial,
            below=angle, zero=True),
        restitution=_number("restitution", restitution, most=1.0, zero=True),
        apparent_restitution=restitution if both else None,
        effective_mass=_optional(
            "effective_mass [kg]", request.effective_mass, settings.effective_mass),
        mass_factor=learned.mass_factor,
        door_distance=_optional("door_distance [m]", request.door_distance, settings.door_distance),
        l_b=_optional("l_b [m]", request.l_b, None),
        run_up=_word("run_up", request.run_up or settings.run_up, RUN_UPS),
        ending=_word("ending", request.ending or settings.ending, ENDINGS),
    )


def _optional(name: str, value: float | None, default: float | None) -> float | None:
    """Return the value or its default as a number above 0; None where both are None."""
    chosen = default if value is None else value
    return None if chosen is None else _number(name, chosen)


def _number(
    name: str, value: float, *, below: float = math.inf, most: float = math.inf, zero: bool = False
) -> float:
    """Return the value as a finite number above 0, or 0 where allowed, within an upper bound."""
    number = float(value)
    fits = (number >= 0.0 if zero else number > 0.0) and number < below and number <= most
    if not (math.isfinite(number) and fits):
        words = [f"{'at least' if zero else 'above'} 0", f"below {below:g}", f"at most {most:g}"]
        raise InvalidRequest(
            f"{name} must be a number {' and '.join(w for w in words if 'inf' not in w)}, not "
            f"{number:g}", quantity=name, value=number, limit=(0.0, min(below, most)))
    return number


def _word(name: str, value: str, known: tuple[str, ...]) -> str:
    """Return the value, which must be a known word."""
    if value not in known:
        raise InvalidRequest(
            f"{name} must be {' or '.join(known)}, not {value!r}", quantity=name, value=value,
            limit=" ".join(known))
    return value
