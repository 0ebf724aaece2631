"""A robot as the nodes need it: what config/robot.yaml says, with the limits of the URDF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from door_impact_common.arrays import Array

from hrp2_description.errors import RobotConfigError

Rect = tuple[float, float, float, float]
T = TypeVar("T")


@dataclass(frozen=True)
class Foot:
    """Names in the URDF that belong to one foot.

    Attributes:
        sole: Link of the sole (REP-120 ``l_sole`` or ``r_sole``), on the floor below the ankle.
        ankle: Link that the ankle-roll joint moves; None: not stated.
        sensor_joint: Fixed joint above the sole in which the force sensor sits; None: not stated.
    """

    sole: str
    ankle: str | None = None
    sensor_joint: str | None = None


@dataclass(frozen=True)
class Arm:
    """The right arm, which meets the leaf with its hand.

    Attributes:
        joints: Those that place the hand, from the shoulder on.
        elbow: The one of them that bends the elbow.
        straightest_elbow: Angle of it beyond which the arm counts as stretched [rad]; its sign is
            that of a bent elbow.
        wrist_link: Link that keeps as clear of the leaf as the elbow does.
        heights: Lowest and highest place of the hand on the leaf [m].
    """

    joints: tuple[str, ...]
    elbow: str
    straightest_elbow: float
    wrist_link: str
    heights: tuple[float, float]


@dataclass(frozen=True)
class Step:
    """The right foot's step towards the door.

    Attributes:
        shortest: [m].
        nominal: Where no place of the door asks for another [m].
        longest: [m].
        lift: Height of the foot in the middle of the step [m].
    """

    shortest: float
    nominal: float
    longest: float
    lift: float


@dataclass(frozen=True)
class SoleRubber:
    """Rubber under one whole sole, along the vertical.

    Attributes:
        stiffness: [N/m].
        damping: [N s/m].
    """

    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class RobotConfig:
    """A humanoid as the nodes need it. Arrays are (J,), in the order of ``joint_names``, read-only.

    What is None by default may be left out of the file: but for ``hand_radius``, only the
    simulation needs it, and asks for it by `needed`.

    Attributes:
        name: Name of the robot in its URDF.
        mass: Total mass [kg], the sum over the URDF.
        joint_names: The robot's own order.
        half_sitting: Initial posture, soles level and parallel to the base [rad].
        lower: Lower joint limits [rad].
        upper: Upper joint limits [rad].
        velocity_limit: Largest joint speeds [rad/s].
        effort_limit: Largest joint torques [N m].
        legs: ``left`` and ``right``: the joints from the hip to the ankle.
        arm: The right arm.
        step: The step towards the door.
        run_up_start: Lowest and highest y of the CoM at the start of a run-up, in odom [m].
        soles: ``left`` and ``right``: (x_min, x_max, y_min, y_max) [m] in the sole's frame.
        feet: ``left`` and ``right``: link and joint names.
        contact_link: Link whose origin is the middle of the body that hits the door.
        contact_radius: Radius of that body [m].
        hand_link: Link at the middle of the right hand.
        braced_posture: Right arm's joint angles during the hit [rad].
        braced_joints: Joints that the brace relieves.
        urdf_path: The URDF file.
        hand_radius: Radius of the hand [m]; None: of the URDF's collision sphere.
        clearance: That bodies keep from each other and from the leaf [m].
        disabled_collisions: Pairs of links that are not kept apart, as an SRDF's of that name.
        gear_ratio: Motor turns per joint turn [-].
        rotor_inertia: Rotor inertia at the motor [kg m^2].
        rotor_link: For each joint named, ``child`` or ``parent``: the link on which a simulation
            without rotors puts the inertia of the joint's.
        motor_encoder_counts: Counts of a motor's encoder a motor turn.
        servo_time_constant: Of the decay of a servo's position error [s].
        sole_rubber: Rubber between an ankle and the floor.
        imu_frame: Link in which the IMU sits.
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
    feet: Mapping[str, Foot]
    contact_link: str
    contact_radius: float
    hand_link: str
    braced_posture: Mapping[str, float]
    braced_joints: tuple[str, ...]
    urdf_path: Path
    hand_radius: float | None = None
    clearance: float = 0.01
    disabled_collisions: tuple[tuple[str, str], ...] = ()
    gear_ratio: Array | None = None
    rotor_inertia: Array | None = None
    rotor_link: Mapping[str, str] | None = None
    motor_encoder_counts: int | None = None
    servo_time_constant: float | None = None
    sole_rubber: SoleRubber | None = None
    imu_frame: str | None = None

    @property
    def armature(self) -> Array:
        """Rotor inertia felt at the joint, gear^2 times rotor_inertia (J,) [kg m^2]; 0: unknown."""
        if self.gear_ratio is None or self.rotor_inertia is None:
            return np.zeros(len(self.joint_names))
        reflected: Array = self.gear_ratio**2 * self.rotor_inertia
        return reflected

    @property
    def joint_resolution(self) -> Array:
        """Joint angle of a count of the motor's encoder (J,) [rad]."""
        counts = needed(self.motor_encoder_counts, "motor_encoder_counts")
        resolution: Array = 2.0 * np.pi / (counts * needed(self.gear_ratio, "actuators"))
        return resolution

    def index(self, joint: str) -> int:
        """Return the joint's place in the (J,) arrays.

        Raises:
            RobotConfigError: If there is no such joint.
        """
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise RobotConfigError(
                "no such joint", value=joint, limit="a name of joint_names"
            ) from None

    def posture(self, joints: Mapping[str, float], base: Array | None = None) -> Array:
        """Return a (J,) posture [rad]: ``base`` (half-sitting by default) with some joints set."""
        angles = np.array(self.half_sitting if base is None else base, dtype=float)
        for joint, angle in joints.items():
            angles[self.index(joint)] = angle
        return angles


def needed(value: T | None, field: str) -> T:
    """Return the value of a field that robot.yaml may leave out, where it is needed after all.

    Raises:
        RobotConfigError: If it is left out.
    """
    if value is None:
        raise RobotConfigError(
            f"the robot's configuration lacks {field}, which this needs", limit=f"a field {field}"
        )
    return value
