"""The planner's pipeline, in the reverse order of the motion as section II.C has it."""

from __future__ import annotations

import math
import time as clock
import zlib
from dataclasses import replace

from . import momentum
from .door_prediction import predict
from .errors import InvalidRequest
from .phases import Hit, plan_phases
from .placement import Placement, nominal_placement, stand
from .plan_types import ImpactPlan, KnownDoor, PhasePlan, PlannerSettings, PlanRequest
from .request import ResolvedRequest, resolve
from .robot_model import RobotModel
from .run_up import plan_run_up, point_of_no_return
from .stance import Contact, Stance

__all__ = [
    "ImpactPlan",
    "KnownDoor",
    "Placement",
    "PlanRequest",
    "PlannerSettings",
    "nominal_placement",
    "plan_impact",
]

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
    wanted = resolve(request, settings)
    hit = _plan_hit(known, robot, wanted, settings)
    phases = plan_phases(robot, known, wanted, settings, hit)
    plan = _compose(known, robot, wanted, settings, hit, phases)
    return replace(plan, plan_id=_identity(plan), planning_time=clock.perf_counter() - begin)


def _plan_hit(
    known: KnownDoor, robot: RobotModel, wanted: ResolvedRequest, settings: PlannerSettings
) -> Hit:
    """Sections II.C.1 to II.C.4: stance, w', v_rB, posture and run-up."""
    door = predict(known, wanted.angle, wanted.initial_angle)
    placement, stance, contact = stand(robot, known, wanted, settings)
    mass_planar, mass = _effective_masses(robot, stance, contact, wanted)
    speeds = momentum.speeds_for(
        door.omega,
        i_a=known.door.i_a,
        l_b=contact.l_b,
        effective_mass=mass,
        restitution=wanted.restitution,
    )
    # Speeds of eqs. (2) to (4) are along the leaf's normal, the run-up goes along y.
    slant = -float(contact.normal[1])
    run_up = plan_run_up(
        robot,
        stance,
        speeds.v_rb / slant,
        period=settings.period,
        overrun=settings.overrun,
        required_margin=settings.required_margin,
        y_start=settings.y_start,
        kind=wanted.run_up,
    )
    # By momentum: what the impulse leaves of the speed of the whole robot.
    v_com_post = run_up.law.speed - speeds.impulse * slant / robot.mass
    return Hit(placement, stance, contact, door, mass, mass_planar, speeds, run_up, v_com_post)


def _compose(
    known: KnownDoor,
    robot: RobotModel,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    hit: Hit,
    phases: tuple[PhasePlan, ...],
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
        v_com_post=hit.v_com_post,
        effective_mass=hit.mass,
        effective_mass_planar=hit.mass_planar,
        required_impulse=speeds.impulse,
        required_friction=max(phase.friction for phase in phases),
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
        switch_time=run_up.contact_time - settings.contact_lead,
        peak_time=door.peak_time,
        peak_time_std=door.peak_time_std,
        peak_angle=door.peak_angle,
        peak_angle_std=door.peak_angle_std,
        point_of_no_return=point_of_no_return(run_up, robot, stance),
        warnings=known.warnings + _warnings(stance, settings),
        phases=phases,
        step=stance.step,
        y_start=run_up.y_start,
        door_distance=hit.placement.door_distance,
        hinge_x=hit.placement.hinge_x,
        planning_time=0.0,
    )


def _effective_masses(
    robot: RobotModel, stance: Stance, contact: Contact, wanted: ResolvedRequest
) -> tuple[float, float]:
    """By eq. (3), and the one to plan with."""
    posture = stance.posture
    planar = momentum.effective_mass_planar(robot.mass, posture.i_rob, posture.a_r)
    if wanted.effective_mass is not None:
        if wanted.effective_mass > robot.mass:
            raise InvalidRequest(
                f"effective_mass {wanted.effective_mass:g} kg is more than the robot's "
                f"{robot.mass:g} kg",
                quantity="effective_mass [kg]",
                value=wanted.effective_mass,
                limit=robot.mass,
            )
        return planar, wanted.effective_mass
    q = robot.configuration(posture.base, posture.joints)
    mass = robot.effective_mass(
        q, locked=robot.config.braced_joints, direction=contact.normal
    )
    return planar, mass


def _warnings(stance: Stance, settings: PlannerSettings) -> tuple[str, ...]:
    posture = stance.posture
    found = []
    if stance.percussion_error:
        found.append(
            f"eq. (5) is not met within the legs' reach: the CoM is "
            f"{1e3 * stance.percussion_error:+.0f} mm off the height of the center of percussion"
        )
    offset = float(posture.elbow[0] - posture.com[0])
    if abs(offset) > _LARGEST_OFFSET:
        found.append(
            f"B is {1e3 * offset:+.0f} mm from the CoM along x, more than "
            f"{1e3 * _LARGEST_OFFSET:.0f} mm: the hit turns the robot"
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
