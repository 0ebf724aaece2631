"""The hand goes to the closed leaf: a motion of the robot that stands before it on both feet.

The arm extends to a place in front of the surveyed leaf, then the hand goes slowly on, to a place
behind its surveyed face. It meets the leaf wherever the survey errs by less than these distances;
who executes the motion ends it there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from humanoid_motion.clearance import LeafCourse, bodies_of, require_clearance
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import min_jerk_course
from humanoid_motion.robot_model import RobotModel

from walking.errors import PassageInfeasible
from walking.footsteps.footstep import Stance
from walking.passing.arm_course import ArmCourse, ArmTask, even_nodes
from walking.passing.checks import holding_links
from walking.passing.doorway import Doorway
from walking.passing.settings import PassageSettings
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import standing
from walking.pattern.walk_plan import WalkPlan

_NAME = "reach"
_EXTENDS = 2.0  # time in which the arm extends [s]
_SEEKS = 2.5  # time in which the hand looks for the leaf [s]
_FRONT = 0.05  # distance from the surveyed face at which that begins [m]
_BEHIND = 0.025  # distance behind it at which it ends [m]
_PASSES = 2  # iterations of the standing body and the arm, which move each other a little
_OFF = 0.005  # largest distance of the planned hand from its place [m]


@dataclass(frozen=True)
class Reach:
    """A motion of the hand to the closed leaf.

    Attributes:
        walk: The motion, a walk without footsteps.
        pattern: Settings of this walk.
        radius: Distance of the hand from the hinge at the end [m].
    """

    walk: WalkPlan
    pattern: WalkSettings
    radius: float


def plan_reach(
    robot: RobotModel, doorway: Doorway, stance: Stance, settings: PassageSettings
) -> Reach:
    """Plan the hand's motion to the closed leaf from half-sitting.

    Args:
        robot: The robot.
        doorway: Leaf and wall.
        stance: The soles.
        settings: Settings of the passage that follows.

    Raises:
        PassageInfeasible: The hand does not reach the leaf.
        WalkInfeasible: The ZMP would come too near to the edge of the soles.
        HumanoidMotionError: A joint exceeds a limit, a leg does not reach, or bodies come too near
            to each other, to the leaf or to the frame.
    """
    pattern = WalkSettings.of(robot, start=_EXTENDS, end=_SEEKS, friction=settings.friction,
                              waist_height=robot.standing_height)
    state, course = standing(robot, stance), ArmCourse(robot)
    upper, hand, config = state.upper.value, robot.hand_radius, robot.config
    walk = plan_walk(robot, state, [], pattern, clearance=False)
    for _ in range(_PASSES):
        motion, rows = walk.motion, even_nodes(walk.motion)
        time, count = motion.time[rows], len(rows)
        rise, _, _ = min_jerk_course(time - _EXTENDS, walk.duration - _EXTENDS)
        yaw = motion.base_yaw
        task = ArmTask(
            time=time, joints=motion.joints[rows], base=motion.base[rows],
            yaw=np.zeros(count) if yaw is None else yaw.angle[rows],
            leaf=LeafFrame(doorway.hinge, np.zeros(count)), holds=time >= _EXTENDS,
            gap=hand + _FRONT - (_FRONT + _BEHIND) * rise,
            radii=(settings.nearest, doorway.leaf.width - hand),
            radius=settings.hand_radius, heights=settings.hand_heights,
            others=(config.contact_radius + settings.clearance, config.contact_radius),
            comfortable=config.half_sitting[course.columns])
        arm = course.solve(task, upper[course.columns])
        off = float(np.abs(course.gap(task, arm) - task.gap)[task.holds].max())
        if not off <= _OFF:
            raise PassageInfeasible(
                f"the hand does not reach the closed leaf: it would be {1e3 * off:.0f} mm from its "
                f"place, {1e3 * _OFF:.0f} mm are allowed", quantity="hand before the leaf [m]",
                value=off, limit=_OFF)
        still = Knots(time, np.tile(upper, (count, 1)), *np.zeros((2, count, len(upper))))
        walk = plan_walk(robot, state, [], pattern, upper=course.knots(time, arm, still))
    bodies, angle = bodies_of(robot), np.zeros(len(walk.motion))
    leaf = LeafCourse(doorway.hinge, angle, doorway.leaf.width, thickness=doorway.leaf.thickness)
    require_clearance(bodies.leaf_clearance(
        walk.motion, leaf, settings.forearm, may_touch=holding_links(robot)[1]), _NAME)
    require_clearance(bodies.frame_clearance(
        walk.motion, doorway.obstacles(), settings.forearm), _NAME)
    return Reach(walk, pattern, float(course.radius(task, arm)[-1]))
