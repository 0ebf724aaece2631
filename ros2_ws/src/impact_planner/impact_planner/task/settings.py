"""Configuration of the planner: its parameters, their ranges, and the default place of the door."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from door_impact_common.errors import InputError
from door_impact_common.yaml_files import read_yaml

from impact_planner.errors import InvalidRequest
from impact_planner.task.experience import MASS_FACTORS, Limits

RUN_UPS = ("mcv50", "zmp_limited")
ENDINGS = ("hold", "retreat")
LEAST_INSIDE_EDGE = -0.06  # least distance of the CoM inside the right sole's inner edge [m]


@dataclass(frozen=True)
class ApproachTiming:
    """Durations of the slow phases before the run-up.

    Attributes:
        prepare: Duration from half-sitting to the run-up's waist height with the arm braced [s].
        shift: Duration of moving the CoM over the left foot [s].
        step: Duration of moving the right foot to its place at the hit [s].
        back: Duration of moving the CoM to the start of the run-up [s].
    """

    prepare: float = 2.0
    shift: float = 1.5
    step: float = 1.2
    back: float = 1.5


@dataclass(frozen=True)
class PlannerSettings:
    """Configuration of the planner.

    Attributes:
        door_distance: Distance from the origin of odom to the closed leaf's face [m]. None places
            the door where the nominal step ends.
        hinge_x: x of the hinge in odom [m]. None places the hinge `nominal_l_b` behind B.
        nominal_l_b: Distance of B from the hinge where nothing else decides it, the paper's [m].
        initial_angle: Opening angle of the door at the hit [rad].
        restitution: Coefficient of restitution of the leaf's surface before the first hit on a
            door. It describes elbow and leaf alone, as two free masses would show it; the give
            of arm, gears and soles comes on top.
        effective_mass: Effective mass at B [kg]; None means that the model decides.
        run_up: Time law of the run-up where the request names none.
        ending: Last phase of the motion where the request names none.
        com_inside_edge: Distance of the CoM inside the right sole's inner edge at the hit [m];
            negative where the CoM is still between the soles. A fast hit is planned with a smaller
            one, as `missed_reserve` asks for.
        missed_reserve: Desired `missed.missed_margin` [m], for which the CoM is moved further
            inside. With -0.03 m of `com_inside_edge`, 0.03 m here and 0.05 s of `missed_stop` a
            robot that misses the door stands, but reaches only doors that stand 23 mm nearer. The
            default moves nothing.
        missed_stop: Longest stop after a missed contact [s]. The legs do not reach far enough to
            come to rest with the ZMP inside the soles. After a short stop the CoM is still far
            inside: the robot leans over its outer edge and falls back on its feet. In the
            simulation a miss with a reserve of 19 mm falls with 0.08 s and stands with 0.05 s.
        y_start: y of the CoM at the start of the run-up [m]. None chooses the start with the
            largest ZMP margin.
        door_uncertainty: Largest error of the door's reported distance [m]. The run-up keeps its
            speed over this distance before and past the nominal contact.
        overrun: Desired distance of the run-up past the nominal contact [m].
        required_margin: Smallest allowed ZMP margin of a phase [m].
        limit_share: Share of the joints' speed and torque limits that a plan may use.
        post_duration: Time from the end of `slow_down` to rest [s].
        sole_friction: Assumed coefficient of friction between soles and floor.
        contact_duration: Duration that the contact of two free masses on that surface would
            have [s].
        leaf_friction: Coefficient of friction between elbow and leaf.
        switch_delay: Time after the detection of the contact in which the legs keep their speed
            [s]. A switch while the leaf still pushes would take angular velocity from the door.
        detection_delay: Expected time from the start of the contact to the stamp at which it is
            detected [s]. The legs keep their speed during this time, too.
        slow_down: Time after the switch in which the legs take up v'_rB [s].
        period: Sampling period of the motions [s].
        timing: Durations of the slow phases.
        hand_force_limit: Largest allowed force of the held door on the hand [N].
        least_restitution: Least coefficient of restitution that hits can teach.
        largest_restitution: Largest one.
        least_mass_factor: Least factor on the model's effective mass that hits can teach.
        largest_mass_factor: Largest one.
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
    missed_reserve: float = -1.0
    missed_stop: float = 0.3
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
    detection_delay: float = 0.0
    slow_down: float = 0.01
    period: float = 0.005
    timing: ApproachTiming = field(default_factory=ApproachTiming)
    hand_force_limit: float = 60.0
    least_restitution: float = Limits.restitution[0]
    largest_restitution: float = Limits.restitution[1]
    least_mass_factor: float = Limits.mass_factor[0]
    largest_mass_factor: float = Limits.mass_factor[1]

    @property
    def learning_limits(self) -> Limits:
        """Limits of what hits can teach; they always include the configured restitution."""
        return Limits(
            (self.least_mass_factor, self.largest_mass_factor),
            (min(self.least_restitution, self.restitution),
             max(self.largest_restitution, self.restitution)))


_DEFAULTS = PlannerSettings()
# Parameters for which a negative number, or NaN, leaves the choice to the planner.
_OWN_CHOICE_BELOW_ZERO = ("door_distance", "effective_mass")
_OWN_CHOICE_NAN = ("hinge_x", "y_start")


