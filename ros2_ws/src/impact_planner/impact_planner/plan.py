"""The planner's pipeline; like section II.C, it decides from the end of the motion to its start."""

from __future__ import annotations

import math
import time as clock
import zlib
from contextlib import suppress
from dataclasses import replace

import numpy as np
from door_impact_common.errors import DoorImpactError
from humanoid_motion.clearance import bodies_of
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import PLANNING_ERRORS, AngleUnreachable, SpeedUnreachable
from impact_planner.hit.door_prediction import DoorPrediction, predict
from impact_planner.hit.floor_load import require_no_slip
from impact_planner.hit.joint_load import overload_warnings, require_bearable
from impact_planner.hit.posture import LegDemands, capable, waist_per_com
from impact_planner.hit.stance import (
    DOOR_DISTANCE,
    SPARE_DISTANCE,
    STEP_SHARES,
    door_distances,
)
from impact_planner.hit.transfer import Blow, plan_blow
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.missed import inside_edge_for, needed_reserve
from impact_planner.motion.phases import Phases, plan_phases
from impact_planner.motion.run_up import HitDesign, plan_run_up
from impact_planner.task.experience import Experience
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, Task, resolve
from impact_planner.task.settings import PlannerSettings, make_settings

__all__ = ["ImpactPlan", "KnownDoor", "PlanRequest", "PlannerSettings", "plan_impact"]

# Factor on the speed that the legs must manage: a lower waist changes v_rB a little.
_SPEED_RESERVE = 1.005
# Shares of the way of the CoM that `missed_reserve` needs, tried in this order where the legs, or
# the ZMP of a shorter run-up, do not allow the whole way.
_INWARD_SHARES = (0.85, 0.7, 0.5, 0.25)
# As of HRP-2's height: least distance of the CoM inside the right sole's inner edge, the largest
# one, for a door that stands far away, and the step between places that are tried [m].
_INMOST, _OUTMOST, _EDGE_STEP = -0.06, 0.01, 0.01
_SPARE_RESERVE = 0.002  # further inside than needed, for a stance that turns out higher [m]
# Errors after which another step or another place of the CoM is tried.
_STEP_ERRORS = (AngleUnreachable, JointLimit, SpeedUnreachable, PostureUnreachable)
# Largest distance of B from the CoM along x without a warning, as of HRP-2's sole [m]; beyond it,
# yaw reduces the effective mass.
_LARGEST_OFFSET = 0.03
_ROUNDING = 5e-4  # error of the CoM's height that is not worth a warning [m]


def plan_impact(
    request: PlanRequest,
    known: KnownDoor,
    robot: RobotModel,
    settings: PlannerSettings | None = None,
) -> ImpactPlan:
    """Plan the whole motion that opens a door to an angle.

    Experience from earlier hits is set aside, and the plan's warnings say so, if it is outside the
    limits of what hits can teach, or if it alone makes the plan impossible.

    Args:
        request: Opening angle and further wishes.
        settings: Configuration; None means the robot's defaults.

    Returns:
        The plan with its trajectories.

    Raises:
        PlannerError: The request cannot be met. The error carries quantity, value and limit.
        HumanoidMotionError: The robot's joints, legs or balance do not allow the motion.
    """
    settings = settings or make_settings({}, robot)
    if known.experience is None:
        return _planned(request, known, robot, settings)
    bare = replace(known, experience=None)
    outside = known.experience.outside(settings.learning_limits)
    if outside:
        return _set_aside(_planned(request, bare, robot, settings), known.experience, outside)
    try:
        return _planned(request, known, robot, settings)
    except PLANNING_ERRORS as error:
        try:
            plan = _planned(request, bare, robot, settings)
        except PLANNING_ERRORS:
            raise error from None
        return _set_aside(plan, known.experience, str(error))


def _set_aside(plan: ImpactPlan, experience: Experience, why: str) -> ImpactPlan:
    """Return a plan that was made without the experience, with a warning that says why."""
    return replace(plan, warnings=(
        f"what {experience.hits} hits on this door have taught (restitution "
        f"{experience.restitution:.3f}, effective mass {experience.mass_factor:.3f} times the "
        f"model's) was set aside: {why}; forget_hits discards it", *plan.warnings))


