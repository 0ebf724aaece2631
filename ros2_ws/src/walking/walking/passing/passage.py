"""Plans the whole passage: footsteps, the leaf's course, the arm, and the whole body over them."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import TypeVar

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from hrp2_description.robot import needed
from humanoid_motion.clearance import CLEARANCE, Clearance
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import min_jerk_course
from humanoid_motion.robot_model import RobotModel
from scipy.interpolate import CubicSpline

from walking.errors import PLANNING_ERRORS, PassageInfeasible
from walking.footsteps.footstep import OUTWARD, Footstep, Stance, other, stances
from walking.footsteps.rectangles import Rectangle
from walking.passing.arm_course import ArmCourse, ArmTask, even_nodes
from walking.passing.checks import clearances, require_over_threshold
from walking.passing.felt import felt, hand_place
from walking.passing.leaf_push import LeafPush
from walking.passing.passage_task import PassageTask
from walking.passing.route import Route, plan_route, step_limits
from walking.passing.settings import PassageSettings, Way
from walking.passing.tempo import UNLIMITED, nearly_holds, timed
from walking.passing.yielding import yielded
from walking.pattern.checks import FRICTION, require_friction
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import resting
from walking.pattern.timing import Schedule
from walking.pattern.walk_plan import WalkPlan

_Force = Callable[[Array], Array]  # of times (N,) [s], returns forces (N, 3) [N]
_Choice = TypeVar("_Choice")
_Plan = TypeVar("_Plan")

_PASSES = 2  # iterations of walk and arm, which move each other a little
_MOST_PASSES = 3  # of those where the arm's last change lets the soles slip a little
_MORE = 0.008  # by how much the elbow keeps more distance from the leaf than it must [m]
_OFF = 0.005  # largest distance of the planned hand from its place on the face [m]
_PRESSING = 0.5  # time in which the hand begins to press as planned [s]
_EDGE = 0.02  # smallest part of the leaf beyond the hand [m]
_LETS_GO = 0.1  # time from the last needed step's touchdown to the release [s]
_PRESSES = 0.15  # smallest force of the hand on the leaf, as a share of that of the leaf at rest
_LATER = 0.1  # step in which a leaf that would run ahead of the hand arrives later [s]
_AWAY = 0.04  # largest distance of the hand from the leaf at the beginning [m]
_BEHIND = 0.08  # and of its commanded place behind the leaf's face, to which drives yield [m]
_TUCK = 1.35  # shortest time in which the free arm is tucked in [s]


@dataclass(frozen=True)
class PassagePlan:
    """A passage. Times count from its beginning.

    Attributes:
        walk: The walk with the arm's motion.
        pattern: Settings of the walk, and of its end before a later step.
        route: Its footsteps up to the place that is clear of wall and leaf.
        push: The leaf's course.
        hand_force: Force of the leaf on the hand at the walk's knots, axes of odom, (N, 3) [N].
        hand_radius: Distance of the hand from the hinge at the knots, (N,) [m].
        clear: Time at which the robot is clear [s].
        leaf_clearance: Body that comes nearest to the leaf, without the holding hand and forearm.
        frame_clearance: Body that comes nearest to frame and wall, without these two.
        self_clearance: The two bodies of the robot that come nearest to their limit.
        planning_time: Processor time of the planning [s].
        way: What of the settings the search chose.
    """

    walk: WalkPlan
    pattern: WalkSettings
    route: Route
    push: LeafPush
    hand_force: Array
    hand_radius: Array
    clear: float
    leaf_clearance: Clearance
    frame_clearance: Clearance
    self_clearance: Clearance
    planning_time: float
    way: Way


def plan_passage(
    robot: RobotModel, task: PassageTask, settings: PassageSettings | None = None,
    before: PassagePlan | None = None,
) -> PassagePlan:
    """Plan the passage with the first leaf angle, route and gait that keep every limit.

    Args:
        robot: The robot.
        task: The door to pass.
        settings: Settings; None means the defaults.
        before: A passage of the same door, whose way is tried first.

    Raises:
        PassageInfeasible: Opening, reach or force forbid the passage.
        WalkingError: The walk cannot be made; the error is that of the first combination.
        HumanoidMotionError: A leg does not reach, a joint exceeds a limit, or bodies come too near
            to each other.
    """
    begin, task = clock.process_time(), felt(robot, task)
    wanted = settings or PassageSettings.of(robot)
    _require_on_leaf(robot, task)
    if before is not None:
        wanted = wanted.beginning_with(before.way)
    shoulder = _shoulder(robot)

    @cache
    def route(angle: float, wider: Rectangle) -> Route:
        return plan_route(
            robot.config, task.doorway, task.stance, task.angle, angle, shoulder,
            wanted.widened(wider))

    tried = wanted.tried(_pressing(task, wanted), held=task.measured is not None)
    plan = _first(lambda each: _over_a_route(robot, task, each, route), tried)
    return replace(plan, planning_time=clock.process_time() - begin)


def _over_a_route(
    robot: RobotModel, task: PassageTask, settings: PassageSettings,
    route: Callable[[float, Rectangle], Route],
) -> PassagePlan:
    """Plan a passage over the first route on which the bodies keep their distances."""
    def at_angle(angle: float) -> PassagePlan:
        failed: list[Route] = []
        first: DoorImpactError | None = None
        for wider in settings.wider:
            steps = route(angle, wider)
            if steps in failed:
                continue  # more room has not changed the footsteps
            failed.append(steps)
            try:
                return _with_a_gait(robot, task, settings, steps, (angle, wider))
            except PLANNING_ERRORS as error:
                first = first or error
                if error.quantity != CLEARANCE:
                    break  # more room is no help
        assert first is not None, "no width is tried"
        raise first

    held = task.measured is not None
    return _first(
        at_angle, [angle for angle in settings.leaf_angles if angle > task.angle],
        # It is the first steps that slip, and a robot that holds the leaf has no time to waste.
        unless=lambda error: held and error.quantity == FRICTION)


def _with_a_gait(
    robot: RobotModel, task: PassageTask, settings: PassageSettings, route: Route,
    chosen: tuple[float, Rectangle],
) -> PassagePlan:
    """Plan a passage over a route with the first gait in which the legs can make the steps.

    Args:
        chosen: The leaf's angle [rad] and the wider body that the route was found with.
    """
    return _first(
        lambda gait: _Attempt(robot, task, settings, route, Way(*chosen, gait)).plan(),
        settings.gaits,
        # No gait leads past an obstacle, or spares the soles the moment of the leaf.
        unless=lambda error: error.quantity in (CLEARANCE, FRICTION))


def _first(
    attempt: Callable[[_Choice], _Plan], among: Iterable[_Choice],
    unless: Callable[[DoorImpactError], bool] = lambda error: False,
) -> _Plan:
    """Return the first result without an error.

    Args:
        attempt: Function that raises one of `PLANNING_ERRORS` where there is no plan.
        among: Its arguments, in the order of preference.
        unless: Whether an error makes the other arguments hopeless.

    Raises:
        DoorImpactError: That of the first argument, or the one that made the others hopeless.
    """
    first: DoorImpactError | None = None
    for each in among:
        try:
            return attempt(each)
        except PLANNING_ERRORS as error:
            if unless(error):
                raise
            first = first or error
    if first is None:
        raise PassageInfeasible("the leaf is open farther than the robot would open it")
    raise first


def _require_on_leaf(robot: RobotModel, task: PassageTask) -> None:
    """Check that the hand is on the leaf's face, or commanded to a place not far behind it."""
    leaf = LeafFrame(task.doorway.hinge, task.angle)
    away = float(leaf.gap(hand_place(robot, task.joints, task))) - robot.hand_radius
    if not -_BEHIND <= away <= _AWAY:
        raise PassageInfeasible(
            f"the hand does not hold the leaf at {math.degrees(task.angle):.1f} deg: it is "
            f"{1e3 * away:.0f} mm in front of its face, {-1e3 * _BEHIND:.0f} to "
            f"{1e3 * _AWAY:.0f} mm are allowed", quantity="hand from the leaf [m]", value=away,
            limit=_AWAY if away > 0.0 else -_BEHIND)


