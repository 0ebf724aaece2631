"""The planner's pipeline; like section II.C, it decides from the end of the motion to its start."""

from __future__ import annotations

import math
import time as clock
import zlib
from dataclasses import dataclass, replace

from door_impact_common.errors import DoorImpactError
from humanoid_motion.clearance import bodies_of
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import PLANNING_ERRORS, AngleUnreachable, SpeedUnreachable
from impact_planner.hit.door_prediction import DoorPrediction, predict
from impact_planner.hit.floor_load import require_no_slip
from impact_planner.hit.joint_load import overload_warnings, require_bearable
from impact_planner.hit.placement import Placement, placement_for_step, stand
from impact_planner.hit.posture import LegDemands, capable, waist_per_com
from impact_planner.hit.stance import SPARE_DISTANCE, STEP_SHARES, HitStance, LeafContact
from impact_planner.hit.transfer import MomentumTransfer, plan_transfer
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.hit_design import HitDesign
from impact_planner.motion.missed import STANDS, inside_edge_for
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.motion.phases import plan_phases
from impact_planner.motion.run_up import RunUpWish, plan_run_up
from impact_planner.task.experience import Experience
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, ResolvedRequest, resolve
from impact_planner.task.settings import LEAST_INSIDE_EDGE, PlannerSettings

Phases = tuple[tuple[PhasePlan, ...], PhasePlan, Branches]
"""The phases, the retreat for a cancel, and the margins for a door that stands elsewhere."""

__all__ = [
    "ImpactPlan",
    "KnownDoor",
    "Placement",
    "PlanRequest",
    "PlannerSettings",
    "placement_for_step",
    "plan_impact",
]

