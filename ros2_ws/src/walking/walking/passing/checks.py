"""Checks of a planned passage: distances of the bodies, and of the feet from a threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig
from humanoid_motion.clearance import Clearance, LeafCourse, bodies_of, require_clearance
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel

from walking.errors import PassageInfeasible
from walking.passing.doorway import Doorway
from walking.pattern.swing import feet_courses
from walking.pattern.walk_plan import WalkPlan

_NAME = "passage"
_NEARER = 0.003  # by how much a body may come nearer to the leaf than it is in the beginning [m]


@dataclass(frozen=True)
class PassageClearances:
    """What comes nearest to something in a passage.

    Attributes:
        leaf: Body that comes nearest to the leaf, without the holding hand and forearm.
        frame: Body that comes nearest to frame and wall, without these two.
        robot: The two bodies of the robot that come nearest to their limit.
    """

    leaf: Clearance
    frame: Clearance
    robot: Clearance


def clearances(
    robot: RobotModel, doorway: Doorway, motion: Motion, angle: Array, clearance: float,
    forearm: float,
) -> PassageClearances:
    """Check the distances of the bodies from each other, from leaf, and from frame and wall.

    Args:
        robot: The robot.
        doorway: Leaf and wall.
        motion: The motion.
        angle: Opening angle of the leaf at its samples, (N,) [rad].
        clearance: Smallest distance of bodies that do not hold the leaf from leaf and frame [m].
        forearm: That of the forearm from leaf and frame, and of the hand from the frame [m].

    Raises:
        HumanoidMotionError: Bodies come too near.
    """
    bodies = bodies_of(robot)
    mine = bodies.self_clearance(motion, robot.config.clearance)
    require_clearance(mine, _NAME)
    leaf = LeafCourse(doorway.hinge, angle, doorway.leaf.width, thickness=doorway.leaf.thickness)
    arm, hand = holding_links(robot)
    holding = {*arm, *hand}
    others = set(bodies.links) - holding

    def from_leaf(limit: float, may_touch: set[str]) -> Clearance:
        # The arm that holds the leaf may be nearer to it in the beginning than a body comes later.
        first = bodies.leaf_clearance(motion, leaf, limit, may_touch=may_touch, until=0.0)
        found = bodies.leaf_clearance(
            motion, leaf, min(limit, first.distance - _NEARER), may_touch=may_touch)
        require_clearance(found, _NAME)
        return found

    near = from_leaf(clearance, holding)
    from_leaf(forearm, others | {*hand})
    obstacles = doorway.obstacles()
    beside = bodies.frame_clearance(motion, obstacles, clearance, may_touch=holding)
    require_clearance(beside, _NAME)
    require_clearance(
        bodies.frame_clearance(motion, obstacles, forearm, may_touch=others), _NAME)
    return PassageClearances(near, beside, mine)


def require_over_threshold(
    robot: RobotConfig, doorway: Doorway, walk: WalkPlan, lift: float, required: float
) -> None:
    """Check how high the soles are above a threshold while they swing over it.

    Args:
        lift: Height of the swing foot in the middle of a step [m].
        required: Smallest distance of a sole from the threshold, above it and beside it [m].

    Raises:
        PassageInfeasible: A sole comes nearer.
    """
    if doorway.threshold is None:
        return
    stance = walk.schedule.phases[0].stance
    height = doorway.threshold.center[2] + doorway.threshold.half[2]
    for side, course in feet_courses(robot, walk.schedule, walk.footsteps, stance, lift).items():
        beside = doorway.threshold_gaps(robot.soles[side], course.value[:, [0, 1, 3]])
        above = course.value[:, 2] - height
        nearest = float(np.maximum(beside, above).min())
        if nearest < required:
            raise PassageInfeasible(
                f"the {side} sole comes as near as {1e3 * nearest:.0f} mm to the threshold of "
                f"{1e3 * height:.0f} mm, {1e3 * required:.0f} mm are required",
                quantity="sole from the threshold [m]", value=nearest, limit=required)


def holding_links(robot: RobotModel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Links of the hitting arm's forearm, and those of its hand with the wrist."""
    model, config = robot.model, robot.config
    elbow = config.arm.joints.index(config.arm.elbow)
    first, wrist = (model.getJointId(config.arm.joints[at]) for at in (elbow, elbow + 1))

    def beyond(joint: int) -> set[str]:
        return {frame.name for frame in model.frames
                if joint in list(model.supports[int(frame.parentJoint)])}

    return tuple(sorted(beyond(first) - beyond(wrist))), tuple(sorted(beyond(wrist)))
