"""A plan of a hit, and what an executed plan teaches about the door."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Protocol

from door_impact_common.arrays import Array
from door_model.motion.dynamics import initial_velocity

from impact_planner.hit.joint_load import JointLoad
from impact_planner.hit.learning import ObservedHit, require_on_time
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.motion.run_up import HitDesign
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings


def _figure(path: str) -> Any:
    return property(attrgetter(path))


class _Figures:
    """Figures of a plan, read from the part that decides them; letters are the paper's.

    What each of them means is said where its path leads, and in ImpactPlan.msg.
    """

    # The request and the door.
    door: str = _figure("known.name")
    run_up: str = _figure("request.run_up")
    ending: str = _figure("request.ending")
    desired_opening_angle: float = _figure("request.angle")  # [rad]
    initial_angle: float = _figure("request.initial_angle")  # [rad]
    restitution: float = _figure("request.restitution")
    apparent_restitution: float = _figure("hit.transfer.restitution")
    # Sections II.C.2 and II.C.3.
    omega_door: float = _figure("hit.prediction.omega")  # [rad/s]
    v_rb: float = _figure("hit.transfer.speeds.v_rb")  # [m/s]
    v_rb_post: float = _figure("hit.transfer.speeds.v_rb_post")  # [m/s]
    v_com: float = _figure("hit.run_up.law.speed")  # [m/s]
    effective_mass: float = _figure("hit.transfer.mass")  # [kg]
    effective_mass_planar: float = _figure("hit.transfer.planar_mass")  # [kg]
    effective_mass_model: float = _figure("hit.transfer.response.mass")  # [kg]
    required_impulse: float = _figure("hit.transfer.speeds.impulse")  # [N s]
    braking: float = _figure("hit.transfer.braking")  # [N m s]
    foot_impulse: float = _figure("hit.transfer.floor.impulse")  # [N s]
    foot_impulse_planar: float = _figure("hit.transfer.floor.impulse_planar")  # [N s]
    foot_yaw_impulse: float = _figure("hit.transfer.floor.yaw_impulse")  # [N m s]
    peak_force: float = _figure("hit.transfer.response.peak_force")  # [N]
    contact_duration: float = _figure("hit.transfer.response.duration")  # [s]
    pad_preload: float = _figure("hit.transfer.response.pad_preload")  # [N]
    pad_force: float = _figure("hit.transfer.response.pad_force")  # [N]
    pad_friction: float = _figure("hit.transfer.response.pad_friction")
    joint_loads: tuple[JointLoad, ...] = _figure("hit.transfer.loads")
    # Posture at the hit, sections II.C.1 and II.C.4.
    a_r: float = _figure("hit.stance.posture.a_r")  # [m]
    b_r: float = _figure("hit.stance.posture.b_r")  # [m]
    b_r_percussion: float = _figure("hit.stance.posture.b_r_percussion")  # [m]
    l_b: float = _figure("hit.contact.l_b")  # [m]
    i_rob: float = _figure("hit.stance.posture.i_rob")  # [kg m^2]
    waist_height: float = _figure("hit.stance.posture.waist_height")  # [m]
    contact_point: Array = _figure("hit.contact.point")  # [m]
    # Predictions.
    contact_time: float = _figure("hit.run_up.contact_time")  # [s]
    slow_down: float = _figure("settings.slow_down")  # [s]
    rest_duration: float = _figure("branches.rest_duration")  # [s]
    peak_time: float = _figure("hit.prediction.peak_time")  # [s]
    peak_time_std: float = _figure("hit.prediction.peak_time_std")  # [s]
    peak_angle: float = _figure("hit.prediction.peak_angle")  # [rad]
    peak_angle_std: float = _figure("hit.prediction.peak_angle_std")  # [rad]
    point_of_no_return: float = _figure("branches.point_of_no_return")  # [s]
    stop_duration: float = _figure("branches.stop_duration")  # [s]
    early_margin: float = _figure("branches.early_margin")  # [m]
    late_margin: float = _figure("branches.late_margin")  # [m]
    missed_margin: float = _figure("branches.missed_margin")  # [m]


FIGURES = tuple(name for name in vars(_Figures) if not name.startswith("_"))


@dataclass(frozen=True)
class ImpactPlan(_Figures):
    """A plan: the design of the hit, its trajectories and what it was made from.

    The figures of the message ImpactPlan are properties of the same names, so that message, text
    and executor read them by name. Letters such as v_rb and a_r are the paper's. What has no
    property is reached through its part, such as ``plan.hit.stance.step``.

    Attributes:
        plan_id: Name of the plan, the same for the same numbers.
        known: Door that the plan is for.
        request: Request that the plan fulfils, with defaults filled in.
        settings: Configuration that the plan was made with.
        hit: Design of the hit.
        phases: Phases of the motion in order, each checked against the limits.
        retreat: Phase that replaces the last one after a cancel past the point of no return.
        branches: Margins for a door that does not stand where it was reported.
        warnings: Sentences for the user about what the plan does not achieve.
        planning_time: Wall time that planning took [s].
    """

    plan_id: str
    known: KnownDoor
    request: ResolvedRequest
    settings: PlannerSettings
    hit: HitDesign
    phases: tuple[PhasePlan, ...]
    retreat: PhasePlan
    branches: Branches
    warnings: tuple[str, ...]
    planning_time: float

    @property
    def all_phases(self) -> tuple[PhasePlan, ...]:
        """The phases, followed by the retreat where it is not the last phase already."""
        if self.ending == self.retreat.name:
            return self.phases
        return (*self.phases, self.retreat)

    @property
    def zmp_margins(self) -> dict[str, float]:
        """Smallest predicted ZMP margin by phase [m]."""
        return {phase.name: phase.margin for phase in self.phases}

    def phase(self, name: str) -> PhasePlan:
        """Return the phase with a given name, which must be one of the plan's."""
        return next(phase for phase in self.phases if phase.name == name)

    @property
    def held_angle(self) -> float:
        """Opening angle at which the hand holds the leaf in the end [rad]; NaN: it does not."""
        return math.nan if self.ending == "retreat" else float(self.phases[-1].leaf.angle[-1])

    @property
    def learned_hits(self) -> int:
        """Number of hits on this door from which mass and restitution were learned."""
        return 0 if self.known.experience is None else self.known.experience.hits

    @property
    def v_com_post(self) -> float:
        """Speed of the CoM after the hit, in the ratio of B's speeds [m/s]."""
        return self.hit.run_up.law.speed * self.hit.transfer.speeds.ratio

    @property
    def required_friction(self) -> float:
        """Largest coefficient of friction that the soles need in any phase or the hit."""
        phases = (phase.friction for phase in self.phases)
        return max(self.hit.transfer.floor.friction, *phases)

    @property
    def brace_joint(self) -> str:
        """Braced joint to which the hit gives the largest impulse; empty without a brace."""
        brace = self.hit.transfer.brace
        return max(brace, key=lambda joint: abs(brace[joint]), default="")

    @property
    def brace_impulse(self) -> float:
        """Impulse that the hit adds to the torque of `brace_joint` [N m s]."""
        return self.hit.transfer.brace.get(self.brace_joint, 0.0)

    @property
    def left_foot(self) -> Array:
        """Place of the left sole at the hit in odom, (3,) [m]."""
        return self.hit.stance.feet["left"]

    @property
    def right_foot(self) -> Array:
        """Place of the right sole at the hit in odom, (3,) [m]."""
        return self.hit.stance.feet["right"]

    @property
    def switch_time(self) -> float:
        """Time from the start of the phase cam to the start of post [s]."""
        return self.hit.run_up.contact_time + self.settings.switch_delay

    @property
    def steady_way(self) -> float:
        """Distance at constant speed, centred on the nominal contact [m]."""
        return 2.0 * self.settings.door_uncertainty


