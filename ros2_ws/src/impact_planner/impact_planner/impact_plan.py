"""A plan of a hit: what it is, and what came of one that was executed."""

from __future__ import annotations

from dataclasses import dataclass

from door_impact_common.arrays import Array
from door_model.motion.dynamics import initial_velocity

from impact_planner.hit.floor_load import FloorLoad
from impact_planner.hit.learning import ObservedHit
from impact_planner.motion.phase_plan import Branches, PhasePlan
from impact_planner.task.known_door import KnownDoor


@dataclass(frozen=True)
class ImpactPlan:
    """A plan; the letters are the paper's, the fields those of the message ImpactPlan.

    Attributes:
        left_foot: Sole at the hit in odom, (3,) [m]; soles are parallel to odom.
        right_foot: The same for the right one.
        contact_point: B at the hit in odom, (3,) [m].
        step: Length of the right foot's step [m].
        y_start: y of the CoM at the start of the run-up [m].
        door_distance: Planned with [m].
        hinge_x: Planned with [m].
        slow_down: From `switch_time` until the legs have taken up v'_rB [s].
        planning_time: [s].
        floor: What the feet must bear in the hit.
        brace: Impulse of the torque that the brace carries at each of its joints [N m s].
        braking: Angular impulse that the closer takes from the hit [N m s].
        effective_mass_model: At B, by the model alone [kg].
        learned_hits: From so many hits on this door effective mass and restitution were learned.
        steady_way: At constant speed around the nominal contact [m].
        branches: What if the door is not where it was said to be.
        retreat: In place of the last phase, for a cancel past the point of no return.
    """

    plan_id: str
    door: str
    run_up: str
    ending: str
    desired_opening_angle: float
    initial_angle: float
    omega_door: float
    restitution: float
    v_rb: float
    v_rb_post: float
    v_com: float
    v_com_post: float
    effective_mass: float
    effective_mass_planar: float
    effective_mass_model: float
    learned_hits: int
    required_impulse: float
    braking: float
    required_friction: float
    floor: FloorLoad
    brace: dict[str, float]
    a_r: float
    b_r: float
    b_r_percussion: float
    l_b: float
    i_rob: float
    waist_height: float
    left_foot: Array
    right_foot: Array
    contact_point: Array
    contact_time: float
    switch_time: float
    slow_down: float
    peak_time: float
    peak_time_std: float
    peak_angle: float
    peak_angle_std: float
    branches: Branches
    steady_way: float
    warnings: tuple[str, ...]
    phases: tuple[PhasePlan, ...]
    step: float
    y_start: float
    door_distance: float
    hinge_x: float
    planning_time: float
    retreat: PhasePlan

    @property
    def point_of_no_return(self) -> float:
        """See `Branches` [s]."""
        return self.branches.point_of_no_return

    @property
    def stop_duration(self) -> float:
        """See `Branches` [s]."""
        return self.branches.stop_duration

    @property
    def rest_duration(self) -> float:
        """See `Branches` [s]."""
        return self.branches.rest_duration

    @property
    def hardest_braced(self) -> tuple[str, float]:
        """The joint at which the brace carries most, and its impulse [N m s]."""
        joint = max(self.brace, key=lambda name: abs(self.brace[name]), default="")
        return joint, self.brace.get(joint, 0.0)

    @property
    def all_phases(self) -> tuple[PhasePlan, ...]:
        """The phases, and the retreat where it is not one of them."""
        if self.ending == self.retreat.name:
            return self.phases
        return (*self.phases, self.retreat)

    @property
    def zmp_margins(self) -> dict[str, float]:
        """Smallest predicted margin by phase [m]."""
        return {phase.name: phase.margin for phase in self.phases}

    def phase(self, name: str) -> PhasePlan:
        """The phase of a name."""
        return next(phase for phase in self.phases if phase.name == name)


def observed_hit(
    plan: ImpactPlan, known: KnownDoor, peak_angle: float, v_rb_post: float
) -> ObservedHit:
    """What a hit has shown, from its plan and what came of it.

    Args:
        plan: The plan that was executed.
        known: The door that it was made for.
        peak_angle: Largest opening angle of the door [rad].
        v_rb_post: Speed of B after the hit [m/s]; NaN: not known.

    Raises:
        DoorModelError: The door cannot have opened to that angle.
    """
    omega = float(initial_velocity(known.door, peak_angle, plan.initial_angle))
    return ObservedHit(
        plan.effective_mass_model, known.door.i_a, plan.l_b, plan.v_rb, v_rb_post, omega,
        plan.braking)
