"""Configuration of the planner: its parameters, their ranges, and the default place of the door."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from door_impact_common.documents import STRICT, Positive, checked, descriptions, number
from door_impact_common.errors import SettingError
from humanoid_motion.robot_model import RobotModel
from pydantic import BeforeValidator, Field, model_validator
from pydantic.dataclasses import dataclass

from impact_planner.errors import InvalidRequest
from impact_planner.task.experience import MASS_FACTORS, Limits

RunUp = Literal["mcv50", "zmp_limited"]
Ending = Literal["hold", "retreat", "pass"]
RUN_UPS, ENDINGS = get_args(RunUp), get_args(Ending)
RESERVE = 0.03  # capture point inside the soles with which HRP-2 stood after each miss [m]


def _if_not_negative(value: Any) -> Any:
    return None if isinstance(value, int | float) and value < 0.0 else _if_number(value)


def _if_number(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value


# Parameters of nodes have no None: NaN, or a negative length or mass, leaves the choice open.
_Number = Annotated[float | None, BeforeValidator(_if_number)]
_Positive = Annotated[float | None, BeforeValidator(_if_not_negative)]


@dataclass(frozen=True, config=STRICT)
class PlannerSettings:
    """Configuration of the planner.

    A field with a description is a parameter of the node; the description says what it means.
    Defaults are HRP-2's (`parameters_of` has those of another robot).

    Attributes:
        nominal_l_b: Distance of B from the hinge where nothing else decides it, the paper's [m].
        period: Sampling period of the motions [s].
    """

    door_distance: _Positive = number(
        None, -math.inf, math.inf, "distance from the origin of odom to the closed leaf's face "
        "[m]; negative: the door stands where a nominal step ends")
    hinge_x: _Number = number(
        None, -math.inf, math.inf, "x of the hinge in odom [m]; NaN: the paper's l_B behind B")
    initial_angle: float = number(0.0, 0.0, math.pi, "opening angle of the door at the hit [rad]")
    restitution: float = number(
        0.5, 0.0, 1.0, "coefficient of restitution of the leaf's surface before the first hit on a "
        "door, as two free masses would show it: the give of arm, gears and soles comes on top")
    effective_mass: _Positive = number(
        None, -math.inf, math.inf, "effective mass of the robot at B [kg]; negative: the model's")
    run_up: RunUp = Field(default="mcv50", description="time law of the run-up")
    ending: Ending = Field(default="hold", description="phase after the door's largest angle")
    com_inside_edge: float = number(
        -0.03, -0.15, 0.15, "distance of the CoM inside the right sole's inner edge at "
        "the hit [m]; negative between the soles; further out where a door stands farther away, "
        "further in where missed_reserve needs it")
    missed_reserve: float = number(
        RESERVE, -1.0, 0.10, "desired distance of the capture point inside the soles when a missed "
        "contact is noticed [m], for which the CoM is moved further in where the legs and the "
        "run-up's ZMP allow it; -1 moves nothing")
    # The legs do not reach far enough to come to rest with the ZMP inside the soles. After a short
    # stop the CoM is still far inside: the robot leans over its outer edge and falls back on its
    # feet. In the simulation a miss with a reserve of 19 mm falls with 0.08 s, stands with 0.05 s.
    missed_stop: float = number(0.05, 0.02, 1.0, "longest stop after a missed contact [s]")
    y_start: _Number = number(
        None, -0.2, 0.2, "y of the CoM at the start of the run-up [m]; NaN: the start with the "
        "largest ZMP margin")
    door_uncertainty: float = number(
        0.02, 0.0, 0.05, "largest error of the door's distance [m]; the run-up keeps its speed "
        "over this distance before and past the nominal contact")
    overrun: float = number(
        0.025, 0.0, 0.2, "desired distance of the run-up past the nominal contact [m]")
    required_margin: float = number(
        0.02, -0.05, 0.10, "smallest allowed ZMP margin of a phase [m]")
    limit_share: float = number(
        0.9, 0.1, 1.0, "share of the joints' speed and torque limits that a plan may use")
    post_duration: float = number(
        0.4, 0.05, 2.0, "time from the end of slow_down to rest [s]")
    sole_friction: float = number(
        0.5, 0.05, 2.0, "assumed coefficient of friction between soles and floor")
    contact_duration: float = number(
        0.015, 0.001, 0.1, "duration that the contact of two free masses on the leaf's surface "
        "would have [s]")
    leaf_friction: float = number(
        0.3, 0.0, 2.0, "coefficient of friction between elbow and leaf")
    switch_delay: float = number(
        0.012, 0.0, 0.05, "time after the detection of the contact in which the legs keep their "
        "speed [s]; a switch while the leaf still pushes would take speed from the door")
    detection_delay: float = number(
        0.0, 0.0, 0.05, "expected time from the start of the contact to the stamp at which it is "
        "detected [s]; the legs keep their speed during this time, too")
    slow_down: float = number(
        0.01, 0.0, 0.1, "time after the switch in which the legs take up v'_rB [s]")
    hand_force_limit: float = number(
        60.0, 0.0, 500.0, "largest allowed force of the held door on the hand [N]")
    least_restitution: float = number(
        Limits.restitution[0], 0.0, 1.0, "least coefficient of restitution that hits can teach")
    largest_restitution: float = number(
        Limits.restitution[1], 0.0, 1.0, "largest coefficient of restitution that hits can teach")
    least_mass_factor: float = number(
        Limits.mass_factor[0], MASS_FACTORS[0], 1.0, "least factor on the model's effective mass "
        "that hits can teach")
    largest_mass_factor: float = number(
        Limits.mass_factor[1], 1.0, MASS_FACTORS[1], "largest factor on the model's effective mass "
        "that hits can teach")
    nominal_l_b: Positive = 0.42
    period: Positive = 0.005

    @model_validator(mode="after")
    def _least_below_largest(self) -> PlannerSettings:
        if self.least_restitution > self.largest_restitution:
            raise ValueError(
                f"least_restitution at most largest_restitution, {self.largest_restitution:g}")
        return self

    @property
    def learning_limits(self) -> Limits:
        """Limits of what hits can teach; they always include the configured restitution."""
        return Limits(
            (self.least_mass_factor, self.largest_mass_factor),
            (min(self.least_restitution, self.restitution),
             max(self.largest_restitution, self.restitution)))


# Parameters whose defaults are HRP-2's times the scale of the soles, of the mass, or of the height:
# the way to rest after a hit is a speed over the pendulum's frequency.
_OF_SOLE = ("missed_reserve", "door_uncertainty", "overrun", "required_margin")
_OF_MASS, _OF_HEIGHT = ("hand_force_limit",), ("com_inside_edge",)


def parameters_of(robot: RobotModel) -> dict[str, tuple[Any, str]]:
    """Return default (NaN for None) and description of each parameter by name.

    Lengths and forces of the balance are by default as large for the robot as those of
    `PlannerSettings` are for HRP-2.
    """
    scales = {**dict.fromkeys(_OF_SOLE, robot.config.sole_scale),
              **dict.fromkeys(_OF_MASS, robot.config.mass_scale),
              **dict.fromkeys(_OF_HEIGHT, robot.height_scale)}
    return {name: (default if name not in scales else default * scales[name], text)
            for name, (default, text) in descriptions(PlannerSettings).items()}


def make_settings(values: Mapping[str, Any], robot: RobotModel) -> PlannerSettings:
    """Make settings from parameters; a missing parameter has the robot's default.

    Args:
        values: Values by the names in `parameters_of`.
        robot: The robot.

    Raises:
        InvalidRequest: A value has the wrong type or is outside its range, or a name is unknown.
    """
    try:
        defaults = {name: default for name, (default, _) in parameters_of(robot).items()}
        return checked(PlannerSettings, defaults | dict(values))
    except SettingError as error:
        raise InvalidRequest(
            str(error), quantity=error.setting, value=error.value, limit=error.limit) from error
