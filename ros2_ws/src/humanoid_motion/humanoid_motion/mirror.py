"""Reflection of what a robot does and measures: a door hinged at its left is one at its right.

All mathematics is written for a door hinged at the robot's right. Before a door hinged at the left
the robot does the mirror image of what it would do there. The mirror is the plane x = 0 of odom, so
that y is opposite to the push on both sides of it: who stands before a door hinged at the left
faces -x, and his image faces x. In a frame of the robot, such as base_link or a sole, the mirror is
the plane y = 0, in an IMU's frame that of base_link. Each reflection is its own inverse.

The image has the robot's own masses. HRP-2's CoM is 1.5 mm to the left in half-sitting, so a ZMP is
3 mm from where it is planned.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from door_impact_common.documents import Vector
from hrp2_description.drives_and_pads import Pad
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import RobotConfig
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.driver_interface import TickSample
from humanoid_motion.pinocchio_model import FLIP, find_twins, free_floating_model
from humanoid_motion.samples import ImuSample

AnyPad = TypeVar("AnyPad", bound=Pad)
OTHER = {"left": "right", "right": "left"}
# What the fields of messages are, by name.
_AXIAL = ("torque", "angular", "angular_velocity")
_OF_JOINTS = ("position", "velocity", "effort", "positions", "velocities", "accelerations")
_TORQUES = {"gear_torque": "joint", "motor_impulse": "joint", "brace_impulse": "brace_joint",
            "foot_yaw_impulse": ""}  # by the field with the joint's name; empty: about z
_CHOSEN = ("door", "plan_id", "hinge")  # texts that name nothing of the robot
_PLAIN = ("Time", "Duration")
_CACHED = 1024  # number of texts that are kept: each joint state has 30 names
_WORD = re.compile(r"\w+")
_WORLD = np.array([-1.0, 1.0, 1.0])
_WRENCH = np.concatenate([FLIP, -FLIP])


def places(values: ArrayLike) -> Array:
    """Return the images of positions, velocities or forces in odom, (..., 2) or (..., 3)."""
    values = np.asarray(values, dtype=float)
    return np.asarray(values * _WORLD[: values.shape[-1]])


def headings(values: ArrayLike) -> Array:
    """Return the images of headings in odom [rad]."""
    return np.asarray(np.pi - np.asarray(values, dtype=float))


def orientations(values: ArrayLike) -> Array:
    """Return the images of orientations of the robot's frames in odom, (..., 4) x, y, z, w."""
    x, y, z, w = np.moveaxis(np.asarray(values, dtype=float), -1, 0)
    return np.stack([-y, -x, w, z], axis=-1)


def wrenches(values: ArrayLike) -> Array:
    """Return the images of forces and torques in frames of the robot, (..., 6) [N, N m]."""
    return np.asarray(np.asarray(values, dtype=float) * _WRENCH)


class Straight:
    """Robot and door as they are, with the door hinged at the robot's right."""

    def message(self, message: Any) -> Any:
        """Return a message from one side as the other side has it."""
        return message

    def text(self, text: str) -> str:
        """Return a text, or a topic, from one side as the other side has it."""
        return text


