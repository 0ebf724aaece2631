"""Settings of the walking pattern."""

from __future__ import annotations

from typing import Any

from door_impact_common.documents import STRICT, NotNegative, Number, Positive
from hrp2_description.robot import StepLimits
from humanoid_motion.robot_model import RobotModel
from pydantic.dataclasses import dataclass


@dataclass(frozen=True, config=STRICT)
class WalkSettings:
    """Settings of the walking pattern; `documents.checked` reports wrong ones as SettingError.

    Defaults are HRP-2's; `of` has those of another robot.

    Attributes:
        double_support: Time at the beginning of each step in which both feet bear load [s].
        start: Time from rest to the first step, in which the waist sinks [s].
        end: Time from the last touchdown to rest, in which the waist rises [s].
        waist_height: Height of base_link above the floor while walking [m].
        lift: Height of the swing foot in the middle of a step [m].
        chest_swing: Turn of the upper body against the legs, per distance between the feet along
            the heading [rad/m].
        period: Time between two knots [s]; durations are whole multiples of it.
        horizon: Time that the preview control looks ahead [s].
        zmp_inward: Distance of the ZMP's reference in single support from the middle of the sole,
            towards the other foot [m]; the body sways less with it.
        first_inward: The same in the first step, if it is larger [m].
        jerk_weight: Weight of the CoM's squared jerk against the squared ZMP error [s^6].
        required_margin: Smallest allowed distance of the ZMP from the edge of the soles [m].
        speed_share: Share of the joints' speed limits that may be used.
        torque_share: Share of the joints' torque limits that may be used.
        friction: Coefficient of friction between soles and floor that may be used.
        limits: Limits of the footsteps; None means those of the robot.
    """

    double_support: Positive = 0.1
    start: Positive = 1.2
    end: Positive = 1.1
    waist_height: Positive = 0.62
    lift: Positive = 0.045
    chest_swing: NotNegative = 0.75
    period: Positive = 0.02
    horizon: Positive = 2.0
    zmp_inward: NotNegative = 0.0
    first_inward: NotNegative = 0.0
    jerk_weight: Positive = 1e-6
    required_margin: Number = 0.02
    speed_share: Positive = 0.9
    torque_share: Positive = 0.9
    friction: Positive = 0.4
    limits: StepLimits | None = None

    @classmethod
    def of(cls, robot: RobotModel, **own: Any) -> WalkSettings:
        """Return HRP-2's defaults by a robot's height and soles, and `own` as it is."""
        tall, wide = robot.height_scale, robot.config.sole_scale
        scaled = {"waist_height": tall * cls.waist_height, "lift": tall * cls.lift,
                  "chest_swing": cls.chest_swing / tall,
                  "required_margin": wide * cls.required_margin}
        return cls(**scaled | own)