def _planned(
    request: PlanRequest, known: KnownDoor, robot: RobotModel, settings: PlannerSettings
) -> ImpactPlan:
    """Plan with what is known of the door; errors as for `plan_impact`.

    Where the request leaves the door's place open, the nominal step is tried first and shorter
    steps after it. If all steps fail, the error of the nominal step is raised.
    """
    begin = clock.perf_counter()
    wanted = resolve(request, settings, known)
    task = Task(robot, known, wanted, settings)
    prediction = predict(known, wanted.angle, wanted.initial_angle)
    failure: DoorImpactError | None = None
    for share in STEP_SHARES if wanted.door_distance is None else (1.0,):
        try:
            hit, (phases, retreat, branches) = _motion(
                task, prediction, share * robot.config.step.nominal)
        except _STEP_ERRORS as error:
            failure = failure or error  # keeps the error of the nominal step
            continue
        return ImpactPlan(
            plan_id=_identity(task, hit),
            known=known,
            request=wanted,
            settings=settings,
            hit=hit,
            phases=phases,
            retreat=retreat,
            branches=branches,
            warnings=known.warnings + _warnings(robot, hit, branches.missed_margin),
            planning_time=clock.perf_counter() - begin,
        )
    assert failure is not None
    raise failure


def _motion(task: Task, prediction: DoorPrediction, step: float) -> tuple[HitDesign, Phases]:
    """Plan the hit, with the CoM as far inside as a missed contact needs and the motion allows.

    A door that stands too far away for `com_inside_edge` is met with the CoM further out.

    Args:
        prediction: Opening of the door.
        step: Length of the step that decides the place of the door where it is left open [m].

    Raises:
        PlannerError: The request cannot be met; the error is that of the configured place of the
            CoM, `com_inside_edge`, or of the nearest one that the legs reach.
        HumanoidMotionError: The robot's joints, legs or balance do not allow the motion.
    """
    robot, settings = task.robot, task.settings
    demands = LegDemands(beyond=settings.door_uncertainty + SPARE_DISTANCE)
    edge, first = _nearest_blow(task, prediction, demands, step)
    speed = _SPEED_RESERVE * first.v_run_up / waist_per_com(
        robot, first.stance.posture, first.stance.feet)
    needed = inside_edge_for(robot, first.stance.posture, speed, settings.overrun,
                             settings.missed_reserve + _SPARE_RESERVE)
    inward = max(0.0, edge - max(needed, _INMOST * robot.height_scale))
    # The speed is known only now; a posture with too fast joints is replaced by a lower one.
    demands = replace(demands, speed=speed, joint_speed=settings.limit_share * robot.speed_limit)

    def planned(inside: float) -> tuple[HitDesign, Phases]:
        blow = first
        if inside != edge or not capable(
                robot, first.stance.posture, first.stance.feet, demands):
            blow = plan_blow(_with_edge(task, inside), prediction, demands, step)
        hit = _design_hit(task, blow)
        return hit, plan_phases(task, hit)

    if inward > 0.0:
        with suppress(*_STEP_ERRORS):
            return planned(edge - inward)
    try:  # before more places are tried, what cannot be done at all is refused
        least = planned(edge)
    except (JointLimit, SpeedUnreachable):
        for outward in _outward(edge, robot.height_scale):
            with suppress(*_STEP_ERRORS):
                return planned(outward)
        raise
    except PostureUnreachable:  # a fast robot needs more way to come to rest after the hit
        for further in _inward(edge, robot.height_scale) if settings.missed_reserve >= 0.0 else ():
            with suppress(*_STEP_ERRORS):
                return planned(further)
        raise
    for share in _INWARD_SHARES if inward > 0.0 else ():
        with suppress(*_STEP_ERRORS):
            return planned(edge - share * inward)
    return least


