"""A plan of a hit, and what an executed plan teaches about the door."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from door_impact_common.arrays import Array
from door_model.motion.dynamics import initial_velocity

from impact_planner.hit.joint_load import JointLoad
from impact_planner.hit.learning import ObservedHit, require_on_time
from impact_planner.motion.hit_design import HitDesign
from impact_planner.motion.missed import STANDS
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings


@dataclass(frozen=True)
class ImpactPlan:
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
        """The phase with a given name, which must be one of the plan's."""
        return next(phase for phase in self.phases if phase.name == name)

    # The request and the door.

    @property
    def door(self) -> str:
        """Name of the door."""
        return self.known.name

    @property
    def run_up(self) -> str:
        """Time law of the run-up, ``mcv50`` or ``zmp_limited``."""
        return self.request.run_up

    @property
    def ending(self) -> str:
        """Last phase of the motion, ``hold`` or ``retreat``."""
        return self.request.ending

    @property
    def desired_opening_angle(self) -> float:
        """Opening angle that the door is to reach [rad]."""
        return self.request.angle

    @property
    def initial_angle(self) -> float:
        """Opening angle of the door at the hit [rad]."""
        return self.request.initial_angle

    @property
    def restitution(self) -> float:
        """Coefficient of restitution of the leaf's surface that the plan uses."""
        return self.request.restitution

    @property
    def apparent_restitution(self) -> float:
        """Coefficient of restitution e of eqs. (2) to (4), with the give of the robot."""
        return self.hit.transfer.restitution

    @property
    def learned_hits(self) -> int:
        """Number of hits on this door from which mass and restitution were learned."""
        return 0 if self.known.experience is None else self.known.experience.hits

    # Sections II.C.2 and II.C.3.

    @property
    def omega_door(self) -> float:
        """Angular velocity w' of the door after the hit [rad/s]."""
        return self.hit.prediction.omega

    @property
    def v_rb(self) -> float:
        """Speed v_rB of point B before the hit, eq. (4) corrected [m/s]."""
        return self.hit.transfer.speeds.v_rb

    @property
    def v_rb_post(self) -> float:
        """Speed v'_rB of point B after the hit, positive towards the door [m/s]."""
        return self.hit.transfer.speeds.v_rb_post

    @property
    def v_com(self) -> float:
        """Speed of the CoM before the hit [m/s]."""
        return self.hit.run_up.law.speed

    @property
    def v_com_post(self) -> float:
        """Speed of the CoM after the hit, in the ratio of B's speeds [m/s]."""
        return self.hit.run_up.law.speed * self.hit.transfer.speeds.ratio

    @property
    def effective_mass(self) -> float:
        """Effective mass m_re at B that the plan uses [kg]."""
        return self.hit.transfer.mass

    @property
    def effective_mass_planar(self) -> float:
        """Effective mass at B by eq. (3) [kg]."""
        return self.hit.transfer.planar_mass

    @property
    def effective_mass_model(self) -> float:
        """Effective mass at B by the model alone [kg]."""
        return self.hit.transfer.model_mass

    @property
    def required_impulse(self) -> float:
        """Impulse that the robot gives to the door, eq. (2) [N s]."""
        return self.hit.transfer.speeds.impulse

    @property
    def braking(self) -> float:
        """Angular impulse that closer and hinge friction take from the hit [N m s]."""
        return self.hit.transfer.braking

    @property
    def required_friction(self) -> float:
        """Largest coefficient of friction that the soles need in any phase or the hit."""
        phases = (phase.friction for phase in self.phases)
        return max(self.hit.transfer.floor.friction, *phases)

    @property
    def foot_impulse(self) -> float:
        """Horizontal impulse of the floor on the robot in the hit [N s]."""
        return self.hit.transfer.floor.impulse

    @property
    def foot_impulse_planar(self) -> float:
        """Impulse of the floor at C by planar mechanics, 0 where eq. (5) holds [N s]."""
        return self.hit.transfer.floor.impulse_planar

    @property
    def foot_yaw_impulse(self) -> float:
        """Impulse of the floor's moment about the vertical through the CoM [N m s]."""
        return self.hit.transfer.floor.yaw_impulse

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
    def peak_force(self) -> float:
        """Largest force of the elbow on the leaf, as a mean over a millisecond [N]."""
        return self.hit.transfer.response.peak_force

    @property
    def contact_duration(self) -> float:
        """Duration of the contact with the leaf [s]."""
        return self.hit.transfer.response.duration

    @property
    def pad_preload(self) -> float:
        """Force that presses the brace's pads before the hit [N]; 0 without pads."""
        return self.hit.transfer.response.pad_preload

    @property
    def pad_force(self) -> float:
        """Largest normal force of the brace's pads in the hit [N]; 0 without pads."""
        return self.hit.transfer.response.pad_force

    @property
    def pad_friction(self) -> float:
        """Share of the pads' friction that the hit uses, 0 to 1."""
        return self.hit.transfer.response.pad_friction

    @property
    def joint_loads(self) -> tuple[JointLoad, ...]:
        """Load of each joint, the largest share of the gear's peak torque first."""
        return self.hit.transfer.loads

    # Posture at the hit, sections II.C.1 and II.C.4.

    @property
    def a_r(self) -> float:
        """Height of B above the CoM [m]."""
        return self.hit.stance.posture.a_r

    @property
    def b_r(self) -> float:
        """Height of the CoM above the floor [m]."""
        return self.hit.stance.posture.b_r

    @property
    def b_r_percussion(self) -> float:
        """Height of the CoM that eq. (5) demands [m]."""
        return self.hit.stance.posture.b_r_percussion

    @property
    def l_b(self) -> float:
        """Distance of B from the hinge along the leaf [m]."""
        return self.hit.contact.l_b

    @property
    def i_rob(self) -> float:
        """Moment of inertia I_rob about the x axis through the CoM [kg m^2]."""
        return self.hit.stance.posture.i_rob

    @property
    def waist_height(self) -> float:
        """Height of base_link above the floor [m]."""
        return self.hit.stance.posture.waist_height

    @property
    def left_foot(self) -> Array:
        """Place of the left sole at the hit in odom, (3,) [m]."""
        return self.hit.stance.feet["left"]

    @property
    def right_foot(self) -> Array:
        """Place of the right sole at the hit in odom, (3,) [m]."""
        return self.hit.stance.feet["right"]

    @property
    def contact_point(self) -> Array:
        """Place of B at the hit in odom, (3,) [m]."""
        return self.hit.contact.point

    # Predictions.

    @property
    def contact_time(self) -> float:
        """Time from the start of the phase cam to the nominal contact [s]."""
        return self.hit.run_up.contact_time

    @property
    def switch_time(self) -> float:
        """Time from the start of the phase cam to the start of post [s]."""
        return self.hit.run_up.contact_time + self.settings.switch_delay

    @property
    def slow_down(self) -> float:
        """Time after the switch in which the legs take up v'_rB [s]."""
        return self.settings.slow_down

    @property
    def rest_duration(self) -> float:
        """Time from the end of `slow_down` to rest [s]."""
        return self.branches.rest_duration

    @property
    def peak_time(self) -> float:
        """Time from the hit to the largest opening angle [s]."""
        return self.hit.prediction.peak_time

    @property
    def peak_time_std(self) -> float:
        """Standard deviation of `peak_time` [s]."""
        return self.hit.prediction.peak_time_std

    @property
    def peak_angle(self) -> float:
        """Predicted largest opening angle [rad]."""
        return self.hit.prediction.peak_angle

    @property
    def peak_angle_std(self) -> float:
        """Standard deviation of `peak_angle` [rad]."""
        return self.hit.prediction.peak_angle_std

    @property
    def steady_way(self) -> float:
        """Distance at constant speed, centred on the nominal contact [m]."""
        return 2.0 * self.settings.door_uncertainty

    @property
    def point_of_no_return(self) -> float:
        """Latest start of a safe stop, as time before the contact [s]."""
        return self.branches.point_of_no_return

    @property
    def stop_duration(self) -> float:
        """Time that such a stop takes to rest [s]."""
        return self.branches.stop_duration

    @property
    def early_margin(self) -> float:
        """Smallest ZMP margin after hitting a door that stands nearer than planned [m]."""
        return self.branches.early_margin

    @property
    def late_margin(self) -> float:
        """Smallest ZMP margin after hitting a door that stands farther than planned [m]."""
        return self.branches.late_margin

    @property
    def missed_margin(self) -> float:
        """Capture point's distance inside the soles when a missed contact is noticed [m]."""
        return self.branches.missed_margin

    @property
    def stands_if_missed(self) -> bool:
        """Whether a robot that misses the door is expected to stand; if not, a warning says so."""
        return self.missed_margin >= STANDS


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
        plan.braking, plan.restitution, plan.hit.transfer.model_restitution,
        plan.hit.transfer.restitution_slope)
