"""Conversions between messages and the library of passages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_msgs.action import WalkThroughDoor
from door_impact_msgs.msg import DoorPassagePlan
from door_impact_msgs.srv import PlanDoorPassage
from geometry_msgs.msg import PoseWithCovarianceStamped
from walking.errors import BadDoorPose, InvalidFootsteps
from walking.footsteps.footstep import Pose
from walking.passing.approach import require_found

from motion_execution.mission.passing import Passed
from motion_execution.mission.ways import Wanted, Way
from motion_execution.ros.hit_messages import probe_of
from motion_execution.ros.walk_messages import ODOM, floor_pose, footsteps_message

Result, Response = WalkThroughDoor.Result, PlanDoorPassage.Response

_ANSWERS = {  # error code of the service, by the reason of an error
    "invalid_goal": Response.INVALID_REQUEST, "no_door": Response.NO_DOOR,
    "hit_not_planned": Response.NO_HIT, "passage_infeasible": Response.PASSAGE_INFEASIBLE,
    "humanoid_motion": Response.PASSAGE_INFEASIBLE,
}
_NO_PLAN = ("no_door", "hit_not_planned")  # reasons for which the action has one code
_MEASURED = ("time_to_clear", "hit_to_clear", "release_angle", "largest_hand_force",
             "largest_leaf_error", "start_time", "contact_time", "peak_angle", "held_angle")
_EVERY = 0.05  # time between two of the plan's values [s]
_ROWS = np.ix_((0, 1, 5), (0, 1, 5))  # of x, y and the turn about z in a message's covariance


def codes(error: DoorImpactError) -> tuple[int, int]:
    """Return the error codes of the action and of the service for an error."""
    name = "no_plan" if error.reason in _NO_PLAN else error.reason
    action = getattr(Result, name.upper(), Result.PASSAGE_INFEASIBLE)
    of_service = action == Result.PASSAGE_INFEASIBLE
    return int(action), int(_ANSWERS.get(
        error.reason, Response.PASSAGE_INFEASIBLE if of_service else Response.NOT_READY))


def wanted_from(message: Any) -> Wanted:
    """Read a goal of the action, or a request of the service, which has fewer fields.

    Raises:
        GoalRefused: `probe` is none of the action's constants.
    """
    goal = {} if isinstance(message, PlanDoorPassage.Request) else {
        "walk_up": message.walk_up, "probe": probe_of(message.probe),
        "speed_scale": message.speed_scale, "dry_run": message.dry_run}
    return Wanted(message.hit_angle, message.leaf_angle, message.run_up, message.opening, **goal)


def result_message(passed: Passed, now: float) -> Any:
    """Convert what has become of a passage to the action's result, without its plan.

    Args:
        passed: What has become of it.
        now: Time of the robot's clock [s].
    """
    result = Result(**dict.fromkeys(_MEASURED, math.nan))
    hit, passage = passed.hit, passed.passage
    if hit is not None and hit.measured.contact_sensor:
        for name in ("contact_time", "peak_angle", "held_angle"):
            setattr(result, name, getattr(hit.measured, name))
    if passage is not None:
        cleared, watch = passage.cleared(now), passage.watch
        result.steps, result.start_time = passage.steps_made(now), now - passage.since(now)
        result.time_to_clear = cleared - passed.began
        result.hit_to_clear = cleared - passed.contact_time
        result.release_angle = passage.release_angle
        result.largest_hand_force = watch.largest_force
        result.largest_leaf_error = watch.largest_error
    return result


def door_pose(
    message: PoseWithCovarianceStamped, along: float, world: str = ODOM
) -> Pose:
    """Read a door's pose in odom.

    Args:
        message: The message.
        along: Distance from the hinge at which the leaf is touched [m].
        world: Name of the frame odom.

    Raises:
        BadDoorPose: The pose is in another frame, tilted, no number, or too uncertain.
    """
    frame = message.header.frame_id
    if frame.lstrip("/") != world:
        raise BadDoorPose(quantity="frame of door_pose", value=frame, limit=world)
    try:
        pose = floor_pose(message.pose.pose, "door_pose")
    except InvalidFootsteps as error:
        raise BadDoorPose(str(error), quantity=error.quantity, value=error.value) from error
    covariance = np.reshape(message.pose.covariance, (6, 6))
    require_found(covariance[_ROWS], pose.yaw, along)
    return pose


def plan_message(
    way: Way, number: int, stamp: Any, world: str = ODOM, *, trajectories: bool = True
) -> DoorPassagePlan:
    """Convert a passage to its message.

    Args:
        way: The way through the door with the passage.
        number: Number of the plan.
        stamp: Time of the planning, a builtin_interfaces/Time.
        world: Name of the frame odom.
        trajectories: Whether footsteps and lists are in it.
    """
    plan, hold = way.passage, way.hold
    near, beside, mine = plan.leaf_clearance, plan.frame_clearance, plan.self_clearance
    message = DoorPassagePlan(
        plan_id=f"passage-{number}", door=way.door, opening=way.opening.way,
        opening_reason=way.opening.reason,
        release_time=plan.push.release, clear_time=plan.clear, duration=plan.walk.duration,
        leaf_clearance=near.distance, leaf_body=near.bodies[0],
        frame_clearance=beside.distance, frame_body=beside.bodies[0],
        self_clearance=mine.distance, self_bodies=", ".join(mine.bodies),
        zmp_margin=float(plan.walk.checks.margin.min()), planning_time=plan.planning_time)
    message.header.stamp, message.header.frame_id = stamp, world
    if trajectories:
        known, time = plan.walk.motion.time, np.arange(0.0, plan.walk.duration, _EVERY)
        force = np.interp(time, known, np.linalg.norm(plan.hand_force, axis=1))
        message.footsteps = footsteps_message(hold.in_odom(plan.walk.footsteps), stamp).footsteps
        message.times, message.leaf_angle = time.tolist(), plan.push.at(time).tolist()
        message.hand_force = np.where(time <= plan.push.release, force, 0.0).tolist()
        message.hand_radius = np.interp(time, known, plan.hand_radius).tolist()
    return message
