"""Drives of the joints, rubber under the soles, and the pads of the braced arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import STRICT, Name, Positive, Vector
from pydantic import AfterValidator, ConfigDict, Field, field_validator
from pydantic.dataclasses import dataclass as described

from hrp2_description.quantities import Length, in_metres

_NAMED = ConfigDict(**STRICT, populate_by_name=True)
_UNIT = 1e-6  # largest deviation of a unit vector's length


@described(frozen=True, config=STRICT)
class SoleRubber:
    """Rubber under one whole sole.

    Attributes:
        stiffness: Stiffness along the vertical [N/m].
        damping: Damping along the vertical [N s/m].
    """

    stiffness: Positive
    damping: Positive


@dataclass(frozen=True, eq=False)
class Drives:
    """Motors, servos and gears of the joints, all of them seen from the joint's side of the gear.

    Arrays are (J,) in the order of `RobotConfig.joint_names`.

    Attributes:
        gear_ratio: Motor turns per joint turn [-].
        rotor_inertia: Inertia of the rotors at the motors [kg m^2].
        stiffness: Torsional stiffness of the gears [N m/rad].
        damping: Damping of the gears [N m s/rad].
        peak_torque: Momentary peak torque of the gears, which they bear a limited number of times
            [N m].
        ratcheting_torque: Torque at which the gears' teeth skip [N m].
        position_gain: Gain of the servos on the error of the motor's angle [N m/rad].
        speed_gain: Gain of the servos on the error of the motor's speed [N m s/rad].
    """

    gear_ratio: Array
    rotor_inertia: Array
    stiffness: Array
    damping: Array
    peak_torque: Array
    ratcheting_torque: Array
    position_gain: Array
    speed_gain: Array

    @property
    def inertia(self) -> Array:
        """Inertia of the rotors behind the gears, gear_ratio^2 rotor_inertia, (J,) [kg m^2]."""
        reflected: Array = self.gear_ratio**2 * self.rotor_inertia
        return reflected

    def scaled(self, *, rotor: float = 1.0, gear: float = 1.0, servo: float = 1.0) -> Drives:
        """Return drives whose rotors and gears differ by factors.

        Args:
            rotor: Factor of the rotors' inertia.
            gear: Factor of the gears' stiffness and damping.
            servo: Factor of the servos' gains.
        """
        return replace(
            self, rotor_inertia=rotor * self.rotor_inertia, stiffness=gear * self.stiffness,
            damping=gear * self.damping, position_gain=servo * self.position_gain,
            speed_gain=servo * self.speed_gain)


@described(frozen=True, config=_NAMED)
class Pad:
    """Place of a pad on a link.

    Attributes:
        link: Name of the link.
        place: Middle of the pad in the link's frame, (3,) [m]; ``xyz`` in the file.
        size: Radius of the pad [m]; ``radius`` in the file.
    """

    link: Name
    place: Annotated[Vector, AfterValidator(in_metres), Field(validation_alias="xyz")]
    size: Annotated[Length, Field(validation_alias="radius")]


@described(frozen=True, config=_NAMED)
class Disc(Pad):
    """A pad that is a disc; its place is the middle of the outer face.

    Attributes:
        normal: Outward unit normal of the face in the link's frame, (3,).
    """

    normal: Vector

    @field_validator("normal")
    @classmethod
    def _unit(cls, normal: Vector) -> Vector:
        if not abs(float(np.linalg.norm(normal)) - 1.0) < _UNIT:
            raise ValueError("a vector of length 1")
        return normal


@described(frozen=True, config=STRICT)
class Brace:
    """The contact through which the hitting arm leans on the trunk in the hit.

    Attributes:
        arm: Pad on the arm, a ball.
        trunk: Pad on the trunk.
        stiffness: Stiffness of the two pads together [N/m].
        damping: Damping of the two pads together [N s/m].
        friction: Coefficient of friction between the pads.
    """

    arm: Pad
    trunk: Disc
    stiffness: Positive
    damping: Positive
    friction: Positive

    @property
    def normal(self) -> Vector:
        """Outward unit normal of the trunk's pad in the frame of the trunk's link, (3,)."""
        return self.trunk.normal
