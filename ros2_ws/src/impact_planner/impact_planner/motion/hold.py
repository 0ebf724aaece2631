"""The ending `hold`, section II.C.1: the arm goes out, catches the falling leaf and pushes it back.

The phase begins where the door turns round. By then the paper's robot has let go of the door
(constraint 4 of II.B), so the leaf falls back while the arm goes out; where it is met is computed
from eq. (1). The hand arrives with most of the leaf's speed, gives way, then pushes the leaf to
the desired angle, while the CoM leans against the closer's torque of eq. (12).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from door_model.door.door import Door
from door_model.motion.dynamics import follow_free
from door_model.motion.free_motion import FreeMotion
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
from impact_planner.motion.phase_plan import PhasePlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.settings import PlannerSettings

_NODES = 0.035  # postures are solved so often and a spline laid through them [s]
_REACH_TIMES = (0.6, 0.5, 0.7, 0.8, 1.0)  # tried in this order [s]
_NEARER, _NEARER_TRIES = 0.06, 4  # to the hinge, where the furthest spot does not do [m]
LATE = 0.12  # the leaf has fallen this much longer when the arm arrives: the peak is felt late [s]
_GIVE_WAY = 0.35  # from the hand's arrival to its rest [s]
_SPEED_SHARE = 0.8  # of the leaf's speed that the hand has when it arrives
_PUSH = 1.5  # from there to the desired angle [s]
_REST = 0.3  # at the desired angle [s]
_NEARLY_SHUT = math.radians(1.0)  # the hand would be caught in a door less open
_LEANS = (1.0, 0.5)  # of what keeps the ZMP where it was, tried where the legs do not reach
_PEAK_SPEED = 1.875  # of a minimum-jerk motion over its mean
_FURTHER = 30.0  # beyond an angle that cannot be held one is looked for that can [deg]
_PASSES = 2  # of base against arm: each moves the other a little


@dataclass(frozen=True)
class HoldTask:
    """What is to be held, and from where.

    Attributes:
        door: The door.
        width: Of the leaf [m].
        hinge: x and y in odom, (2,) [m].
        angle: Desired opening angle [rad].
        joints: At the end of the phase before, (30,) [rad].
        base: base_link there, (3,) [m].
        feet: Soles, (3,) each [m].
        force_limit: Largest force of the door on the hand [N].
        joint_share: Of the joints' speed limits that may be used.
        period: Of the motion's samples [s].
    """

    door: Door
    width: float
    hinge: Array
    angle: float
    joints: Array
    base: Array
    feet: dict[str, Array]
    force_limit: float
    joint_share: float
    period: float


@dataclass(frozen=True)
class Catch:
    """How the leaf is met.

    Attributes:
        reach: Time in which the arm goes out [s].
        angle: Of the leaf that the hand goes to [rad].
        speed: Of the hand along the leaf's arc at that time [rad/s], negative.
        lowest: Angle at which the hand comes to rest [rad].
    """

    reach: float
    angle: float
    speed: float
    lowest: float

    @property
    def duration(self) -> float:
        """Of the phase [s]."""
        return self.reach + _GIVE_WAY + _PUSH + _REST

    def angle_at(self, time: Array, final: float) -> Array:
        """Leaf angle that the hand follows from its arrival on, (N,) [rad]."""
        x = np.clip((time - self.reach) / _GIVE_WAY, 0.0, 1.0)
        way = x - 2.5 * x**4 + 3.0 * x**5 - x**6
        push = min_jerk(time - self.reach - _GIVE_WAY, _PUSH)
        return self.angle + self.speed * _GIVE_WAY * way + push * (final - self.lowest)


@dataclass(frozen=True)
class HoldPlan:
    """The phase `hold`.

    Attributes:
        phase: Its motion.
        load: The leaf's force on the hand.
        catch: How the leaf is met.
        hand: Where the hand is on the leaf.
        force: Largest force of the leaf on the hand while it is led [N].
    """

    phase: StandingPhase
    load: Load
    catch: Catch
    hand: HandOnLeaf
    force: float


def hold_task(
    known: KnownDoor,
    settings: PlannerSettings,
    hinge: Array,
    feet: dict[str, Array],
    angle: float,
    start: tuple[Array, Array],
) -> HoldTask:
    """The task for a door, as configured; `start`: joints (30,) [rad] and base_link (3,) [m]."""
    return HoldTask(
        known.door, known.width, hinge, angle, *start, feet, settings.hand_force_limit,
        settings.limit_share, settings.period)


def plan_hold(
    robot: RobotModel, task: HoldTask, check: Callable[[HoldPlan], PhasePlan]
) -> PhasePlan:
    """Plan the phase `hold`: the first way to meet the leaf that passes every check.

    Args:
        robot: The robot.
        task: What is to be held, and from where.
        check: Of a motion against the limits of joints, floor and bodies.

    Raises:
        AngleUnreachable: The arm does not reach, the force is too large, or the door is shut
            before the arm is there; the limit is the angle that can be held [rad].
        JointLimit: The arm would have to be faster than it is.
        PostureUnreachable: The legs do not reach, or bodies come too near to each other.
    """
    reach = ArmReach(robot)
    failure: DoorImpactError | None = None
    ways = ((*choice, lean) for choice in _choices(robot, reach, task) for lean in _LEANS)
    for catch, hand, lean in ways:
        try:
            force = _require_force(task, catch, hand)
            motion, load = _whole_body(robot, reach, task, catch, hand, lean)
            phase = StandingPhase("hold", motion, task.feet, SIDES)
            return check(HoldPlan(phase, load, catch, hand, force))
        except (AngleUnreachable, JointLimit, PostureUnreachable) as error:
            failure = failure or error  # of the choice that was wanted most
    raise failure or _unreachable(robot, task)


def can_hold(robot: RobotModel, task: HoldTask) -> bool:
    """Whether the arm reaches the leaf in time and bears the closer's force; no motion is made."""

    def bearable(catch: Catch, hand: HandOnLeaf) -> bool:
        try:
            _require_force(task, catch, hand)
        except AngleUnreachable:
            return False
        return True

    if float(task.door.restoring_torque(task.angle)) <= 0.0:
        return False  # it would not fall back on the hand
    return any(bearable(*choice) for choice in _choices(robot, ArmReach(robot), task, 1))


