"""The configuration of a robot: the content of config/robot.yaml with the limits of the URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.documents import STRICT, Name, Number, Positive, Range, Vector
from pydantic import AfterValidator, model_validator
from pydantic.dataclasses import dataclass as described

from hrp2_description.drives_and_pads import Brace, Drives, SoleRubber
from hrp2_description.errors import RobotConfigError
from hrp2_description.quantities import Length, in_degrees, in_metres

Rect = tuple[float, float, float, float]
T = TypeVar("T")
_SOLE_WIDTH, _MASS = 0.13, 58.0  # of HRP-2 [m], [kg]


@described(frozen=True, config=STRICT)
class Frame:
    """A frame that the URDF lacks.

    Attributes:
        link: Link to which it is fixed, by the joint of the frame's name with ``_joint``.
        xyz: Place of its origin in the link's frame, (3,) [m].
        rpy: Its roll, pitch and yaw there, (3,) [rad].
    """

    link: Name
    xyz: Annotated[Vector, AfterValidator(in_metres)]
    rpy: Vector = (0.0, 0.0, 0.0)


@described(frozen=True, config=STRICT)
class FootNames:
    """Names in the URDF that belong to one foot.

    Attributes:
        sole: Link of the sole on the floor below the ankle (REP-120 ``l_sole`` or ``r_sole``).
        ankle: Link that the ankle-roll joint moves; None if the file does not name it.
        sensor_joint: Fixed joint above the sole that contains the force sensor; None if the file
            does not name it.
    """

    sole: Name
    ankle: Name | None = None
    sensor_joint: Name | None = None


@described(frozen=True, config=STRICT)
class FootSensors:
    """What the force sensors of the feet report.

    Attributes:
        compensated: Whether the weight of what is below them, by ``sensor_joint``, is taken away.
        reversed: Whether they report what the foot does to the floor instead of the opposite.
        virtual: Whether only the simulation has them; every plan says so then.
    """

    compensated: bool = True
    reversed: bool = False
    virtual: bool = False


@described(frozen=True, config=STRICT)
class WristSensor:
    """Force sensor of a wrist.

    Attributes:
        link: Link of the hand, in whose frame the sensor reports.
        joint: Fixed joint above that link that contains the sensor.
    """

    link: Name
    joint: Name


@described(frozen=True, config=STRICT)
class Arm:
    """The right arm, whose hand meets the leaf.

    Attributes:
        joints: Joints that place the hand, beginning at the shoulder.
        elbow: Joint that bends the elbow, which is among `joints`.
        straightest_elbow_deg: Angle of the elbow beyond which the arm counts as stretched [deg];
            it has the sign of a bent elbow.
        wrist_link: Link that keeps the same distance from the leaf as the elbow.
        heights: Lowest and highest position of the hand on the leaf above the floor [m].
    """

    joints: tuple[Name, ...]
    elbow: Name
    straightest_elbow_deg: Annotated[Number, AfterValidator(in_degrees)]
    wrist_link: Name
    heights: Annotated[Range, AfterValidator(in_metres)]

    @property
    def straightest_elbow(self) -> float:
        """The angle of `straightest_elbow_deg` [rad]."""
        return math.radians(self.straightest_elbow_deg)


@described(frozen=True, config=STRICT)
class Step:
    """The step of the right foot towards the door.

    Attributes:
        shortest: Length of the shortest step [m].
        nominal: Length of the step unless the place of the door requires another [m].
        longest: Length of the longest step [m].
        lift: Height of the foot in the middle of the step [m].
    """

    shortest: Length
    nominal: Length
    longest: Length
    lift: Length

    @model_validator(mode="after")
    def _in_order(self) -> Step:
        if not self.shortest < self.nominal < self.longest:
            raise ValueError("shortest < nominal < longest")
        return self


@described(frozen=True, config=STRICT)
class StepLimits:
    """How far one foot may be placed from the other, in the axes of the foot that stands.

    Distances are between the origins of the soles' frames.

    Attributes:
        ahead: Largest distance ahead of the standing foot [m].
        back: Largest distance behind the standing foot [m].
        width: Distance of the feet beside each other when the robot stands [m].
        narrowest: Smallest distance of the feet along the standing foot's y axis [m].
        widest: Largest distance of the feet along the standing foot's y axis [m].
        turn_deg: Largest angle between the feet [deg].
        clearance: Smallest distance between the rectangles of the soles [m].
        stride: Largest distance ahead in steps that last as long as the joints need [m]; None
            means `ahead`.
    """

    ahead: Length
    back: Length
    width: Length
    narrowest: Length
    widest: Length
    turn_deg: Annotated[Positive, AfterValidator(in_degrees)]
    clearance: Length
    stride: Length | None = None

    @model_validator(mode="after")
    def _wide_enough(self) -> StepLimits:
        if not self.narrowest <= self.width <= self.widest:
            raise ValueError(f"a width from narrowest to widest, not {self.width:g}")
        return self

    @property
    def turn(self) -> float:
        """The angle of `turn_deg` [rad]."""
        return math.radians(self.turn_deg)


@dataclass(frozen=True, eq=False)
class RobotConfig:
    """A humanoid robot in front of a door.

    Arrays are (J,) in the order of `joint_names`, and read-only. The file may omit the fields whose
    default is None.

    Attributes:
        name: Name of the robot in sentences, such as HRP-2.
        mass: Total mass, the sum over the URDF's links [kg].
        joint_names: Names of the joints in the robot's own order.
        half_sitting: Initial posture, with the soles level and parallel to the base [rad].
        lower: Lower joint limits [rad].
        upper: Upper joint limits [rad].
        velocity_limit: Largest joint speeds [rad/s].
        effort_limit: Largest joint torques [N m].
        legs: Joints of the ``left`` and the ``right`` leg, from the hip to the ankle.
        arm: The right arm.
        step: The step towards the door.
        run_up_start: Lowest and highest y of the CoM at the start of a run-up, in odom [m].
        soles: Rectangles (x_min, x_max, y_min, y_max) of the ``left`` and the ``right`` sole in
            the sole's frame [m].
        feet: Names of links and joints of the ``left`` and the ``right`` foot.
        contact_link: Link whose origin is the middle of the sphere that hits the door.
        contact_radius: Radius of that sphere [m].
        hand_link: Link at the middle of the right hand.
        braced_posture: Joint angles of the right arm during the hit [rad].
        braced_joints: Joints that the brace relieves.
        urdf_file: Path of the URDF that the file names, for messages.
        urdf_path: Path of the URDF for readers, as `Urdf.written` has made it.
        root_link: Link from which the URDF's tree grows: what comments call base_link.
        hand_radius: Radius of the hand [m]; None means that of the URDF's collision sphere.
        clearance: Smallest distance between bodies, and between a body and the leaf [m].
        disabled_collisions: Pairs of links that may touch, like an SRDF's ``disable_collisions``.
        drives: Motors, servos and gears of the joints.
        motor_encoder_counts: Counts of a motor's encoder per motor turn.
        brace: Contact through which the hitting arm leans on the trunk.
        sole_rubber: Rubber between an ankle and the floor.
        imu_frame: Link that contains the IMU.
        wrist_sensors: Force sensors of the ``left`` and the ``right`` wrist.
        foot_sensors: What the force sensors of the feet report.
        footsteps: Limits of the footsteps of a walk.
        tucked_posture: Joint angles of the free arm while the robot goes through a door [rad].
        chest_yaw: Joint that turns the upper body against the legs; None if there is none.
        doubts: Sentences about what is possible and improbable in the URDF.
        file: The robot.yaml; None means this package's own.
    """

    name: str
    mass: float
    joint_names: tuple[str, ...]
    half_sitting: Array
    lower: Array
    upper: Array
    velocity_limit: Array
    effort_limit: Array
    legs: Mapping[str, tuple[str, ...]]
    arm: Arm
    step: Step
    run_up_start: tuple[float, float]
    soles: Mapping[str, Rect]
    feet: Mapping[str, FootNames]
    contact_link: str
    contact_radius: float
    hand_link: str
    braced_posture: Mapping[str, float]
    braced_joints: tuple[str, ...]
    urdf_file: Path
    urdf_path: Path
    root_link: str
    hand_radius: float | None = None
    clearance: float = 0.01
    disabled_collisions: tuple[tuple[str, str], ...] = ()
    drives: Drives | None = None
    motor_encoder_counts: int | None = None
    brace: Brace | None = None
    sole_rubber: SoleRubber | None = None
    imu_frame: str | None = None
    wrist_sensors: Mapping[str, WristSensor] | None = None
    foot_sensors: FootSensors = field(default_factory=FootSensors)
    footsteps: StepLimits | None = None
    tucked_posture: Mapping[str, float] = field(default_factory=dict)
    chest_yaw: str | None = None
    doubts: tuple[str, ...] = ()
    file: Path | None = None

    @property
    def sole_scale(self) -> float:
        """Width of a sole over HRP-2's, 0.13 m.

        Lengths that keep the ZMP inside the soles are stated for HRP-2, and are used times this.
        """
        _, _, low, high = self.soles["right"]
        return (high - low) / _SOLE_WIDTH

    @property
    def mass_scale(self) -> float:
        """Mass over HRP-2's, 58 kg; forces are stated for HRP-2, and are used times this."""
        return self.mass / _MASS

    @property
    def armature(self) -> Array:
        """Rotor inertia behind the gears, (J,) [kg m^2]; 0 if the file has no drives."""
        return np.zeros(len(self.joint_names)) if self.drives is None else self.drives.inertia

    @property
    def joint_resolution(self) -> Array:
        """Joint angle of one count of the motor's encoder, (J,) [rad].

        Raises:
            RobotConfigError: The file has no encoder or no drives.
        """
        counts = needed(self.motor_encoder_counts, "motor_encoder_counts")
        resolution: Array = 2.0 * np.pi / (counts * needed(self.drives, "drives").gear_ratio)
        return resolution

    def index(self, joint: str) -> int:
        """Return the index of a joint in the (J,) arrays.

        Raises:
            RobotConfigError: There is no joint of this name.
        """
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise RobotConfigError(
                "no such joint", value=joint, limit="a name of joint_names"
            ) from None

    def posture(self, joints: Mapping[str, float], base: Array | None = None) -> Array:
        """Return a posture in which some joints differ from a base posture.

        Args:
            joints: Angles of these joints by their names [rad].
            base: Base posture, (J,) [rad]; the default is half-sitting.

        Returns:
            Joint angles (J,) [rad].

        Raises:
            RobotConfigError: There is no joint of a name.
        """
        angles = np.array(self.half_sitting if base is None else base, dtype=float)
        for joint, angle in joints.items():
            angles[self.index(joint)] = angle
        return angles


def needed(value: T | None, field: str) -> T:
    """Return the value of a field that the configuration may omit but that is needed now.

    Args:
        value: Value of the field; None if the configuration omits it.
        field: Name of the field.

    Raises:
        RobotConfigError: The configuration omits the field.
    """
    if value is None:
        raise RobotConfigError(
            f"the robot's configuration lacks {field}, which is needed here",
            limit=f"a field {field}",
        )
    return value
