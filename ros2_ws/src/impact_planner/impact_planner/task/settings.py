"""The planner's configuration from parameters, and where the door is placed by default."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from impact_planner.errors import InvalidRequest

RUN_UPS = ("mcv50", "zmp_limited")
ENDINGS = ("hold", "retreat")


@dataclass(frozen=True)
class ApproachTiming:
    """Durations of the slow phases [s].

    Attributes:
        prepare: Half-sitting to the waist height of the run-up, right arm to the brace.
        shift: CoM over the left foot.
        step: Right foot to its place at the hit.
        back: CoM to the start of the run-up.
    """

    prepare: float = 2.0
    shift: float = 1.5
    step: float = 1.2
    back: float = 1.5


@dataclass(frozen=True)
class PlannerSettings:
    """Configuration of the planner.

    Attributes:
        door_distance: From the origin of odom to the closed leaf's face [m]; None: where the
            nominal step ends.
        hinge_x: x of the hinge in odom [m]; None: `nominal_l_b` behind B.
        nominal_l_b: See `hinge_x` [m]; the paper's.
        initial_angle: Of the door at the hit [rad].
        restitution: Coefficient of restitution.
        effective_mass: At B [kg]; None: from the model.
        run_up: Default of the request.
        ending: Default of the request.
        com_inside_edge: How far inside the right sole's inner edge the CoM is at the hit [m].
        y_start: y of the CoM at the start of the run-up [m]; None: largest ZMP margin.
        door_uncertainty: By so much the door may be nearer or farther than planned [m]; the
            run-up keeps its speed so far before and past the nominal contact.
        overrun: Way of the run-up past the nominal contact that is wished for [m].
        required_margin: Smallest ZMP margin of a phase [m].
        limit_share: Of the joints' speed and torque limits that a plan may use.
        post_duration: From the end of `slow_down` to rest [s].
        sole_friction: Coefficient of friction that soles and floor are taken to have.
        contact_duration: Expected duration of the contact [s].
        leaf_friction: Coefficient of friction between elbow and leaf.
        switch_delay: So long after the contact's begin the legs keep their speed [s]: it is felt a
            few ms late, and a switch while the leaf still pushes would take w' from the door.
        slow_down: In which the legs then take up v'_rB [s].
        period: Sampling period of the motions [s].
        timing: Durations of the slow phases.
        hand_force_limit: Largest force of the door on the hand while it is held [N].
    """

    door_distance: float | None = None
    hinge_x: float | None = None
    nominal_l_b: float = 0.42
    initial_angle: float = 0.0
    restitution: float = 0.5
    effective_mass: float | None = None
    run_up: str = "mcv50"
    ending: str = "hold"
    com_inside_edge: float = 0.01
    y_start: float | None = None
    door_uncertainty: float = 0.02
    overrun: float = 0.025
    required_margin: float = 0.02
    limit_share: float = 0.9
    post_duration: float = 0.4
    sole_friction: float = 0.5
    contact_duration: float = 0.015
    leaf_friction: float = 0.3
    switch_delay: float = 0.012
    slow_down: float = 0.01
    period: float = 0.005
    timing: ApproachTiming = field(default_factory=ApproachTiming)
    hand_force_limit: float = 60.0


_DEFAULTS = PlannerSettings()
_OWN_CHOICE_BELOW_ZERO = ("door_distance", "effective_mass")
_OWN_CHOICE_NAN = ("hinge_x", "y_start")


def _default(name: str) -> float:
    """Default of a parameter; what `PlannerSettings` leaves open is NaN or below zero."""
    value = getattr(_DEFAULTS, name)
    if value is None:
        return math.nan if name in _OWN_CHOICE_NAN else -1.0
    return float(value)


# name: (least value, largest value, what it is).
_RANGES: dict[str, tuple[float, float, str]] = {
    "door_distance": (-math.inf, math.inf, "of the closed leaf's face from the origin of odom "
                      "[m]; negative: where a nominal step ends"),
    "hinge_x": (-math.inf, math.inf, "x of the hinge in odom [m]; NaN: the paper's l_B behind B"),
    "restitution": (0.0, 1.0, "coefficient of restitution, until a hit on the door has taught it"),
    "effective_mass": (-math.inf, math.inf, "of the robot at B [kg]; negative: the model's"),
    "initial_angle": (0.0, math.pi, "of the door at the hit [rad]"),
    "com_inside_edge": (-0.05, 0.10, "CoM inside the right sole's inner edge at the hit [m]"),
    "y_start": (-0.2, 0.2, "y of the CoM where the run-up starts [m]; NaN: where the ZMP margin "
                "is largest"),
    "door_uncertainty": (0.0, 0.05, "the door may be so much nearer or farther than planned [m]"),
    "overrun": (0.0, 0.2, "way of the run-up past the nominal contact [m]"),
    "required_margin": (-0.05, 0.10, "smallest ZMP margin of a phase [m]"),
    "limit_share": (0.1, 1.0, "of the joints' speed and torque limits that a plan may use"),
    "post_duration": (0.05, 2.0, "from the end of slow_down to rest [s]"),
    "sole_friction": (0.05, 2.0, "coefficient of friction that soles and floor are taken to have"),
    "contact_duration": (0.001, 0.1, "expected duration of the contact [s]"),
    "leaf_friction": (0.0, 2.0, "coefficient of friction between elbow and leaf"),
    "switch_delay": (0.0, 0.05, "the legs keep their speed so long after the contact's begin [s]"),
    "slow_down": (0.0, 0.1, "in which the legs then take up v'_rB [s]"),
    "hand_force_limit": (0.0, 500.0, "largest force of the held door on the hand [N]"),
}  # fmt: skip
# name: (default, least value, largest value, what it is).
NUMBERS: dict[str, tuple[float, float, float, str]] = {
    name: (_default(name), *rest) for name, rest in _RANGES.items()
}
WORDS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "run_up": (_DEFAULTS.run_up, RUN_UPS, "time law of the run-up"),
    "ending": (_DEFAULTS.ending, ENDINGS, "what follows the door's peak"),
}


def make_settings(values: Mapping[str, Any]) -> PlannerSettings:
    """Settings from parameters; what is missing has its default.

    Args:
        values: Parameters by name, of `NUMBERS` and `WORDS`.

    Raises:
        InvalidRequest: A value is of the wrong kind or outside its range.
    """
    chosen: dict[str, Any] = {}
    for name, (default, low, high, _) in NUMBERS.items():
        chosen[name] = _number(name, values.get(name, default), low, high)
    for word, (text, known, _) in WORDS.items():
        value = values.get(word, text)
        if value not in known:
            raise InvalidRequest(
                f"{word} must be {' or '.join(known)}, not {value!r}",
                quantity=word,
                value=str(value),
                limit=" ".join(known),
            )
        chosen[word] = value
    return PlannerSettings(**chosen)


def _number(name: str, value: Any, low: float, high: float) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidRequest(
            f"{name} must be a number, not {value!r}", quantity=name, value=str(value)
        )
    number = float(value)
    if name in _OWN_CHOICE_NAN and math.isnan(number):
        return None
    if name in _OWN_CHOICE_BELOW_ZERO and number < 0.0:
        return None
    if not (math.isfinite(number) and low <= number <= high):
        raise InvalidRequest(
            f"{name} must be a number from {low:g} to {high:g}, not {number:g}",
            quantity=name,
            value=number,
            limit=(low, high),
        )
    return number


def configured_placement() -> dict[str, float]:
    """door_distance and hinge_x of the installed bringup's parameter file; empty without one.

    The graph gives both to every node from that file, so a plan on the command line stands where
    the demo does.
    """
    try:
        from ament_index_python.packages import (
            PackageNotFoundError,
            get_package_share_directory,
        )
    except ImportError:
        return {}
    try:
        path = Path(get_package_share_directory("door_impact_bringup")) / "config" / "params.yaml"
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
        common = document["/**"]["ros__parameters"]
    except (PackageNotFoundError, OSError, KeyError, TypeError, yaml.YAMLError):
        return {}
    return {
        name: float(common[name])
        for name in ("door_distance", "hinge_x")
        if isinstance(common.get(name), int | float)
    }
