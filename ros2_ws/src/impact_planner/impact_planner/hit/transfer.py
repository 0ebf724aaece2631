"""Momentum transfer of a planned hit, section II.C.3: effective mass, speeds of B, loads.

The equations (2) to (4) themselves are in `momentum`. Effective mass and apparent restitution are
those of the simulated hit (`hit_response`). The restitution of request, settings and experience is
that of the leaf's surface; the give of arm, gears and soles makes the apparent one smaller.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from door_model.door.surface import mass_of_hit, surface

from impact_planner.errors import InvalidRequest
from impact_planner.hit import momentum
from impact_planner.hit.door_prediction import DoorPrediction
from impact_planner.hit.floor_load import FloorLoad, floor_load
from impact_planner.hit.hit_response import HitResponse, HitSimulation, LeafToHit, Switch
from impact_planner.hit.hit_structure import hit_structure
from impact_planner.hit.joint_load import JointLoad, joint_loads
from impact_planner.hit.placement import Placement, stand
from impact_planner.hit.posture import LegDemands
from impact_planner.hit.stance import HitStance, LeafContact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import Task
from impact_planner.task.settings import PlannerSettings

_ROUNDS = 2  # simulated hits that find v_rB; mass and restitution hardly depend on the speed
_OTHER = 0.05  # difference of the surface's restitution from which the slope is taken
_MIDDLE = 0.5  # restitution towards which it lies
_FIRST_RATIO = 0.2  # first guess of the speed after the hit over that before it


@dataclass(frozen=True)
class MomentumTransfer:
    """What the hit demands of the robot, and what joints, pads and floor must carry.

    Attributes:
        mass: Effective mass m_re at B that the plan uses [kg].
        planar_mass: Effective mass at B of a free body in the frontal plane, eq. (3) [kg].
        restitution: Apparent coefficient of restitution that eqs. (2) to (4) use.
        restitution_slope: Change of the apparent restitution per change of the surface's.
        speeds: Speeds of B along the leaf's normal before and after the hit, and the impulse.
        braking: Angular impulse that closer and hinge friction take from the hit [N m s].
        floor: Load of the hit on the feet.
        response: The simulated hit, with mass and restitution by the model alone.
        loads: Loads of the joints, the largest first; empty for a robot without drives.
        brace: Impulse of the torque that the hit adds at each braced joint [N m s].
    """

    mass: float
    planar_mass: float
    restitution: float
    restitution_slope: float
    speeds: momentum.ImpactSpeeds
    braking: float
    floor: FloorLoad
    response: HitResponse
    loads: tuple[JointLoad, ...]
    brace: dict[str, float]


@dataclass(frozen=True)
class Blow:
    """The decisions about a hit, without the motion towards it: sections II.C.1 to II.C.3.

    Attributes:
        prediction: Motion of the door after the hit, section II.C.2.
        placement: Place of the door, section II.C.1.
        stance: Feet and posture at the hit, sections II.C.1 and II.C.4.
        contact: Place where the elbow meets the leaf.
        transfer: Effective mass, speeds of B and loads of the hit, section II.C.3.
    """

    prediction: DoorPrediction
    placement: Placement
    stance: HitStance
    contact: LeafContact
    transfer: MomentumTransfer

    @property
    def v_run_up(self) -> float:
        """Speed of B towards -y before the hit [m/s].

        Eqs. (2) to (4) are along the leaf's normal, which differs from -y where the door is ajar.
        """
        return self.transfer.speeds.v_rb / -float(self.contact.normal[1])


def plan_blow(task: Task, prediction: DoorPrediction, demands: LegDemands, step: float) -> Blow:
    """Decide stance and v_rB; arguments and errors as for `stand` and `plan_transfer`."""
    placement, stance, contact = stand(task, demands, step)
    transfer = plan_transfer(task, placement, stance, contact, prediction.omega)
    return Blow(prediction, placement, stance, contact, transfer)


def plan_transfer(
    task: Task, placement: Placement, stance: HitStance, contact: LeafContact, omega: float
) -> MomentumTransfer:
    """Compute the speeds of B that give the door an angular velocity, and the loads of the hit.

    Args:
        contact: Where the elbow meets the leaf.
        omega: Angular velocity w' of the door after the hit [rad/s].

    Raises:
        InvalidRequest: The requested effective mass exceeds the robot's mass.
    """
    robot, wanted, settings, posture = task.robot, task.wanted, task.settings, stance.posture
    structure = hit_structure(robot, posture.base, posture.joints, stance.feet, contact.normal)
    surfaces = wanted.restitution, wanted.restitution + (
        _OTHER if wanted.restitution < _MIDDLE else -_OTHER)
    leaf, other = (
        leaf_to_hit(task.known, settings, placement, contact, wanted.initial_angle, restitution)
        for restitution in surfaces)
    simulation = HitSimulation(structure, leaf)
    planar = momentum.effective_mass_planar(robot.mass, posture.i_rob, posture.a_r)
    law = {"i_a": leaf.i_a, "l_b": leaf.l_b}
    speeds = momentum.speeds_for(
        omega, effective_mass=planar, restitution=wanted.restitution, **law)
    switch = Switch(
        settings.detection_delay + settings.switch_delay, settings.slow_down, _FIRST_RATIO)
    for _ in range(_ROUNDS):
        response = simulation.hit(speeds.v_rb, switch)
        mass = _mass_to_plan_with(task, response.mass)
        given = wanted.apparent_restitution
        # Eqs. (2) to (4) are meant for 0 to 1.
        restitution = min(max(response.restitution, 0.0), 1.0) if given is None else given
        braking = leaf.l_b * response.impulse - leaf.i_a * response.omega
        speeds = momentum.speeds_for(
            omega, effective_mass=mass, restitution=restitution, braking=braking, **law)
        switch = replace(switch, ratio=speeds.ratio)
    elsewhere = HitSimulation(structure, other).hit(response.v_rb, switch)
    slope = (elsewhere.restitution - response.restitution) / (surfaces[1] - surfaces[0])
    scale = speeds.impulse / response.impulse
    braced = robot.config.braced_joints
    rows = scale * response.joint_impulse[robot.indices(braced)]
    return MomentumTransfer(
        mass=mass,
        planar_mass=planar,
        restitution=restitution,
        restitution_slope=slope,
        speeds=speeds,
        braking=braking,
        floor=floor_load(
            robot.mass, posture, response, speeds.impulse, settings.sole_friction),
        response=response,
        loads=joint_loads(robot, response),
        brace=dict(zip(braced, rows.tolist(), strict=True)),
    )


def leaf_to_hit(
    known: KnownDoor, settings: PlannerSettings, placement: Placement, contact: LeafContact,
    angle: float, restitution: float,
) -> LeafToHit:
    """Describe the leaf in the hit.

    Args:
        angle: Opening angle at the hit [rad].
        restitution: Coefficient of restitution of the leaf's surface. It is that of a free mass
            that hits the leaf at x = 0; the elbow, which hits the same spring and damper farther
            from the hinge, meets less of the leaf's mass and thus sees more damping.
    """
    door = known.door
    return LeafToHit(
        i_a=door.i_a,
        l_b=contact.l_b,
        torque=float(door.restoring_torque(angle)) + door.friction,
        surface=surface(
            restitution, settings.contact_duration, mass_of_hit(door.i_a, placement.hinge_x)),
        friction=settings.leaf_friction,
    )


def _mass_to_plan_with(task: Task, model_mass: float) -> float:
    """Return the requested effective mass, otherwise the model's times the learned factor [kg]."""
    wanted, most = task.wanted, task.robot.mass
    if wanted.effective_mass is None:
        return wanted.mass_factor * model_mass
    if wanted.effective_mass > most:
        raise InvalidRequest(
            f"effective_mass is {wanted.effective_mass:g} kg, more than the robot's whole mass of "
            f"{most:g} kg; request a smaller one, or a negative one for the model's",
            quantity="effective_mass [kg]", value=wanted.effective_mass, limit=most)
    return wanted.effective_mass
