"""Momentum transfer of a planned hit, section II.C.3: effective mass, speeds of B, loads.

The equations (2) to (4) themselves are in `momentum`.
"""

from __future__ import annotations

from dataclasses import dataclass

from humanoid_motion.robot_model import RobotModel

from impact_planner.errors import InvalidRequest
from impact_planner.hit import momentum
from impact_planner.hit.floor_load import FloorLoad, floor_load
from impact_planner.hit.hit_response import hit_response
from impact_planner.hit.stance import HitStance, LeafContact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import ResolvedRequest
from impact_planner.task.settings import PlannerSettings


@dataclass(frozen=True)
class MomentumTransfer:
    """What the hit demands of the robot, and what brace and floor must carry.

    Attributes:
        mass: Effective mass m_re at B that the plan uses [kg].
        model_mass: Effective mass at B by the model alone, before requests and learning [kg].
        planar_mass: Effective mass at B of a free body in the frontal plane, eq. (3) [kg].
        speeds: Speeds of B along the leaf's normal before and after the hit, and the impulse.
        braking: Angular impulse that closer and hinge friction take from the hit [N m s].
        floor: Load of the hit on the feet.
        brace: Impulse of the torque that the brace carries, by joint [N m s].
    """

    mass: float
    model_mass: float
    planar_mass: float
    speeds: momentum.ImpactSpeeds
    braking: float
    floor: FloorLoad
    brace: dict[str, float]


def plan_transfer(
    robot: RobotModel,
    known: KnownDoor,
    wanted: ResolvedRequest,
    settings: PlannerSettings,
    stance: HitStance,
    contact: LeafContact,
    omega: float,
) -> MomentumTransfer:
    """Compute the speeds of B that give the door an angular velocity, and the loads of the hit.

    Args:
        robot: The robot.
        known: The door.
        wanted: The request.
        settings: Configuration.
        stance: Feet and posture at the hit.
        contact: Where the elbow meets the leaf.
        omega: Angular velocity w' of the door after the hit [rad/s].

    Raises:
        InvalidRequest: The requested effective mass exceeds the robot's mass.
    """
    posture = stance.posture
    response = hit_response(
        robot, robot.configuration(posture.base, posture.joints), normal=contact.normal,
        leaf_friction=settings.leaf_friction, duration=settings.contact_duration)
    mass = _mass_to_plan_with(robot, wanted, response.mass)
    held_back = float(known.door.restoring_torque(wanted.initial_angle)) + known.door.friction
    braking = momentum.closer_braking(held_back, settings.contact_duration)
    speeds = momentum.speeds_for(
        omega, i_a=known.door.i_a, l_b=contact.l_b, effective_mass=mass,
        restitution=wanted.restitution, braking=braking)
    return MomentumTransfer(
        mass=mass,
        model_mass=response.mass,
        planar_mass=momentum.effective_mass_planar(robot.mass, posture.i_rob, posture.a_r),
        speeds=speeds,
        braking=braking,
        floor=floor_load(
            robot.mass, posture, response, speeds.impulse, settings.contact_duration,
            settings.sole_friction),
        brace={joint: speeds.impulse * each for joint, each in response.brace.items()},
    )


def _mass_to_plan_with(
    robot: RobotModel, wanted: ResolvedRequest, model_mass: float
) -> float:
    """The requested effective mass, otherwise the model's times the learned factor [kg]."""
    if wanted.effective_mass is None:
        return wanted.mass_factor * model_mass
    if wanted.effective_mass > robot.mass:
        raise InvalidRequest(
            f"effective_mass is {wanted.effective_mass:g} kg, more than the robot's whole mass of "
            f"{robot.mass:g} kg; request a smaller one, or a negative one for the model's",
            quantity="effective_mass [kg]",
            value=wanted.effective_mass,
            limit=robot.mass,
        )
    return wanted.effective_mass
