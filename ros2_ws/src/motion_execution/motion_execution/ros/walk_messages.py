"""Conversions between messages and the walk's library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from builtin_interfaces.msg import Duration
from door_impact_common.errors import DoorImpactError
from door_impact_common.palette import BLUE, ORANGE
from door_impact_common.stamps import seconds
from door_impact_msgs.action import Walk as WalkAction
from door_impact_msgs.msg import Footstep as FootstepMessage
from door_impact_msgs.msg import Footsteps
from door_model.door.geometry import before
from geometry_msgs.msg import Point, PoseStamped, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from hrp2_description.robot import SIDES, RobotConfig
from visualization_msgs.msg import Marker, MarkerArray
from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import Footstep, Pose, other

from motion_execution.walk.goal import WalkGoal

ODOM = "odom"
Result = WalkAction.Result
_UPRIGHT = 0.05  # largest tilt of a pose on the floor [rad], and error of a quaternion's length
_THICK = 0.004  # height of a footstep's marker [m]
_COLOURS = {"left": BLUE, "right": ORANGE}
_BAD = ("invalid_footsteps", "setting")  # reasons of errors that are the goal's own


def error_code(error: DoorImpactError) -> int:
    """Return the action's error code of an error before the walk."""
    if error.reason in _BAD:
        return int(Result.INVALID_GOAL)
    return int(getattr(Result, error.reason.upper(), Result.INFEASIBLE))


def goal_from(message: Any, hinge: str = "right", world: str = ODOM) -> WalkGoal:
    """Read a goal of the action; before a door hinged at the left its mirror image.

    Raises:
        InvalidFootsteps: A number is not finite, a pose is not on the floor or in another frame, or
            a foot is neither left nor right.
    """
    frame = message.goal.header.frame_id
    if frame.lstrip("/") not in ("", world):
        raise InvalidFootsteps(
            f"the goal is in the frame {frame!r}, must be in {world!r}",
            quantity="frame_id", value=frame, limit=world)
    if not (math.isfinite(message.step_duration)):
        raise InvalidFootsteps(quantity="step_duration [s]", value=message.step_duration,
                               limit="a finite number")
    steps = []
    for number, step in enumerate(message.footsteps, start=1):
        where = f"footstep {number}"
        steps.append(Footstep(step.side, *floor_pose(step.pose, where), step.duration))
    pose = Pose(0.0, 0.0, 0.0) if steps else floor_pose(message.goal.pose, "the goal")
    if hinge == "left":
        pose = Pose(*before(hinge, pose))
        steps = [Footstep(other(step.side), *before(hinge, step.pose), step.duration)
                 if step.side in SIDES else step for step in steps]
    return WalkGoal(pose, tuple(steps), message.keep_heading, message.step_duration)


def floor_pose(message: Any, what: str) -> Pose:
    """Read a pose on the floor; its height does not matter.

    Raises:
        InvalidFootsteps: A number is not finite, or the pose is tilted.
    """
    place, turn = message.position, message.orientation
    numbers = (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
    if not all(map(math.isfinite, numbers)):
        raise InvalidFootsteps(f"{what} has a value that is no number: {numbers}",
                               quantity=what, value=numbers, limit="finite numbers")
    length = math.hypot(turn.x, turn.y, turn.z, turn.w)
    if abs(length - 1.0) > _UPRIGHT:
        raise InvalidFootsteps(
            f"the orientation of {what} has the length {length:.3g}, must be a unit quaternion",
            quantity=f"orientation of {what}", value=length, limit=1.0)
    tilt = math.hypot(turn.x, turn.y)
    if 2.0 * tilt > _UPRIGHT:
        raise InvalidFootsteps(
            f"{what} is tilted by {2.0 * tilt:.2f} rad: only x, y and a turn about z are possible",
            quantity=f"tilt of {what} [rad]", value=2.0 * tilt, limit=_UPRIGHT)
    yaw = 2.0 * math.atan2(turn.z, turn.w)
    return Pose(place.x, place.y, math.remainder(yaw, 2.0 * math.pi))


def pose_message(pose: Pose, z: float = 0.0) -> PoseMessage:
    """Convert a pose on the floor at a height [m]."""
    return PoseMessage(
        position=Point(x=pose.x, y=pose.y, z=z),
        orientation=Quaternion(z=math.sin(0.5 * pose.yaw), w=math.cos(0.5 * pose.yaw)))


def stamped(pose: Pose, stamp: Any, world: str = ODOM) -> PoseStamped:
    """Convert a pose on the floor to a PoseStamped in odom."""
    message = PoseStamped(pose=pose_message(pose))
    message.header.stamp, message.header.frame_id = stamp, world
    return message


def footsteps_message(
    footsteps: Sequence[Footstep], stamp: Any, world: str = ODOM
) -> Footsteps:
    """Convert footsteps to the message of /footsteps."""
    message = Footsteps(footsteps=[
        FootstepMessage(side=step.side, pose=pose_message(step.pose), duration=step.duration)
        for step in footsteps])
    message.header.stamp, message.header.frame_id = stamp, world
    return message


def footstep_markers(
    robot: RobotConfig, footsteps: Sequence[Footstep], stamp: Any, world: str = ODOM
) -> MarkerArray:
    """Draw footsteps as their soles on the floor; earlier ones are removed."""
    clear = Marker(action=Marker.DELETEALL)
    clear.header.stamp, clear.header.frame_id = stamp, world
    array = MarkerArray(markers=[clear])
    for number, step in enumerate(footsteps):
        x_min, x_max, y_min, y_max = robot.soles[step.side]
        middle = step.pose.moved(0.5 * (x_min + x_max), 0.5 * (y_min + y_max))
        marker = Marker(ns="footsteps", id=number, type=Marker.CUBE, action=Marker.ADD,
                        pose=pose_message(middle, 0.5 * _THICK), lifetime=Duration())
        marker.header.stamp, marker.header.frame_id = stamp, world
        marker.scale.x, marker.scale.y, marker.scale.z = x_max - x_min, y_max - y_min, _THICK
        red, green, blue = bytes.fromhex(_COLOURS[step.side][1:])
        marker.color.r, marker.color.g, marker.color.b = red / 255, green / 255, blue / 255
        marker.color.a = 0.6
        array.markers.append(marker)
    return array


def base_pose(message: Any, base: str, prefix: str = "") -> tuple[float, Pose] | None:
    """Read stamp [s] and pose of the base in odom from a TFMessage, as seen from above, if any.

    Args:
        message: The message.
        base: Name of the robot's root link.
        prefix: What precedes the names of both frames.
    """
    for each in message.transforms:
        if (each.child_frame_id, each.header.frame_id) == (prefix + base, prefix + ODOM):
            place, q = each.transform.translation, each.transform.rotation
            yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y**2 + q.z**2))
            pose = Pose(place.x, place.y, yaw)
            stamp = seconds(each.header.stamp)
            return (stamp, pose) if all(map(math.isfinite, pose)) else None
    return None
