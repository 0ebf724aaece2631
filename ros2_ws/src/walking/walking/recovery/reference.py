"""The state of a walk's reference at any time, also in the middle of a step.

It follows from the joints that the driver's spline has at that time, with the standing sole at its
place. A plan that begins in this state joins the motion with equal positions, velocities and
accelerations, whatever the plan before it was made of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel

from walking.footsteps.footstep import Pose, Stance, as_array, other, wrapped
from walking.pattern.course import Course, central
from walking.pattern.timing import Phase
from walking.pattern.walk_plan import WalkPlan
from walking.pattern.whole_body import feet_ahead, twist

_STEP = 0.002  # step of the central differences [s]


@dataclass(frozen=True)
class ReferenceState:
    """Where the reference is and how it moves, at one time.

    Each course has one sample without an axis for it: value, speed and acceleration.

    Attributes:
        stance: Poses of the soles; that of a swing foot is the one before its step.
        swing: Foot in the air; empty in double support.
        com: x and y of the CoM in odom, (2,) [m].
        foot: x, y, z [m] and yaw [rad] of the swing foot in odom, (4,); the standing foot's own
            pose if there is none.
        waist: Height of base_link, () [m].
        upper: Joints without the twist of the chest, (J,) [rad].
    """

    stance: Stance
    swing: str
    com: Course
    foot: Course
    waist: Course
    upper: Course


def phase_at(plan: WalkPlan, time: float) -> Phase:
    """Return the phase of a plan at a time since its beginning [s]; the last one after its end."""
    sample = time / plan.schedule.period
    return next((phase for phase in plan.schedule.phases if sample < phase.last - 1e-6),
                plan.schedule.phases[-1])


def reference_at(robot: RobotModel, plan: WalkPlan, time: float, chest_swing: float,
                 ) -> ReferenceState:
    """Compute the state of a plan's reference.

    Args:
        robot: The robot.
        plan: The plan.
        time: Time since its beginning [s]; after its end it rests.
        chest_swing: Turn of the chest per distance between the feet in the plan [rad/m].
    """
    phase = phase_at(plan, time)
    swing = phase.swing if phase.kind == "single" else ""
    standing = other(swing) if swing else "left"
    joints = Course(*(rows[0] for rows in plan.knots.at(time)))
    rows = joints.around(_STEP)
    places = np.array([
        _placed(robot, row, standing, phase.stance.foot(standing)) for row in rows])
    # Columns: CoM x, y; height of base_link; its heading; x, y, z, yaw of the other sole.
    apart = places[:, 4:6] - as_array(phase.stance.foot(standing))[:2]
    if standing == "left":
        apart = -apart
    ahead = feet_ahead(apart, places[:, 3])
    upper = rows.copy()
    twist(robot, upper, -chest_swing * ahead)
    course = central(places, _STEP)
    return ReferenceState(
        phase.stance, swing, _columns(course, slice(0, 2)), _columns(course, slice(4, 8)),
        _columns(course, 2), central(upper, _STEP))


def _columns(course: Course, which: slice | int) -> Course:
    return Course(*(rows[which] for rows in course))


def _placed(robot: RobotModel, joints: Array, side: str, sole: Pose) -> Array:
    """Place the upright robot on one sole: CoM, base_link, and the other sole, (8,)."""
    q = robot.configuration(np.zeros(3), joints)
    com = robot.com(q)[:2]
    feet = {}
    for foot in SIDES:
        place, turn = robot.frame_pose(q, robot.feet[foot].frame)
        feet[foot] = (place, math.atan2(turn[1, 0], turn[0, 0]))
    place, yaw = feet[side]
    base_yaw = sole.yaw - yaw
    cos, sin = math.cos(base_yaw), math.sin(base_yaw)

    def moved(x: float, y: float) -> tuple[float, float]:
        x, y = x - place[0], y - place[1]
        return sole.x + cos * x - sin * y, sole.y + sin * x + cos * y

    free, free_yaw = feet[other(side)]
    free_x, free_y = moved(free[0], free[1])
    return np.array([
        *moved(com[0], com[1]), -place[2], base_yaw, free_x, free_y, free[2] - place[2],
        sole.yaw + wrapped(free_yaw - yaw)])
