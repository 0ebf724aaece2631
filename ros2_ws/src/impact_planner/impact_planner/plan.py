"""The planner's pipeline, in the reverse order of the motion as section II.C has it."""

from __future__ import annotations

import math
import time as clock
import zlib
from dataclasses import replace

from door_impact_common.errors import DoorImpactError
from humanoid_motion.clearance import bodies_of
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import AngleUnreachable, InvalidRequest, SpeedUnreachable
from impact_planner.hit import momentum
from impact_planner.hit.door_prediction import DoorPrediction, predict
from impact_planner.hit.floor_load import FloorLoad, floor_load, require_no_slip
from impact_planner.hit.hit_response import HitResponse, hit_response
from impact_planner.hit.placement import Placement, placement_for_step, stand
from impact_planner.hit.posture import LegDemands, capable, waist_per_com
from impact_planner.hit.stance import SPARE_WAY, STEP_SHARES, Contact, Stance
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.hit_design import HitDesign
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.motion.phases import plan_phases
from impact_planner.motion.run_up import RunUpWish, plan_run_up
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest, ResolvedRequest, resolve
from impact_planner.task.settings import PlannerSettings

__all__ = [
    "ImpactPlan",
    "KnownDoor",
    "Placement",
    "PlanRequest",
    "PlannerSettings",
    "placement_for_step",
    "plan_impact",
]

_SPEED_RESERVE = 1.005  # a lower waist changes v_rB a little
_LARGEST_OFFSET = 0.03  # of B from the CoM along x; further off, yaw eats effective mass [m]


def plan_impact(
    request: PlanRequest,
    known: KnownDoor,
    robot: RobotModel,
    settings: PlannerSettings | None = None,
) -> ImpactPlan:
    """Plan the whole motion that opens a door to an angle.

    Args:
        request: What is asked for.
        known: The door.
        robot: The robot.
        settings: Configuration.

    Returns:
        The plan with its trajectories.

    Raises:
        PlannerError: One of its subclasses, naming the value and the limit.
    """
    begin = clock.perf_counter()
    settings = settings or PlannerSettings()
    wanted = resolve(request, settings, known)
    door = predict(known, wanted.angle, wanted.initial_angle)
    failure: DoorImpactError | None = None
    for share in STEP_SHARES if wanted.door_distance is None else (1.0,):
        step = share * robot.config.step.nominal
        try:
            hit = _plan_hit(known, door, robot, wanted, settings, step)
            phases, retreat, branches = plan_phases(robot, known, wanted, settings, hit)
        except (AngleUnreachable, JointLimit, SpeedUnreachable, PostureUnreachable) as error:
            failure = failure or error  # of the step that was wanted most
            continue
        plan = _compose(known, robot, wanted, settings, hit, phases, retreat, branches)
        return replace(plan, plan_id=_identity(plan), planning_time=clock.perf_counter() - begin)
    assert failure is not None
    raise failure


def _plan_hit(
    known: KnownDoor,
    door: DoorPrediction,
    robot: RobotModel,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    step: float,
) -> HitDesign:
    """Sections II.C.1, II.C.3 and II.C.4: stance, v_rB, posture and run-up."""
    demands = LegDemands(beyond=settings.door_uncertainty + SPARE_WAY)
    placement, stance, contact = stand(robot, known, wanted, settings, demands, step)
    masses, speeds, brace, floor = _momentum(
        robot, known, wanted, settings, stance, contact, door.omega)
    demands = replace(
        demands,
        speed=_SPEED_RESERVE * _along_y(speeds.v_rb, contact)
        / waist_per_com(robot, stance.posture, stance.feet),
        joint_speed=settings.limit_share * robot.speed_limit)
    if not capable(robot, stance.posture, stance.feet, demands):
        placement, stance, contact = stand(robot, known, wanted, settings, demands, step)
        masses, speeds, brace, floor = _momentum(
            robot, known, wanted, settings, stance, contact, door.omega)
    require_no_slip(floor, settings.sole_friction)
    run_up = plan_run_up(robot, stance, RunUpWish(
        kind=wanted.run_up,
        v_rb=_along_y(speeds.v_rb, contact),
        steady=settings.door_uncertainty,
        overrun=settings.overrun,
        required_margin=settings.required_margin,
        joint_share=settings.limit_share,
        period=settings.period,
        y_start=settings.y_start,
    ))
    return HitDesign(placement, stance, contact, door, *masses, speeds, floor, brace, run_up)


def _along_y(speed: float, contact: Contact) -> float:
    """The speed along y, where the run-up goes, of one along the leaf's normal, of eqs. (2) to (4).
    """
    return speed / -float(contact.normal[1])


def _momentum(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    stance: Stance,
    contact: Contact,
    omega: float,
) -> tuple[tuple[float, float], momentum.ImpactSpeeds, dict[str, float], FloorLoad]:
    """Section II.C.3: effective mass, speeds along the leaf's normal, what brace and floor bear.

    The mass twice: planned with, and by the model alone [kg].
    """
    posture = stance.posture
    response = hit_response(
        robot, robot.configuration(posture.base, posture.joints), normal=contact.normal,
        leaf_friction=settings.leaf_friction, duration=settings.contact_duration)
    mass = _mass_to_plan_with(robot, wanted, response)
    speeds = momentum.speeds_for(
        omega, i_a=known.door.i_a, l_b=contact.l_b, effective_mass=mass,
        restitution=wanted.restitution, braking=_braking(known, wanted.initial_angle, settings))
    brace = {joint: speeds.impulse * each for joint, each in response.brace.items()}
    return (mass, response.mass), speeds, brace, floor_load(
        robot.mass, posture, response, speeds.impulse, settings.contact_duration,
        settings.sole_friction)