def _shoulder(robot: RobotModel) -> Array:
    """x and y of the right shoulder seen from the middle between the soles, (2,) [m]."""
    q = robot.configuration(np.zeros(3), robot.config.half_sitting)
    soles = [robot.frame_position(q, foot.frame) for foot in robot.feet.values()]
    pose = robot.hand_chain.place(robot.config.half_sitting[None], np.zeros((1, 3)))
    first = int(np.flatnonzero(robot.hand_chain.columns == robot.arm_columns[0])[0])
    return np.asarray(pose.origins[0, first, :2] - np.mean(soles, axis=0)[:2])


def _pressing(task: PassageTask, settings: PassageSettings) -> float:
    """Return the force of the held leaf on the hand [N]."""
    return max(0.0, float(task.door.restoring_torque(task.angle)) / settings.hand_radius)


class _Attempt:
    """One combination of a route and a gait."""

    def __init__(
        self, robot: RobotModel, task: PassageTask, settings: PassageSettings, route: Route,
        way: Way,
    ) -> None:
        self._robot, self._task, self._settings = robot, task, settings
        self._route, self._way = route, way
        self._walk = replace(settings.walk(robot, way.gait, _pressing(task, settings)),
                             limits=step_limits(robot.config))
        if task.doorway.threshold is not None:
            self._walk = replace(self._walk, lift=settings.lift_over)
        steps = list(route.footsteps)
        self._steps = [*steps, _closing(robot, task.stance, steps)]
        self._state = resting(robot, task.stance, task.joints, self._walk)
        self._arm = ArmCourse(robot)

    def plan(self) -> PassagePlan:
        """Plan walk and arm in turns, and check what came out."""
        robot, settings = self._robot, self._settings
        steps, knots = self._steps, None
        radius = CubicSpline([0.0, 1.0], [settings.hand_radius] * 2)
        for number in range(1, _MOST_PASSES + 1):
            def force_in(times: Schedule, radius: CubicSpline = radius) -> _Force:
                return self._force(self._push(times), radius)

            steps, walk = timed(robot, self._state, steps, self._walk, settings.durations,
                                force_in, knots)
            push = self._push(walk.schedule)
            radius, knots = self._upper(walk, push, radius)
            if number < _PASSES:
                continue
            force = self._force(push, radius)
            walk = plan_walk(robot, self._state, steps, replace(self._walk, friction=UNLIMITED),
                             upper=knots, hand_force=force, clearance=False)
            if not nearly_holds(walk, self._walk.friction, settings.durations):
                break
        require_friction(walk.checks.friction, walk.motion.time, self._walk.friction)
        return self._checked(walk, push, force(walk.motion.time), radius(walk.motion.time))

    def _force(self, push: LeafPush, radius: CubicSpline) -> _Force:
        """Return the function of times (N,) [s] that gives the leaf's force, (N, 3) [N]."""
        def force(time: Array) -> Array:
            held = np.minimum(time, push.release)  # later there is no force, whatever the angle
            normal = LeafFrame(self._task.doorway.hinge, push.at(held)).normal
            return np.asarray(-(push.torque(time) / radius(time))[:, None] * normal)

        return force

    def _push(self, times: Schedule) -> LeafPush:
        """The leaf arrives when the route wants it there, and is let go when the robot is clear.

        It arrives later where the hand would have to pull it back. The hand lets go while both feet
        stand: its course begins to leave the leaf a node earlier.
        """
        route, task = self._route, self._task
        last = float(route.leaf[-1])
        arrived = int(np.argmax(route.leaf >= last - 1e-9)) + 1
        push = LeafPush(
            task.door, task.angle, last, begin=0.2 * times.begin_of(0),
            end=times.begin_of(arrived), release=times.touchdown_of(route.clear - 1) + _LETS_GO)
        while push.pulls(_PRESSES) and push.end + _LATER < push.release:
            push = replace(push, end=push.end + _LATER)
        return push

    def _upper(
        self, walk: WalkPlan, push: LeafPush, before: CubicSpline
    ) -> tuple[CubicSpline, Knots]:
        """The hand's distance from the hinge, and knots of the upper body.

        Args:
            walk: The walk without these knots.
            push: The leaf's course.
            before: The hand's distance from the hinge over time, as far as it is known [m].
        """
        robot, task, settings = self._robot, self._task, self._settings
        motion, rows = walk.motion, even_nodes(walk.motion)
        time = motion.time[rows]
        yaw = motion.base_yaw
        leaf = LeafFrame(task.doorway.hinge, push.at(time))
        holds, hand = time <= push.release, robot.hand_radius
        radii = settings.nearest, task.doorway.leaf.width - _EDGE - hand
        within = yielded(time, push.torque(time) / before(time), settings)
        arm_task = ArmTask(
            time=time, joints=motion.joints[rows], base=motion.base[rows],
            yaw=np.zeros(len(rows)) if yaw is None else yaw.angle[rows], leaf=leaf, holds=holds,
            gap=hand - within,
            radii=radii, radius=min(settings.hand_radius, radii[1]), heights=settings.hand_heights,
            others=(robot.config.contact_radius + settings.clearance + _MORE,
                    robot.config.contact_radius),
            comfortable=robot.config.half_sitting[self._arm.columns])
        start = task.joints[self._arm.columns]
        begins = float(self._arm.gap(arm_task, np.tile(start, (len(rows), 1)))[0])
        # A hand that yields resists a sudden change of its commanded place with its damping.
        rest = 1.0 - min_jerk_course(time, _PRESSING)[0]
        arm_task = replace(arm_task, gap=arm_task.gap + rest * (begins - arm_task.gap))
        arm = self._arm.solve(arm_task, start)
        off = np.abs(self._arm.gap(arm_task, arm) - arm_task.gap)[holds & (time > _PRESSING)]
        worst = int(np.argmax(off))
        if off[worst] > _OFF:
            raise PassageInfeasible(
                f"the hand would be {1e3 * off[worst]:.0f} mm from its place on the leaf, "
                f"{1e3 * _OFF:.0f} mm are allowed", quantity="hand on the leaf [m]",
                value=float(off[worst]), limit=_OFF)
        radius = CubicSpline(time, self._arm.radius(arm_task, arm).clip(settings.nearest, None))
        return radius, self._knots(time, arm)

    def _knots(self, time: Array, arm: Array) -> Knots:
        """Knots of the upper body: the right arm as found, the left one tucked in."""
        task, config = self._task, self._robot.config
        whole = np.tile(self._state.upper.value, (len(time), 1))
        speed, bend = np.zeros_like(whole), np.zeros_like(whole)
        way = config.posture(config.tucked_posture, task.joints) - task.joints
        # 1.875 is the peak speed of a course of minimum jerk, for a way of 1 in a time of 1.
        fastest = self._walk.speed_share * self._robot.speed_limit
        within = max(_TUCK, float((1.875 * np.abs(way) / fastest).max()))
        for rows, course in zip((whole, speed, bend), min_jerk_course(time, within), strict=True):
            rows += way * course[:, None]
        return self._arm.knots(time, arm, Knots(time, whole, speed, bend))

    def _checked(
        self, walk: WalkPlan, push: LeafPush, force: Array, radius: Array
    ) -> PassagePlan:
        robot, settings, doorway = self._robot, self._settings, self._task.doorway
        require_over_threshold(
            robot.config, doorway, walk, self._walk.lift, settings.over_threshold)
        found = clearances(robot, doorway, walk.motion, push.at(walk.motion.time),
                           settings.clearance, settings.forearm)
        return PassagePlan(
            walk=walk, pattern=replace(self._walk, required_margin=settings.stop_margin),
            route=self._route, push=push, hand_force=force, hand_radius=radius,
            clear=walk.touchdown_of(self._route.clear - 1), leaf_clearance=found.leaf,
            frame_clearance=found.frame, self_clearance=found.robot, planning_time=math.nan,
            way=self._way)


def _closing(robot: RobotModel, stance: Stance, steps: list[Footstep]) -> Footstep:
    """The step that brings the feet beside each other."""
    side = other(steps[-1].side)
    after = stances(stance, steps)[-1]
    width = needed(robot.config.footsteps, "footsteps").width
    x, y, yaw = after.foot(other(side)).moved(0.0, OUTWARD[side] * width)
    return Footstep(side, x, y, yaw, steps[-1].duration)