def _require_force(task: HoldTask, catch: Catch, hand: HandOnLeaf) -> float:
    """Largest force of the leaf on the hand while it is led [N]."""
    angles = np.linspace(catch.lowest, task.angle, 20)
    force = float(np.max(task.door.restoring_torque(angles))) / hand.radius
    if force > task.force_limit:
        raise AngleUnreachable(
            f"the closer would press with {force:.1f} N on the hand {hand.radius:.2f} m from the "
            f"hinge, {task.force_limit:.1f} N are allowed",
            quantity="hand force [N]",
            value=force,
            limit=task.force_limit,
        )
    return force


def _catch(fall: FreeMotion, reach: float) -> Catch | None:
    """Where the falling leaf is when the arm arrives; None if it is shut by then."""
    if fall.end_time[0] < reach + LATE:
        return None
    theta, omega = fall.at(np.array([reach + LATE]))
    angle, speed = float(theta[0, 0]), _SPEED_SHARE * float(omega[0, 0])
    lowest = angle + 0.5 * speed * _GIVE_WAY
    return None if lowest < _NEARLY_SHUT else Catch(reach, angle, speed, lowest)


def _choices(
    robot: RobotModel,
    reach: ArmReach,
    task: HoldTask,
    tries: int = _NEARER_TRIES,
) -> Iterator[tuple[Catch, HandOnLeaf]]:
    """Ways to meet the leaf, the hand furthest from the hinge first, then nearer spots."""
    fall = follow_free(task.door, task.angle, 0.0, until=max(_REACH_TIMES) + LATE + 1e-6)
    catches = [catch for duration in _REACH_TIMES if (catch := _catch(fall, duration)) is not None]
    furthest = dict.fromkeys(range(len(catches)), reach.furthest(task.width))
    for _ in range(tries):
        for i, radius in list(furthest.items()):
            catch = catches[i]
            travel = task.joint_share * robot.speed_limit[reach.columns] * catch.reach / _PEAK_SPEED
            # The hand gives way: its elbow is nearest to the leaf where that comes to rest.
            leaf = (LeafFrame(task.hinge, catch.lowest), LeafFrame(task.hinge, task.angle))
            hand = reach.choose(task.base, task.joints, leaf, radius, travel)
            if hand is None:
                del furthest[i]
                continue
            yield catch, hand
            furthest[i] = hand.radius - _NEARER  # a less stretched arm