# Factor on the speed that the legs must manage: a lower waist changes v_rB a little.
_SPEED_RESERVE = 1.005
# Shares of the way of the CoM that `missed_reserve` needs, tried in this order: the legs, or the
# ZMP of a shorter run-up, may not allow the whole way.
_INWARD_SHARES = (1.0, 0.85, 0.7, 0.5, 0.25, 0.0)
_SPARE_RESERVE = 0.002  # further inside than needed, for a stance that turns out higher [m]
# Errors after which another step or another place of the CoM is tried.
_STEP_ERRORS = (AngleUnreachable, JointLimit, SpeedUnreachable, PostureUnreachable)
# Largest distance of B from the CoM along x without a warning [m]; beyond it, yaw reduces the
# effective mass.
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
        known: The door.
        robot: The robot.
        settings: Configuration; None means the defaults.

    Returns:
        The plan with its trajectories.

    Raises:
        PlannerError: The request cannot be met. The error carries quantity, value and limit.
        HumanoidMotionError: The robot's joints, legs or balance do not allow the motion.
    """
    settings = settings or PlannerSettings()
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
    """The plan, which was made without the experience, with a warning that says why."""
    return replace(plan, warnings=(
        f"what {experience.hits} hits on this door have taught (restitution "
        f"{experience.restitution:.3f}, effective mass {experience.mass_factor:.3f} times the "
        f"model's) was set aside: {why}; /forget_hits discards it", *plan.warnings))


def _planned(
    request: PlanRequest, known: KnownDoor, robot: RobotModel, settings: PlannerSettings
) -> ImpactPlan:
    """Plan with what is known of the door.

    Where the request leaves the door's place open, the nominal step is tried first and shorter
    steps after it. If all steps fail, the error of the nominal step is raised.

    Raises:
        PlannerError: The request cannot be met.
        HumanoidMotionError: The robot's joints, legs or balance do not allow the motion.
    """
    begin = clock.perf_counter()
    wanted = resolve(request, settings, known)
    failure: DoorImpactError | None = None
    for share in STEP_SHARES if wanted.door_distance is None else (1.0,):
        task = _Task(known, predict(known, wanted.angle, wanted.initial_angle), robot, wanted,
                     settings, share * robot.config.step.nominal)
        try:
            hit, (phases, retreat, branches) = _motion(task)
        except _STEP_ERRORS as error:
            failure = failure or error  # keeps the error of the nominal step
            continue
        return ImpactPlan(
            plan_id=_identity(known, wanted, hit),
            known=known,
            request=wanted,
            settings=settings,
            hit=hit,
            phases=phases,
            retreat=retreat,
            branches=branches,
            warnings=known.warnings + _warnings(robot, hit, branches),
            planning_time=clock.perf_counter() - begin,
        )
    assert failure is not None
    raise failure


@dataclass(frozen=True)
class _Task:
    """What is planned for one length of the step.

    Attributes:
        known: The door.
        prediction: The opening of the door.
        robot: The robot.
        wanted: The request.
        settings: Configuration.
        step: Length of the step that decides the place of the door where it is left open [m].
    """

    known: KnownDoor
    prediction: DoorPrediction
    robot: RobotModel
    wanted: ResolvedRequest
    settings: PlannerSettings
    step: float


@dataclass(frozen=True)
class _Blow:
    """Where the robot stands at the hit, and the hit itself.

    Attributes:
        placement: Place of the door.
        stance: Feet and posture.
        contact: Contact of the elbow with the leaf.
        transfer: Speeds, impulse and loads.
    """

    placement: Placement
    stance: HitStance
    contact: LeafContact
    transfer: MomentumTransfer


def _motion(task: _Task) -> tuple[HitDesign, Phases]:
    """Plan the hit, with the CoM as far inside as a missed contact needs and the motion allows.

    Raises:
        PlannerError: The request cannot be met; the error is that of the configured place of the
            CoM, `com_inside_edge`.
        HumanoidMotionError: The robot's joints, legs or balance do not allow the motion.
    """
    settings = task.settings
    demands = LegDemands(beyond=settings.door_uncertainty + SPARE_DISTANCE)
    first = _blow(task, settings.com_inside_edge, demands)
    speed = _com_speed(task.robot, first)
    needed = inside_edge_for(
        task.robot, first.stance.posture, speed, settings.overrun,
        settings.missed_reserve + _SPARE_RESERVE)
    inward = max(0.0, settings.com_inside_edge - max(needed, LEAST_INSIDE_EDGE))
    # The speed is known only now; a posture with too fast joints is replaced by a lower one.
    demands = replace(
        demands, speed=speed, joint_speed=settings.limit_share * task.robot.speed_limit)
    failure: DoorImpactError | None = None
    for share in _INWARD_SHARES if inward > 0.0 else (0.0,):
        inside = max(settings.com_inside_edge - share * inward, LEAST_INSIDE_EDGE)
        try:
            hit = _design_hit(task, inside, demands, first)
            return hit, plan_phases(task.robot, task.known, task.wanted, settings, hit)
        except _STEP_ERRORS as error:
            failure = error
    assert failure is not None
    raise failure


def _blow(task: _Task, inside_edge: float, demands: LegDemands) -> _Blow:
    """Decide stance and v_rB for a place of the CoM [m]: sections II.C.1 and II.C.3."""
    settings = replace(task.settings, com_inside_edge=inside_edge)
    placement, stance, contact = stand(
        task.robot, task.known, task.wanted, settings, demands, task.step)
    transfer = plan_transfer(
        task.robot, task.known, task.wanted, settings, stance, contact, task.prediction.omega)
    return _Blow(placement, stance, contact, transfer)


def _design_hit(task: _Task, inside_edge: float, demands: LegDemands, first: _Blow) -> HitDesign:
    """Decide stance, v_rB, posture and run-up: sections II.C.1, II.C.3 and II.C.4.

    Args:
        task: What is planned.
        inside_edge: Distance of the CoM inside the right sole's inner edge [m].
        demands: Demands on the legs past the hit.
        first: The hit from the configured `com_inside_edge`, without demands on the joints' speed.
    """
    robot, settings, blow = task.robot, task.settings, first
    if inside_edge != settings.com_inside_edge or not capable(
            robot, first.stance.posture, first.stance.feet, demands):
        blow = _blow(task, inside_edge, demands)
    require_no_slip(blow.transfer.floor, settings.sole_friction)
    require_bearable(blow.transfer.loads)
    run_up = plan_run_up(robot, blow.stance, RunUpWish(
        kind=task.wanted.run_up,
        v_rb=_along_y(blow.transfer.speeds.v_rb, blow.contact),
        steady=settings.door_uncertainty,
        overrun=settings.overrun,
        required_margin=settings.required_margin,
        joint_share=settings.limit_share,
        period=settings.period,
        y_start=settings.y_start,
        stop=settings.missed_stop,
    ))
    return HitDesign(
        blow.placement, blow.stance, blow.contact, task.prediction, blow.transfer, run_up)


def _com_speed(robot: RobotModel, blow: _Blow) -> float:
    """Speed of the CoM that a hit needs, with a small reserve [m/s]."""
    v_rb = _along_y(blow.transfer.speeds.v_rb, blow.contact)
    return _SPEED_RESERVE * v_rb / waist_per_com(robot, blow.stance.posture, blow.stance.feet)


def _along_y(speed: float, contact: LeafContact) -> float:
    """Speed towards -y, the direction of the run-up, from a speed along the leaf's normal [m/s].

    Equations (2) to (4) are along the normal. It differs from y where the door is ajar.
    """
    return speed / -float(contact.normal[1])


def _warnings(
    robot: RobotModel, hit: HitDesign, branches: Branches
) -> tuple[str, ...]:
    """Sentences about what the plan does not achieve or check."""
    stance, posture = hit.stance, hit.stance.posture
    found = [*overload_warnings(hit.transfer.loads)]
    config = robot.config
    if config.brace is not None and config.drives is not None and (
            hit.transfer.response.pad_preload == 0.0):
        found.append("the braced posture does not press the pads of robot.yaml's brace on each "
                     "other: the hit is planned without them")
    if abs(stance.percussion_error) >= _ROUNDING:
        found.append(
            f"eq. (5) is not met within the legs' range: the CoM is "
            f"{1e3 * stance.percussion_error:+.0f} mm off the height of the center of percussion"
        )
    offset = float(posture.elbow[0] - posture.com[0])
    if abs(offset) > _LARGEST_OFFSET:
        found.append(
            f"B is {1e3 * offset:+.0f} mm from the CoM along x, more than "
            f"{1e3 * _LARGEST_OFFSET:.0f} mm: the hit turns the robot about the vertical"
        )
    unseen = bodies_of(robot).left_out
    if unseen or not bodies_of(robot).links:
        found.append(
            f"{', '.join(unseen) or 'every link'} has no collision shape: its clearance is not "
            "checked")
    missed = branches.missed_margin
    if missed < 0.0:
        found.append(
            f"a robot that misses the door falls: the capture point would be {-1e3 * missed:.0f} "
            "mm beyond the soles when it begins to brake")
    elif missed < STANDS:
        found.append(
            f"a robot that misses the door may fall: the capture point would be only "
            f"{1e3 * missed:.0f} mm inside the soles when it begins to brake, "
            f"{1e3 * STANDS:.0f} mm are wanted")
    return tuple(found)


def _identity(known: KnownDoor, wanted: ResolvedRequest, hit: HitDesign) -> str:
    """Name of a plan: door, angle and a checksum of the numbers that decide the plan."""
    numbers = (
        known.name, hit.prediction.omega, hit.transfer.speeds.v_rb, wanted.restitution,
        hit.transfer.mass, hit.contact.l_b, hit.stance.step, hit.run_up.y_start, wanted.angle,
        wanted.initial_angle, hit.placement.hinge_x,
    )  # fmt: skip
    return f"{known.name}-{math.degrees(wanted.angle):.1f}deg-" + format(
        zlib.crc32(repr(numbers).encode()), "08x"
    )
