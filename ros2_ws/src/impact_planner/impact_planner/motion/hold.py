"""The ending `hold`, section II.C.1: the arm catches the closing leaf and pushes it back.

The phase begins at the door's peak. The robot has no contact with the door then (constraint 4 of
section II.B), so the leaf closes while the arm extends. `impact_planner.motion.catch` chooses where
and when they meet. While the hand pushes the leaf to the desired angle, the CoM leans against the
closer's torque of eq. (12).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import Load
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.knots import quintic
from humanoid_motion.motion import Motion, min_jerk, rest_to_rest
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import solve

from impact_planner.errors import AngleUnreachable
from impact_planner.hit.leaf import LeafFrame
from impact_planner.motion.approach import StandingPhase, sample_times
from impact_planner.motion.arm_reach import ArmReach, HandOnLeaf
from impact_planner.motion.catch import Catch, HoldTask, choices, require_force, unreachable
from impact_planner.motion.phase_plan import PhasePlan

_NODES = 0.035  # time between solved postures, which a spline connects [s]
# Shares of the lean that keeps the ZMP in place; the second is tried where the legs do not reach.
_LEANS = (1.0, 0.5)
_PASSES = 2  # iterations of base and arm, which move each other a little


@dataclass(frozen=True)
class HoldPlan:
    """The phase `hold` before its check.

    Attributes:
        phase: Motion and supporting feet.
        load: Force of the leaf on the hand.
        catch: Meeting of the hand with the leaf.
        hand: Spot of the hand on the leaf.
        force: Largest force of the leaf on the hand after the arrival [N].
    """

    phase: StandingPhase
    load: Load
    catch: Catch
    hand: HandOnLeaf
    force: float


def plan_hold(
    robot: RobotModel, task: HoldTask, check: Callable[[HoldPlan], PhasePlan]
) -> PhasePlan:
    """Plan the phase `hold`: the first candidate that passes every check.

    Args:
        robot: The robot.
        task: The door to hold, and the posture to start from.
        check: Function that checks a motion against the limits of joints, floor and bodies and
            returns it as a phase of the plan.

    Raises:
        AngleUnreachable: The arm does not reach, the force is too large, or the door is shut
            before the arm arrives. Where no candidate exists, the limit is the nearest angle that
            can be held [rad].
        JointLimit: A joint would be too fast or leave its range.
        PostureUnreachable: The legs do not reach, or bodies come too near to each other.
    """
    reach = ArmReach(robot)
    failure: DoorImpactError | None = None
    candidates = ((*choice, lean) for choice in choices(robot, reach, task) for lean in _LEANS)
    for catch, hand, lean in candidates:
        try:
            force = require_force(task, catch, hand)
            motion, load = _whole_body(robot, reach, task, catch, hand, lean)
            phase = StandingPhase("hold", motion, task.feet, SIDES)
            return check(HoldPlan(phase, load, catch, hand, force))
        except (AngleUnreachable, JointLimit, PostureUnreachable) as error:
            failure = failure or error  # keeps the error of the best candidate
    raise failure or unreachable(robot, task)


def _whole_body(
    robot: RobotModel,
    reach: ArmReach,
    task: HoldTask,
    catch: Catch,
    hand: HandOnLeaf,
    lean_share: float,
) -> tuple[Motion, Load]:
    """Whole-body motion of the phase, and the leaf's force on the hand.

    Args:
        robot: The robot.
        reach: Kinematics of the arm.
        task: The door to hold, and the posture to start from.
        catch: Meeting of the hand with the leaf.
        hand: Spot of the hand on the leaf and the arm's postures.
        lean_share: Share of the lean that keeps the ZMP in place.

    Raises:
        AngleUnreachable: The arm cannot follow the leaf.
        PostureUnreachable: The legs do not reach.
    """
    time = sample_times(catch.duration, _NODES)
    angles = catch.angle_at(time, task.angle)

    def pressing(when: Array) -> Array:
        """Force of the leaf on the hand at times (N,) [s], axes of odom, (N, 3) [N]."""
        at = catch.angle_at(when, task.angle)
        torque = np.where(when >= catch.reach, task.door.restoring_torque(at), 0.0)
        return -(torque / hand.radius)[:, None] * LeafFrame(task.hinge, at).normal

    # The CoM leans against the force at the end, so that the ZMP stays in place.
    lean = -lean_share * pressing(time[-1:])[0, :2] * hand.height / (robot.mass * GRAVITY)
    com = robot.com(robot.configuration(task.base, task.joints))[:2]
    com_xy = com + min_jerk(time, catch.at_rest)[:, None] * lean
    first = int(np.argmax(time >= catch.reach))
    targets = LeafFrame(task.hinge, angles[first:]).point(
        hand.radius, hand.height, reach.hand_radius)
    # The first guess interpolates between the two chosen postures, so that the course is smooth.
    opening = max(task.angle - catch.lowest, 1e-9)
    part = ((angles - catch.lowest) / opening)[first:, None]
    arc = hand.nearest + part * (hand.final - hand.nearest)
    whole, bases = np.tile(task.joints, (len(time), 1)), np.tile(task.base, (len(time), 1))
    for _ in range(_PASSES):
        whole[:, reach.columns] = _with_extension(task.joints[reach.columns], time, arc)
        whole, bases = solve(
            robot, upper=whole, com_xy=com_xy, waist_z=float(task.base[2]), feet=task.feet,
            near=bases)
        arc = reach.follow(bases[first:], task.joints, arc, targets)
        _require_followed(arc, angles[first:], time[first:])
    whole[:, reach.columns] = _with_extension(task.joints[reach.columns], time, arc)
    dense = sample_times(catch.duration, task.period)
    motion = rest_to_rest(time, whole, bases, dense)
    point = robot.hand_chain.place(motion.joints, motion.base).end
    return motion, Load(point, pressing(dense))


def _require_followed(arc: Array, angles: Array, time: Array) -> None:
    """Check that the arm follows the leaf.

    Args:
        arc: Joints of the arm, (N, A) [rad]; NaN where the hand does not reach.
        angles: Angles of the leaf, (N,) [rad].
        time: Times from the start of the phase, (N,) [s].

    Raises:
        AngleUnreachable: A posture is missing. Value and limit are the first angle out of reach
            and the last one within reach [rad].
    """
    lost = np.flatnonzero(np.isnan(arc[:, 0]))
    if lost.size:
        i = int(lost[0])
        at, kept = float(angles[i]), float(angles[max(i - 1, 0)])
        raise AngleUnreachable(
            f"the arm loses the leaf at {math.degrees(at):.1f} deg, {time[i]:.2f} s after the "
            f"door's peak, and follows it only to {math.degrees(kept):.1f} deg; request a smaller "
            "angle or the ending retreat",
            quantity="leaf angle [rad]",
            value=at,
            limit=kept,
            phase="hold",
        )


def _with_extension(start: Array, time: Array, arc: Array) -> Array:
    """The arm's course with its extension before the arc, (N, A) [rad].

    The extension is a quintic in joint space that meets the arc with equal speed and acceleration.

    Args:
        start: Joints of the arm at the start of the phase, (A,) [rad].
        time: Evenly spaced times of the phase, (N,) [s].
        arc: Joints of the arm on the leaf, at the last times, (M, A) [rad].
    """
    first = len(time) - len(arc)
    step = float(time[1] - time[0])
    # One-sided differences of the arc at its entry: speed of third order, acceleration of second.
    a, b, c, d = arc[:4]
    speed = (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / (6.0 * step)
    curve = (2.0 * a - 5.0 * b + 4.0 * c - d) / step**2
    still, end = np.zeros_like(start), time[first]
    out = quintic(start, still, still, a, speed * end, curve * end**2)
    return np.vstack([np.vander(time[:first] / end, 6, increasing=True) @ out, arc])
