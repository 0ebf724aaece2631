"""The phases of a plan, from the run-up that was chosen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import momentum
from .approach import StandingPhase, plan_approach, sample_times
from .door_prediction import DoorPrediction
from .hold import HoldTask, plan_hold
from .phase_checks import PhaseLimits, checked_phase
from .placement import Placement
from .plan_types import KnownDoor, PhasePlan, PlannerSettings
from .post import continue_from, path_time
from .request import ResolvedRequest
from .robot_model import SIDES, RobotModel
from .run_up import RunUpPlan
from .stance import Contact, Stance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hit:
    """All that is decided about the hit before trajectories are made.

    Attributes:
        placement: Where the door is.
        stance: Feet and posture.
        contact: Where the elbow meets the leaf.
        door: What the door does.
        mass: Effective mass planned with [kg].
        mass_planar: By eq. (3) [kg].
        speeds: Of B, along the leaf's normal.
        run_up: The run-up.
        v_com_post: Speed of the CoM after the hit, towards the door [m/s].
    """

    placement: Placement
    stance: Stance
    contact: Contact
    door: DoorPrediction
    mass: float
    mass_planar: float
    speeds: momentum.ImpactSpeeds
    run_up: RunUpPlan
    v_com_post: float


def plan_phases(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    hit: Hit,
) -> tuple[PhasePlan, ...]:
    """Plan and check prepare, shift, step, back, cam, post and hold.

    Raises:
        PlannerError: A phase breaks a limit.
    """
    stance, run_up = hit.stance, hit.run_up
    approach = plan_approach(robot, stance, run_up.y_start, settings.timing, settings.period)
    limits = PhaseLimits(settings.required_margin, settings.limit_share)
    phases = [checked_phase(robot, phase, limits) for phase in approach]
    cam = checked_phase(
        robot,
        StandingPhase("cam", run_up.motion, stance.feet, SIDES),
        limits,
        until=run_up.contact_time,
    )
    phases.append(cam)
    post, end = _post(robot, settings, hit, cam, limits)
    phases.append(post)
    joints, base = end
    hold = plan_hold(robot, HoldTask(
        known.door, known.width, hit.placement.hinge, wanted.angle, joints, base, stance.feet,
        settings.hand_force_limit, settings.limit_share, settings.period))
    phases.append(checked_phase(robot, hold.phase, limits, load=hold.load))
    return tuple(phases)


def _post(
    robot: RobotModel,
    settings: PlannerSettings,
    hit: Hit,
    cam: PhasePlan,
    limits: PhaseLimits,
) -> tuple[PhasePlan, tuple[Array, Array]]:
    """From the switch to the door's peak: on along the path from the reduced speed, to rest.

    Returns:
        The phase, and the joints and base at its end.
    """
    run_up = hit.run_up
    ratio = hit.v_com_post / run_up.law.speed
    start = run_up.contact_time - settings.contact_lead
    contact = settings.contact_duration
    rest = settings.post_duration
    if ratio > 0.0:  # the path ends with the overrun
        reserve = float(cam.knots.time[-1]) - start - 0.5 * (1.0 + ratio) * contact
        rest = min(rest, 1.99 * reserve / ratio)
    total = max(settings.contact_lead + hit.door.peak_time, contact + rest)
    knots = continue_from(cam.knots, start, ratio, rest, contact=contact, total=total)
    # While the door pushes back, the ZMP is the hit's affair; here it counts from then on.
    time = contact + sample_times(float(knots.time[-1]) - contact, settings.period)
    scaled, rate, slope = path_time(time, start, ratio, rest, contact)
    course = run_up.law.at(scaled)
    motion = run_up.table.motion(
        time,
        run_up.y_start - course.s,
        -course.v * rate,
        -course.a * rate**2 - course.v * slope,
    )
    phase = checked_phase(
        robot, StandingPhase("post", motion, hit.stance.feet, SIDES), limits, knots=knots)
    return phase, (motion.joints[-1], motion.base[-1])