class Mirror(Straight):
    """The reflection of one robot.

    Args:
        config: Configuration of the robot.

    Raises:
        RobotConfigError: The robot has no mirror image, or half-sitting is not symmetric.
    """

    def __init__(self, config: RobotConfig) -> None:
        model, names = free_floating_model(config), list(config.joint_names)
        twin, sign = find_twins(model)
        numbers = [model.getJointId(name) for name in names]
        self._index: NDArray[np.int_] = np.array([numbers.index(each) for each in twin[numbers]])
        self._sign = sign[numbers]
        self._signs = dict(zip(names, self._sign.tolist(), strict=True))
        ends = {f"{side}_{end}": f"{other}_{end}"
                for side, other in OTHER.items() for end in ("foot", "wrist")}
        self._twins = OTHER | ends | {
            frame.name: other.name for frame in model.frames for other in model.frames
            if other.type == frame.type and other.parentJoint == twin[frame.parentJoint]
            and np.allclose(other.placement.translation, FLIP * frame.placement.translation)}
        self._texts = lru_cache(_CACHED)(
            lambda text: _WORD.sub(lambda word: self._twins.get(word[0], word[0]), text))
        # From a frame in which the mirror is y = 0 to the IMU's, where that is another plane.
        self._imu = np.eye(3)
        if config.imu_frame is not None:
            frame, data = model.getFrameId(config.imu_frame), model.createData()
            pin.framesForwardKinematics(model, data, pin.neutral(model))
            turn = np.array(data.oMf[frame].rotation)
            self._imu = FLIP[:, None] * (turn.T @ (FLIP[:, None] * turn))
            carrier = model.frames[frame].parentJoint
            if twin[carrier] != carrier:
                raise RobotConfigError("imu_frame is fixed to a limb and has no mirror image",
                                       value=model.names[carrier], limit="a link of the trunk")
        off = float(np.abs(self.joints(config.half_sitting) - config.half_sitting).max())
        if off > 0.0:
            raise RobotConfigError("half_sitting is not symmetric [rad]", value=off, limit=0.0)

    def joints(self, values: ArrayLike) -> Array:
        """Return the images of angles, speeds or torques of the joints, (..., J)."""
        return np.asarray(np.asarray(values, dtype=float)[..., self._index] * self._sign)

    def text(self, text: str) -> str:
        """Return a text with each joint, link and side replaced by its twin."""
        return self._texts(text)

    def message(self, message: Any) -> Any:
        """Return the image of a message about robot and door, field by field.

        Points and poses are taken as those of odom, vectors as those of frames of the robot, and
        names of joints, links and sides in it become those of their twins.
        """
        image = self._image(message, np.ones(0))
        if type(message).__name__ == "Imu":
            turn = image.orientation
            turn.x, turn.y, turn.z, turn.w = self._reframed(
                [turn.x, turn.y, turn.z, turn.w]).tolist()
            for part in (image.angular_velocity, image.linear_acceleration):
                part.x, part.y, part.z = (self._imu.T @ [part.x, part.y, part.z]).tolist()
        return image

    def imu_sample(self, sample: ImuSample) -> ImuSample:
        """Return the image of an IMU's reading."""
        return ImuSample(self._reframed(orientations(sample.orientation)),
                         self._imu.T @ (-FLIP * sample.angular_velocity),
                         self._imu.T @ (FLIP * sample.specific_force))

    def _reframed(self, turn: ArrayLike) -> Array:
        return np.array((pin.Quaternion(np.asarray(turn)) * pin.Quaternion(self._imu)).coeffs())

    def _image(self, message: Any, signs: Array) -> Any:
        """Return the image of a message; the signs are those of the joints that it is about."""
        image, fields = type(message)(), message.get_fields_and_field_types()
        for name in ("name", "joint_names"):
            if fields.get(name) == "sequence<string>":
                signs = np.array([self._signs.get(each, 1.0) for each in getattr(message, name)])
        for name in fields:
            side, value = name.partition("_")[0], getattr(message, name)
            twin = name.replace(side, OTHER[side], 1) if side in OTHER else name
            setattr(image, twin if twin in fields else name, self._part(name, value, signs))
        for name, joint in _TORQUES.items():
            if name in fields:
                sign = self._signs.get(getattr(message, joint), 1.0) if joint else -1.0
                setattr(image, name, sign * getattr(message, name))
        return image

    def _part(self, name: str, value: Any, signs: Array) -> Any:
        """Return the image of a field's value."""
        kind = type(value).__name__
        if isinstance(value, str):
            return value if name in _CHOSEN else self.text(value)
        if kind == "Point":
            return type(value)(x=-value.x, y=value.y, z=value.z)
        if kind == "Vector3":
            sign = -1.0 if name in _AXIAL else 1.0
            return type(value)(x=sign * value.x, y=-sign * value.y, z=sign * value.z)
        if kind == "Quaternion":
            return type(value)(x=-value.y, y=-value.x, z=value.w, w=value.z)
        if kind in _PLAIN:
            return value
        if hasattr(value, "get_fields_and_field_types"):
            return self._image(value, signs)
        if name in _OF_JOINTS and len(value) == len(signs):
            return (signs * value).tolist()
        if isinstance(value, list):
            return [self._part(name, each, signs) for each in value]
        return value

    def sample(self, sample: TickSample) -> TickSample:
        """Return the image of the measurements of a tick; the door's counts stay."""
        hands = (None if hand is None else wrenches(hand)
                 for hand in (sample.right_hand_wrench, sample.left_hand_wrench))
        return TickSample(
            sample.time, self.joints(sample.position), self.joints(sample.velocity),
            self.joints(sample.effort), wrenches(sample.right_wrench),
            wrenches(sample.left_wrench), self.imu_sample(sample.imu), sample.counts, *hands)

    def left_armed(self, config: RobotConfig) -> RobotConfig:
        """Return the configuration of the robot as it is simulated when it hits with its left arm.

        What hits and what is braced change sides. Motions are planned with the right arm alone, so
        what only a planner needs does not change.

        Raises:
            RobotConfigError: No link of the other side is where `contact_link` is.
        """
        if self.text(config.contact_link) == config.contact_link:
            raise RobotConfigError("contact_link has no mirror image", value=config.contact_link,
                                   limit="a link at the mirrored place, or a frame there (frames)")
        posture, brace = config.braced_posture, config.brace
        return replace(
            config, contact_link=self.text(config.contact_link),
            braced_joints=tuple(map(self.text, config.braced_joints)),
            braced_posture={self.text(joint): self._signs[joint] * angle
                            for joint, angle in posture.items()},
            brace=brace and replace(
                brace, arm=self._pad(brace.arm), trunk=replace(
                    self._pad(brace.trunk), normal=_flipped(brace.trunk.normal))))

    def _pad(self, pad: AnyPad) -> AnyPad:
        return replace(pad, link=self.text(pad.link), place=_flipped(pad.place))


@lru_cache
def sight(config: RobotConfig, hinge: str) -> Straight:
    """Return how a robot sees itself and a door with its hinge at a side, left or right.

    Raises:
        RobotConfigError: The robot has no mirror image, and the hinge is at the left.
    """
    return Mirror(config) if hinge == "left" else Straight()


def _flipped(vector: Vector) -> Vector:
    x, y, z = vector
    return x, -y, z
