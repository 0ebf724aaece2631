"""Conversions between messages and the library of passages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from door_impact_msgs.action import WalkThroughDoor
from door_impact_msgs.msg import DoorPassagePlan, ImpactPlan
from door_impact_msgs.srv import PlanDoorPassage
from door_model.door.config import DoorConfig
from door_model.door.door import Door
from humanoid_motion.leaf import LeafFrame
from trajectory_msgs.msg import JointTrajectory
from walking.errors import HitNotPlanned, InvalidGoal, NoDoor
from walking.footsteps.footstep import Stance
from walking.passing.approach import Site
from walking.passing.doorway import Doorway
from walking.passing.held import Hold
from walking.passing.passage import PassagePlan

from motion_execution.ros.messages import ODOM, footsteps_message
from motion_execution.walk.passage import Passage
from motion_execution.walk.reaching import Reaching
from motion_execution.walk.walk import Outcome

Result, Response = WalkThroughDoor.Result, PlanDoorPassage.Response
CAUGHT = ("post", "hold", "retreat")
"""Phases of the hit in which the hand catches the leaf."""

_CODES = {  # of the action and of the service, by the reason of an error
    "invalid_goal": (Result.INVALID_GOAL, Response.INVALID_REQUEST),
    "no_door": (Result.NO_PLAN, Response.NO_DOOR),
    "hit_not_planned": (Result.NO_PLAN, Response.NO_HIT),
    "not_ready": (Result.NOT_READY, Response.NOT_READY),
    "stopped": (Result.STOPPED, Response.NOT_READY),
    "fell": (Result.FELL, Response.NOT_READY),
    "bad_door_pose": (Result.BAD_DOOR_POSE, Response.NOT_READY),
    "not_reached": (Result.NOT_REACHED, Response.NOT_READY),
}
_ENDS = {Outcome.SUCCESS: Result.NONE, Outcome.STOPPED: Result.STOPPED, Outcome.FELL: Result.FELL,
         Outcome.NOT_FOLLOWED: Result.DRIVER_REFUSED, Outcome.NO_CONTACT: Result.NO_CONTACT,
         Outcome.LEAF_LOST: Result.LEAF_LOST}
_MEASURED = ("time_to_clear", "hit_to_clear", "release_angle", "largest_hand_force",
             "largest_leaf_error", "start_time", "contact_time", "peak_angle", "held_angle")
_EVERY = 0.05  # time between two of the plan's values [s]
_NARROWEST, _WIDEST = math.radians(1.0), math.radians(100.0)  # angles that may be asked for [rad]


def codes(error: DoorImpactError) -> tuple[int, int]:
    """Return the error codes of the action and of the service for an error before the passage."""
    return _CODES.get(error.reason, (Result.PASSAGE_INFEASIBLE, Response.PASSAGE_INFEASIBLE))


def end_code(motion: Passage | Reaching) -> int:
    """Return the action's error code of a motion that has ended."""
    return int(_ENDS[motion.outcome])


def without_numbers() -> Any:
    """Return a result in which nothing was measured."""
    return Result(**dict.fromkeys(_MEASURED, math.nan))


def require_angles(message: Any) -> None:
    """Check the angles of a goal or a request.

    Raises:
        InvalidGoal: One is no number, or out of its range.
    """
    for name in ("hit_angle", "leaf_angle"):
        value = getattr(message, name)
        if not (value < 0.0 or _NARROWEST <= value <= _WIDEST):
            raise InvalidGoal(quantity=f"{name} [rad]", value=value,
                              limit=f"{_NARROWEST:.3f} to {_WIDEST:.3f}, or negative")


def last_posture(trajectory: JointTrajectory, names: Sequence[str]) -> Array | None:
    """Read where a trajectory ends, (J,) [rad]; None if it does not say that of every joint.

    Args:
        trajectory: The trajectory.
        names: Names of the joints in the robot's order.
    """
    if not trajectory.points:
        return None
    given = dict(zip(trajectory.joint_names, trajectory.points[-1].positions, strict=False))
    joints = np.array([given.get(name, math.nan) for name in names])
    return joints if np.isfinite(joints).all() else None


def hold_of(
    plan: ImpactPlan, names: Sequence[str], config: DoorConfig | None, identified: Door | None,
    site: Site,
) -> Hold:
    """Read how a hit is planned to end.

    Args:
        plan: The hit's plan, with its trajectories.
        names: Names of the joints in the robot's order.
        config: The configured door, for its leaf and frame.
        identified: Dynamics of the door; None takes the configured ones.
        site: Where the hit begins; the plan is as seen from its soles.

    Raises:
        HitNotPlanned: The plan does not end with a held leaf, or a number of it makes no sense.
        NoDoor: Nothing is known of the frame of the plan's door.
    """
    if config is None or config.frame is None or config.name != plan.door:
        raise NoDoor(
            f"nothing is known of the frame of the door {plan.door!r}: the parameter door " + (
                "is empty" if config is None else
                f"names the door {config.name!r}" if config.frame is not None else
                "names a file without a frame"), quantity="door", value=plan.door)
    last = next((phase.trajectory for phase in plan.phases if phase.name == "hold"), None)
    joints = None if last is None else last_posture(last, names)
    left, right, point = (site.soles.moved(each.x, each.y) for each in (
        plan.left_foot.position, plan.right_foot.position, plan.contact_point))
    along = LeafFrame(np.zeros(2), plan.initial_angle).along
    hinge = np.array(point[:2]) - plan.l_b * along[:2]
    numbers = [*hinge, *left, *right, plan.held_angle]
    if joints is None or not np.isfinite(numbers).all():
        raise HitNotPlanned(
            f"the hit of plan {plan.plan_id!r} does not end with a held leaf, or a number of it "
            "is not finite", quantity="plan_id", value=plan.plan_id)
    return Hold(identified or config.door(), Doorway(hinge, config.leaf, config.frame),
                plan.held_angle, Stance(left, right), joints, site.axes)


def plan_message(
    plan: PassagePlan, hold: Hold, plan_id: str, door: str, stamp: Any
) -> DoorPassagePlan:
    """Convert a passage to its message.

    Args:
        plan: The passage.
        hold: What it begins with.
        plan_id: Its identifier.
        door: Name of the door.
        stamp: Time of the planning, a builtin_interfaces/Time.
    """
    known = plan.walk.motion.time
    time = np.arange(0.0, plan.walk.duration, _EVERY)
    force = np.interp(time, known, np.linalg.norm(plan.hand_force, axis=1))
    near, beside, mine = plan.leaf_clearance, plan.frame_clearance, plan.self_clearance
    message = DoorPassagePlan(
        plan_id=plan_id, door=door,
        footsteps=footsteps_message(hold.in_odom(plan.walk.footsteps), stamp).footsteps,
        times=time.tolist(), leaf_angle=plan.push.at(time).tolist(),
        hand_force=np.where(time <= plan.push.release, force, 0.0).tolist(),
        hand_radius=np.interp(time, known, plan.hand_radius).tolist(),
        release_time=plan.push.release, clear_time=plan.clear, duration=plan.walk.duration,
        leaf_clearance=near.distance, leaf_body=near.bodies[0],
        frame_clearance=beside.distance, frame_body=beside.bodies[0],
        self_clearance=mine.distance, self_bodies=", ".join(mine.bodies),
        zmp_margin=float(plan.walk.checks.margin.min()), planning_time=plan.planning_time)
    message.header.stamp, message.header.frame_id = stamp, ODOM
    return message