def _unreachable(robot: RobotModel, task: HoldTask) -> AngleUnreachable:
    """The error that names the nearest angles that can be held, if there are any."""
    tries = np.radians(np.arange(2.0, math.degrees(task.angle) + _FURTHER, 2.0))
    tries = tries[tries < task.door.closer.opening_limit() - 0.02]
    sides = (tries[tries < task.angle][::-1], tries[tries > task.angle])
    nearest = [
        next((float(angle) for angle in side if can_hold(robot, replace(task, angle=angle))), None)
        for side in sides
    ]
    known = [angle for angle in nearest if angle is not None]
    named = " and ".join(
        f"{where} about {math.degrees(angle):.0f} deg"
        for where, angle in zip(("up to", "from"), nearest, strict=True) if angle is not None)
    return AngleUnreachable(
        f"the hand cannot catch the door and hold it at {math.degrees(task.angle):.1f} deg"
        + (f"; it can {named}" if named else ", and at no angle near by"),
        quantity="desired_opening_angle [rad]",
        value=task.angle,
        limit=min(known, key=lambda angle: abs(angle - task.angle), default=0.0),
    )


def _whole_body(
    robot: RobotModel,
    reach: ArmReach,
    task: HoldTask,
    catch: Catch,
    hand: HandOnLeaf,
    lean_share: float,
) -> tuple[Motion, Load]:
    time = sample_times(catch.duration, _NODES)
    angles = catch.angle_at(time, task.angle)

    def pressing(when: Array) -> Array:
        """Force of the leaf on the hand, (N, 3) [N]."""
        at = catch.angle_at(when, task.angle)
        torque = np.where(when >= catch.reach, task.door.restoring_torque(at), 0.0)
        return -(torque / hand.radius)[:, None] * LeafFrame(task.hinge, at).normal

    # Lean against the force that is there at the end, so that the ZMP stays where it was.
    lean = -lean_share * pressing(time[-1:])[0, :2] * hand.height / (robot.mass * GRAVITY)
    com = robot.com(robot.configuration(task.base, task.joints))[:2]
    com_xy = com + min_jerk(time, catch.reach + _GIVE_WAY)[:, None] * lean
    first = int(np.argmax(time >= catch.reach))
    targets = LeafFrame(task.hinge, angles[first:]).point(
        hand.radius, hand.height, reach.hand_radius)
    # Between the two postures that were chosen, so that the course is smooth.
    way = max(task.angle - catch.lowest, 1e-9)
    part = ((angles - catch.lowest) / way)[first:, None]
    arc = hand.nearest + part * (hand.final - hand.nearest)
    whole, bases = np.tile(task.joints, (len(time), 1)), np.tile(task.base, (len(time), 1))
    for _ in range(_PASSES):
        whole[:, reach.columns] = _with_way_out(task.joints[reach.columns], time, arc)
        whole, bases = solve(
            robot, upper=whole, com_xy=com_xy, waist_z=float(task.base[2]), feet=task.feet,
            near=bases)
        arc = reach.follow(bases[first:], task.joints, arc, targets)
        _require_followed(arc, angles[first:], time[first:])
    whole[:, reach.columns] = _with_way_out(task.joints[reach.columns], time, arc)
    dense = sample_times(catch.duration, task.period)
    motion = rest_to_rest(time, whole, bases, dense)
    point = robot.hand_chain.place(motion.joints, motion.base).end
    return motion, Load(point, pressing(dense))


def _require_followed(arc: Array, angles: Array, time: Array) -> None:
    """Check that the arm (N, A) [rad] stays with the leaf at angles [rad] and times [s], (N,)."""
    lost = np.flatnonzero(np.isnan(arc[:, 0]))
    if lost.size:
        i = int(lost[0])
        at, kept = float(angles[i]), float(angles[max(i - 1, 0)])
        raise AngleUnreachable(
            f"the arm loses the leaf at {math.degrees(at):.1f} deg, {time[i]:.2f} s after "
            f"the door has turned round; it follows to {math.degrees(kept):.1f} deg",
            quantity="leaf angle [rad]",
            value=at,
            limit=kept,
        )


def _with_way_out(start: Array, time: Array, arc: Array) -> Array:
    """The arm from `start` (A,) in joint space to its course along the leaf's arc, (N, A) [rad]."""
    first = len(time) - len(arc)
    step = float(time[1] - time[0])
    # One-sided, second order: speed and acceleration with which the arc is entered.
    a, b, c, d = arc[:4]
    speed = (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / (6.0 * step)
    curve = (2.0 * a - 5.0 * b + 4.0 * c - d) / step**2
    still, end = np.zeros_like(start), time[first]
    out = quintic(start, still, still, a, speed * end, curve * end**2)
    return np.vstack([np.vander(time[:first] / end, 6, increasing=True) @ out, arc])