class MeasuredHit(Protocol):
    """What an execution or the report of one has measured of a hit.

    Attributes:
        contact_delay: Time from the planned contact to the detected one [s].
        switch_latency: Time from the detected contact to the switch to the motion after it [s].
        v_rb_post: Speed of B after the hit [m/s]; NaN means that it was not measured.
        peak_angle: Largest opening angle of the door [rad].
    """

    contact_delay: float
    switch_latency: float
    v_rb_post: float
    peak_angle: float


def observed_hit(plan: ImpactPlan, known: KnownDoor, measured: MeasuredHit) -> ObservedHit:
    """Compute what a hit has shown, from its plan and the measured outcome.

    Args:
        plan: Plan that was executed.
        known: Door that was hit.
        measured: The measured outcome.

    Raises:
        ImplausibleHit: The contact or the switch after it was not on time.
        DoorModelError: The door cannot have opened to that angle.
    """
    require_on_time(
        measured.contact_delay, measured.switch_latency,
        steady_time=plan.settings.door_uncertainty / plan.v_com,
        switch_delay=plan.settings.switch_delay)
    omega = float(initial_velocity(known.door, measured.peak_angle, plan.initial_angle))
    return ObservedHit(
        plan.effective_mass_model, known.door.i_a, plan.l_b, plan.v_rb, measured.v_rb_post, omega,
        plan.braking, plan.restitution, plan.hit.transfer.response.restitution,
        plan.hit.transfer.restitution_slope)