def _braking(known: KnownDoor, initial_angle: float, settings: PlannerSettings) -> float:
    torque = float(known.door.restoring_torque(initial_angle)) + known.door.friction
    return momentum.closer_braking(torque, settings.contact_duration)


def _compose(
    known: KnownDoor,
    robot: RobotModel,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    hit: HitDesign,
    phases: tuple[PhasePlan, ...],
    retreat: PhasePlan,
    branches: Branches,
) -> ImpactPlan:
    """The plan, without its name and time."""
    stance, door, speeds, run_up = hit.stance, hit.door, hit.speeds, hit.run_up
    posture, contact = stance.posture, hit.contact
    return ImpactPlan(
        plan_id="",
        door=known.name,
        run_up=wanted.run_up,
        ending=wanted.ending,
        desired_opening_angle=wanted.angle,
        initial_angle=wanted.initial_angle,
        omega_door=door.omega,
        restitution=wanted.restitution,
        v_rb=speeds.v_rb,
        v_rb_post=speeds.v_rb_post,
        v_com=run_up.law.speed,
        v_com_post=run_up.law.speed * speeds.ratio,
        effective_mass=hit.mass,
        effective_mass_model=hit.model_mass,
        learned_hits=0 if known.experience is None else known.experience.hits,
        effective_mass_planar=momentum.effective_mass_planar(
            robot.mass, posture.i_rob, posture.a_r),
        required_impulse=speeds.impulse,
        braking=_braking(known, wanted.initial_angle, settings),
        required_friction=max(hit.floor.friction, *(phase.friction for phase in phases)),
        floor=hit.floor,
        brace=hit.brace,
        a_r=posture.a_r,
        b_r=posture.b_r,
        b_r_percussion=posture.b_r_percussion,
        l_b=contact.l_b,
        i_rob=posture.i_rob,
        waist_height=posture.waist_height,
        left_foot=stance.feet["left"],
        right_foot=stance.feet["right"],
        contact_point=contact.point,
        contact_time=run_up.contact_time,
        switch_time=run_up.contact_time + settings.switch_delay,
        slow_down=settings.slow_down,
        peak_time=door.peak_time,
        peak_time_std=door.peak_time_std,
        peak_angle=door.peak_angle,
        peak_angle_std=door.peak_angle_std,
        branches=branches,
        warnings=known.warnings + _warnings(robot, stance, branches),
        steady_way=2.0 * settings.door_uncertainty,
        phases=phases,
        step=stance.step,
        y_start=run_up.y_start,
        door_distance=hit.placement.door_distance,
        hinge_x=hit.placement.hinge_x,
        planning_time=0.0,
        retreat=retreat,
    )


def _mass_to_plan_with(robot: RobotModel, wanted: ResolvedRequest, response: HitResponse) -> float:
    """The effective mass of the whole robot, or the one that is asked for [kg]."""
    if wanted.effective_mass is None:
        return wanted.mass_factor * response.mass
    if wanted.effective_mass > robot.mass:
        raise InvalidRequest(
            f"effective_mass {wanted.effective_mass:g} kg is more than the robot's "
            f"{robot.mass:g} kg",
            quantity="effective_mass [kg]",
            value=wanted.effective_mass,
            limit=robot.mass,
        )
    return wanted.effective_mass


def _warnings(robot: RobotModel, stance: Stance, branches: Branches) -> tuple[str, ...]:
    posture = stance.posture
    found = []
    if stance.percussion_error:
        found.append(
            f"eq. (5) is not met within what the legs can do: the CoM is "
            f"{1e3 * stance.percussion_error:+.0f} mm off the height of the center of percussion"
        )
    offset = float(posture.elbow[0] - posture.com[0])
    if abs(offset) > _LARGEST_OFFSET:
        found.append(
            f"B is {1e3 * offset:+.0f} mm from the CoM along x, more than "
            f"{1e3 * _LARGEST_OFFSET:.0f} mm: the hit turns the robot"
        )
    unseen = bodies_of(robot).left_out
    if unseen or not bodies_of(robot).links:
        found.append(
            f"no collision shapes of {', '.join(unseen) or 'any link'}: their clearance is not "
            "checked")
    if branches.missed_margin < 0.0:
        found.append(
            f"a contact that is missed cannot be stopped on these feet: the capture point would be "
            f"{1e3 * branches.recovery_step:.0f} mm beyond the soles, and there is no step to "
            "recover with"
        )
    return tuple(found)


def _identity(plan: ImpactPlan) -> str:
    """Name of a plan, the same for the same numbers."""
    numbers = (
        plan.door, plan.omega_door, plan.v_rb, plan.restitution, plan.effective_mass, plan.l_b,
        plan.step, plan.y_start, plan.desired_opening_angle, plan.initial_angle, plan.hinge_x,
    )  # fmt: skip
    return f"{plan.door}-{math.degrees(plan.desired_opening_angle):.1f}deg-" + format(
        zlib.crc32(repr(numbers).encode()), "08x"
    )