def _nearest_blow(
    task: Task, prediction: DoorPrediction, demands: LegDemands, step: float
) -> tuple[float, Blow]:
    """Plan the blow at the place of the CoM nearest to `com_inside_edge` that the legs reach.

    Returns:
        Distance of the CoM inside the right sole's inner edge [m], and the blow.
    """
    configured, scale = task.settings.com_inside_edge, task.robot.height_scale
    edges = (configured, *_outward(configured, scale), *_inward(configured, scale))
    failure: DoorImpactError | None = None
    for edge in edges:
        try:
            return edge, plan_blow(_with_edge(task, edge), prediction, demands, step)
        except PostureUnreachable as error:
            failure = failure or error
    assert failure is not None
    if failure.quantity != DOOR_DISTANCE:
        raise failure
    near, far = door_distances(task.robot, min(edges), max(edges))
    raise PostureUnreachable(
        f"{failure}; a closed door must stand {near:.3f} to {far:.3f} m from the origin",
        quantity=failure.quantity, value=failure.value, limit=(near, far))


def _inward(edge: float, scale: float) -> list[float]:
    """Return places of the CoM further in than one [m]."""
    step, inmost = _EDGE_STEP * scale, _INMOST * scale
    return [*np.arange(edge - step, inmost, -step).tolist(), inmost]


def _outward(edge: float, scale: float) -> list[float]:
    """Return places of the CoM further out than one [m], for doors that stand farther away."""
    step = _EDGE_STEP * scale
    return np.arange(edge + step, _OUTMOST * scale + 1e-9, step).tolist()


def _with_edge(task: Task, edge: float) -> Task:
    return replace(task, settings=replace(task.settings, com_inside_edge=edge))


def _design_hit(task: Task, blow: Blow) -> HitDesign:
    """Complete a blow that floor and gears bear by its run-up, section II.C.4."""
    require_no_slip(blow.transfer.floor, task.settings.sole_friction)
    require_bearable(blow.transfer.loads)
    return HitDesign(**vars(blow), run_up=plan_run_up(task, blow.stance, blow.v_run_up))


def _warnings(robot: RobotModel, hit: HitDesign, missed: float) -> tuple[str, ...]:
    """Say what the plan does not achieve or check; `missed` is its `missed_margin` [m]."""
    posture = hit.stance.posture
    found = [*robot.config.doubts, *overload_warnings(hit.transfer.loads)]
    config = robot.config
    if config.brace is not None and config.drives is not None and (
            hit.transfer.response.pad_preload == 0.0):
        found.append("the braced posture does not press the pads of robot.yaml's brace on each "
                     "other: the hit is planned without them")
    if abs(posture.percussion_error) >= _ROUNDING:
        found.append(
            f"eq. (5) is not met within the legs' range: the CoM is "
            f"{1e3 * posture.percussion_error:+.0f} mm off the height of the center of percussion"
        )
    offset = float(posture.elbow[0] - posture.com[0])
    scale = config.sole_scale
    if abs(offset) > _LARGEST_OFFSET * scale:
        found.append(
            f"B is {1e3 * offset:+.0f} mm from the CoM along x, more than "
            f"{1e3 * _LARGEST_OFFSET * scale:.0f} mm: the hit turns the robot about the vertical"
        )
    unseen = bodies_of(robot).left_out
    if unseen or not bodies_of(robot).links:
        found.append(
            f"{', '.join(unseen) or 'every link'} has no collision shape: its clearance is not "
            "checked")
    if missed < 0.0:
        found.append(
            f"a robot that misses the door falls: the capture point would be {-1e3 * missed:.0f} "
            "mm beyond the soles when it begins to brake")
    elif missed < needed_reserve(config):
        found.append(
            f"a robot that misses the door may fall: the capture point would be only "
            f"{1e3 * missed:.0f} mm inside the soles when it begins to brake, "
            f"{1e3 * needed_reserve(config):.0f} mm are wanted")
    return tuple(found)


def _identity(task: Task, hit: HitDesign) -> str:
    """Name a plan by door, angle and a checksum of the numbers that decide the plan."""
    name, wanted = task.known.name, task.wanted
    numbers = (
        name, hit.prediction.omega, hit.transfer.speeds.v_rb, wanted.restitution,
        hit.transfer.mass, hit.contact.l_b, hit.stance.step, hit.run_up.y_start, wanted.angle,
        wanted.initial_angle, hit.placement.hinge_x,
    )  # fmt: skip
    return f"{name}-{math.degrees(wanted.angle):.1f}deg-" + format(
        zlib.crc32(repr(numbers).encode()), "08x"
    )
