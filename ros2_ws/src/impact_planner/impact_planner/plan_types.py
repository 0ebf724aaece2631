"""What goes into a plan and what comes out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from door_model.config import DoorConfig
from door_model.door import Door
from numpy.typing import NDArray

from .approach import ApproachTiming
from .clearance import Clearance, LeafCourse
from .experience import Experience
from .floor_load import FloorLoad
from .knots import Knots

Array = NDArray[np.float64]

RUN_UPS = ("mcv50", "zmp_limited")
ENDINGS = ("hold", "retreat")


@dataclass(frozen=True)
class PlanRequest:
    """A request; None means "as configured or as last identified".

    Attributes:
        desired_opening_angle: [rad].
        initial_angle: Of the door at the hit [rad].
        restitution: Coefficient of restitution.
        effective_mass: Of the robot at B, in place of the model's [kg].
        door_distance: From the origin of odom to the closed leaf's face [m].
        l_b: From the hinge to B along the leaf [m].
        run_up: One of `RUN_UPS`.
        ending: One of `ENDINGS`.
    """

    desired_opening_angle: float
    initial_angle: float | None = None
    restitution: float | None = None
    effective_mass: float | None = None
    door_distance: float | None = None
    l_b: float | None = None
    run_up: str | None = None
    ending: str | None = None


@dataclass(frozen=True)
class KnownDoor:
    """What is known of the door.

    Attributes:
        name: Name.
        door: Parameters of eq. (1).
        width: Of the leaf, hinge to free edge [m].
        parameters: Names of what was identified (P,), such as "k_c".
        covariance: Of these, (P, P) in SI units; None: taken as exact.
        warnings: Of the identification.
        experience: What hits on it have taught; None: nothing yet.
    """

    name: str
    door: Door
    width: float
    parameters: tuple[str, ...] = ()
    covariance: Array | None = None
    warnings: tuple[str, ...] = ()
    experience: Experience | None = None

    @classmethod
    def configured(cls, config: DoorConfig) -> KnownDoor:
        """A door that is exactly as its configuration says."""
        return cls(config.name, config.door(), config.leaf.width)


@dataclass(frozen=True)
class PlannerSettings:
    """Configuration of the planner.

    Attributes:
        door_distance: From the origin of odom to the closed leaf's face [m]; None: where the
            nominal step ends.
        hinge_x: x of the hinge in odom [m]; None: `nominal_l_b` behind B.
        nominal_l_b: See `hinge_x` [m]; the paper's.
        initial_angle: Of the door at the hit [rad].
        restitution: Coefficient of restitution.
        effective_mass: At B [kg]; None: from the model.
        run_up: Default of the request.
        ending: Default of the request.
        com_inside_edge: How far inside the right sole's inner edge the CoM is at the hit [m].
        y_start: y of the CoM at the start of the run-up [m]; None: largest ZMP margin.
        door_uncertainty: By so much the door may be nearer or farther than planned [m]; the
            run-up keeps its speed so far before and past the nominal contact.
        overrun: Way of the run-up past the nominal contact that is wished for [m].
        required_margin: Smallest ZMP margin of a phase [m].
        limit_share: Of the joints' speed and torque limits that a plan may use.
        post_duration: From the end of `slow_down` to rest [s].
        sole_friction: Coefficient of friction that soles and floor are taken to have.
        contact_duration: Expected duration of the contact [s].
        leaf_friction: Coefficient of friction between elbow and leaf.
        switch_delay: So long after the contact's begin the legs keep their speed [s]: it is felt a
            few ms late, and a switch while the leaf still pushes would take w' from the door.
        slow_down: In which the legs then take up v'_rB [s].
        period: Sampling period of the motions [s].
        timing: Durations of the slow phases.
        hand_force_limit: Largest force of the door on the hand while it is held [N].
    """

    door_distance: float | None = None
    hinge_x: float | None = None
    nominal_l_b: float = 0.42
    initial_angle: float = 0.0
    restitution: float = 0.5
    effective_mass: float | None = None
    run_up: str = "mcv50"
    ending: str = "hold"
    com_inside_edge: float = 0.01
    y_start: float | None = None
    door_uncertainty: float = 0.02
    overrun: float = 0.025
    required_margin: float = 0.02
    limit_share: float = 0.9
    post_duration: float = 0.4
    sole_friction: float = 0.5
    contact_duration: float = 0.015
    leaf_friction: float = 0.3
    switch_delay: float = 0.012
    slow_down: float = 0.01
    period: float = 0.005
    timing: ApproachTiming = field(default_factory=ApproachTiming)
    hand_force_limit: float = 60.0


@dataclass(frozen=True)
class PhasePlan:
    """A phase of a plan.

    Attributes:
        name: As in the contract.
        knots: Of the 30 joints; times count from the start of the phase.
        com: At the knots, in odom, (K, 3) [m].
        zmp: At the knots, on the floor in odom, (K, 2) [m].
        time: Of the dense samples, (N,) [s].
        com_samples: (N, 3) [m].
        zmp_samples: (N, 2) [m].
        margin: Smallest distance of the ZMP to the edge of the support polygon [m].
        friction: Largest ratio of tangential to normal floor force.
        torque_ratio: Largest joint torque as a share of its limit.
        speed_ratio: Largest joint speed as a share of its limit.
        clearances: Nearest bodies of the robot, and nearest body to the leaf where there is one.
        leaf: Where the leaf is at the dense samples; None where it was not looked at. After the
            peak it has fallen for `hold.LATE` more.
    """

    name: str
    knots: Knots
    com: Array
    zmp: Array
    time: Array
    com_samples: Array
    zmp_samples: Array
    margin: float
    friction: float
    torque_ratio: float
    speed_ratio: float
    clearances: tuple[Clearance, ...]
    leaf: LeafCourse | None = None


@dataclass(frozen=True)
class Branches:
    """What if the door is not where it was said to be.

    Attributes:
        early_margin: Smallest ZMP margin after the hit of a door that is nearer by the stated
            uncertainty [m].
        late_margin: The same for one that is farther.
        point_of_no_return: A stop begun later than this before the contact no longer keeps the
            ZMP margin, or comes to the leaf [s].
        stop_duration: From the begin of a stop before that to rest [s].
        missed_margin: Distance of the capture point to the soles' edge where the contact is missed
            for good, where the legs reach no further [m]; negative: the robot falls.
        rest_duration: From when the legs have slowed down after the hit to rest [s].
    """

    early_margin: float
    late_margin: float
    point_of_no_return: float
    stop_duration: float
    missed_margin: float
    rest_duration: float

    @property
    def recovery_step(self) -> float:
        """How much nearer to the door a foot would have to be put after a missed contact [m]."""
        return max(0.0, -self.missed_margin)


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