def _default(name: str) -> float:
    """Default of a parameter; NaN or a negative number stands for None in `PlannerSettings`."""
    value = getattr(_DEFAULTS, name)
    if value is None:
        return math.nan if name in _OWN_CHOICE_NAN else -1.0
    return float(value)


# Parameter's name: (least value, largest value, description).
_RANGES: dict[str, tuple[float, float, str]] = {
    "door_distance": (-math.inf, math.inf, "distance of the closed leaf's face from the origin of "
                      "odom [m]; negative: the door stands where a nominal step ends"),
    "hinge_x": (-math.inf, math.inf, "x of the hinge in odom [m]; NaN: the paper's l_B behind B"),
    "restitution": (0.0, 1.0, "coefficient of restitution before the first hit on a door"),
    "effective_mass": (-math.inf, math.inf, "effective mass of the robot at B [kg]; negative: the "
                       "model's"),
    "initial_angle": (0.0, math.pi, "opening angle of the door at the hit [rad]"),
    "com_inside_edge": (LEAST_INSIDE_EDGE, 0.10, "distance of the CoM inside the right sole's "
                        "inner edge at the hit [m]; less where missed_reserve needs it"),
    "missed_reserve": (-1.0, 0.10, "desired distance of the capture point inside the soles when a "
                       "missed contact is noticed [m]"),
    "missed_stop": (0.02, 1.0, "longest stop after a missed contact [s]"),
    "y_start": (-0.2, 0.2, "y of the CoM at the start of the run-up [m]; NaN: the start with the "
                "largest ZMP margin"),
    "door_uncertainty": (0.0, 0.05, "largest error of the door's distance [m]"),
    "overrun": (0.0, 0.2, "distance of the run-up past the nominal contact [m]"),
    "required_margin": (-0.05, 0.10, "smallest allowed ZMP margin of a phase [m]"),
    "limit_share": (0.1, 1.0, "share of the joints' speed and torque limits that a plan may use"),
    "post_duration": (0.05, 2.0, "time from the end of slow_down to rest [s]"),
    "sole_friction": (0.05, 2.0, "assumed coefficient of friction between soles and floor"),
    "contact_duration": (0.001, 0.1, "expected duration of the contact [s]"),
    "leaf_friction": (0.0, 2.0, "coefficient of friction between elbow and leaf"),
    "switch_delay": (0.0, 0.05, "time after the detection of the contact in which the legs keep "
                     "their speed [s]"),
    "detection_delay": (0.0, 0.05, "expected time from the start of the contact to its detection "
                        "[s]"),
    "slow_down": (0.0, 0.1, "time after the switch in which the legs take up v'_rB [s]"),
    "hand_force_limit": (0.0, 500.0, "largest allowed force of the held door on the hand [N]"),
    "least_restitution": (0.0, 1.0, "least coefficient of restitution that hits can teach"),
    "largest_restitution": (0.0, 1.0, "largest coefficient of restitution that hits can teach"),
    "least_mass_factor": (MASS_FACTORS[0], 1.0, "least factor on the model's effective mass that "
                          "hits can teach"),
    "largest_mass_factor": (1.0, MASS_FACTORS[1], "largest factor on the model's effective mass "
                            "that hits can teach"),
}  # fmt: skip
# Parameter's name: (default, least value, largest value, description).
NUMBERS: dict[str, tuple[float, float, float, str]] = {
    name: (_default(name), *rest) for name, rest in _RANGES.items()
}
# Parameter's name: (default, allowed words, description).
WORDS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "run_up": (_DEFAULTS.run_up, RUN_UPS, "time law of the run-up"),
    "ending": (_DEFAULTS.ending, ENDINGS, "phase that follows the door's largest angle"),
}


def make_settings(values: Mapping[str, Any]) -> PlannerSettings:
    """Make settings from parameters; a missing parameter has its default.

    Args:
        values: Values by the names in `NUMBERS` and `WORDS`.

    Raises:
        InvalidRequest: A value has the wrong type or is outside its range.
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
    if chosen["least_restitution"] > chosen["largest_restitution"]:
        raise InvalidRequest(
            f"least_restitution must be at most largest_restitution, which is "
            f"{chosen['largest_restitution']:g}, not {chosen['least_restitution']:g}",
            quantity="least_restitution",
            value=chosen["least_restitution"],
            limit=chosen["largest_restitution"],
        )
    return PlannerSettings(**chosen)


def _number(name: str, value: Any, low: float, high: float) -> float | None:
    """A parameter as a number in its range; None where its value leaves the choice open.

    Raises:
        InvalidRequest: The value is no number, or outside its range.
    """
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
    """Read door_distance and hinge_x from the installed bringup's parameter file.

    Every node of the graph reads both from that file, so a plan made on the command line uses the
    same place of the door as the demo.

    Returns:
        The values by name [m]; empty where the file is not installed or has no such values.
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
        common = read_yaml(path)["/**"]["ros__parameters"]
    except (PackageNotFoundError, InputError, KeyError, TypeError):
        return {}
    return {
        name: float(common[name])
        for name in ("door_distance", "hinge_x")
        if isinstance(common.get(name), int | float)
    }
