"""Conversions between the planner's messages and its library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError
from door_impact_common.stamps import seconds
from door_impact_msgs.msg import CloserParameters, JointLoad, PhaseMargin, PlanPhase
from door_impact_msgs.msg import ImpactPlan as ImpactPlanMessage
from door_impact_msgs.srv import PlanDoorImpact
from door_model.checks import require_covariance
from door_model.door.geometry import FLOOR_CLEARANCE, DoorGeometry
from door_model.errors import DoorModelError, DoorParameterError
from door_model.identification.parameters import UNITS
from door_model.ros.messages import door_of
from geometry_msgs.msg import Point, Pose, Quaternion
from humanoid_motion.knots import Knots
from robot_driver.messages import trajectory_message
from trajectory_msgs.msg import JointTrajectory

from impact_planner.errors import NoDoor
from impact_planner.impact_plan import ImpactPlan
from impact_planner.motion.phase_plan import PhasePlan
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest

WORLD_FRAME = "odom"
# The message's fields of numbers and texts, which the plan has under the same names.
_SAME_NAME = tuple(
    name for name, kind in ImpactPlanMessage.get_fields_and_field_types().items()
    if kind in ("double", "uint32", "string"))


def knots_from_message(message: JointTrajectory, names: Sequence[str] | None) -> Knots:
    """Convert a JointTrajectory to knots.

    Args:
        message: The trajectory.
        names: Joint names in the order of the knots' columns; None keeps the message's order.

    Raises:
        ValueError: A joint is missing, a point lacks positions, velocities or accelerations, or a
            number is not finite.
    """
    order = None
    if names is not None and list(names) != list(message.joint_names):
        order = [list(message.joint_names).index(name) for name in names]
    points = message.points
    width = len(message.joint_names)
    columns = []
    for field in ("positions", "velocities", "accelerations"):
        rows = [np.asarray(getattr(point, field), dtype=float) for point in points]
        if any(row.shape != (width,) for row in rows):
            raise ValueError(f"every point of a plan's trajectory needs {width} {field}")
        table = np.array(rows)
        if not np.isfinite(table).all():
            raise ValueError(f"the {field} of a plan's trajectory must be finite")
        columns.append(table if order is None else table[:, order])
    time = [seconds(point.time_from_start) for point in points]
    return Knots(np.array(time), *columns)


def plan_message(
    plan: ImpactPlan, names: Sequence[str], stamp: Any, *, trajectories: bool
) -> ImpactPlanMessage:
    """Convert a plan to its message.

    Args:
        names: Joint names in the order of the knots' columns.
        stamp: Time of the planning, a builtin_interfaces/Time.
        trajectories: Whether the message contains the trajectories of phases and branches.
    """
    message = ImpactPlanMessage()
    message.header.stamp = stamp
    message.header.frame_id = WORLD_FRAME
    for field in _SAME_NAME:
        kind = type(getattr(message, field))
        setattr(message, field, kind(getattr(plan, field)))
    message.left_foot = _pose(plan.left_foot)
    message.right_foot = _pose(plan.right_foot)
    message.contact_point = _point(plan.contact_point)
    message.zmp_margins = [
        PhaseMargin(
            phase=phase.name,
            margin=phase.margin,
            speed_ratio=phase.speed_ratio,
            torque_ratio=phase.torque_ratio,
            body_clearance=phase.clearances[0].distance,
            leaf_clearance=phase.clearances[1].distance,
        )
        for phase in plan.phases
    ]
    message.joint_loads = [JointLoad(**asdict(load)) for load in plan.joint_loads]
    message.warnings = list(plan.warnings)
    if trajectories:
        message.phases = [_phase(phase, names) for phase in plan.phases]
        branches = plan.all_phases[len(plan.phases):]
        message.branches = [_phase(phase, names) for phase in branches]
    return message


def request_from_message(request: PlanDoorImpact.Request) -> PlanRequest:
    """Convert a service request; negative numbers and empty texts become None."""
    return PlanRequest(
        desired_opening_angle=float(request.desired_opening_angle),
        initial_angle=_given(request.initial_angle),
        restitution=_given(request.restitution),
        effective_mass=_given(request.effective_mass),
        door_distance=_given(request.door_distance),
        l_b=_given(request.l_b),
        run_up=request.run_up or None,
        ending=request.ending or None,
    )


def door_from_message(
    message: CloserParameters, geometry: DoorGeometry | None = None
) -> KnownDoor:
    """Convert the result of an identification to a door.

    The door has all that the message describes: assembly of the linkage, backcheck and latch zone,
    and friction. A covariance of zeros, or none, means that the parameters are exact.

    Args:
        message: The parameters.
        geometry: A door whose frame and hinge it has if the names are the same.

    Raises:
        NoDoor: The parameters describe no door: a number is not finite or out of its range, the
            linkage does not close, or the covariance does not belong to any random numbers.
    """
    try:
        door = door_of(message)
        parameters, covariance = _uncertainty(message)
        frame, hinge = None, KnownDoor.hinge
        if geometry is not None and geometry.name == message.door:
            hinge = geometry.hinge
            around = geometry.with_leaf(replace(geometry.leaf, width=message.leaf_width))
            frame = None if around.frame is None else (around.leaf, around.frame)
    except DoorModelError as error:
        raise NoDoor(
            f"closer_parameters describes no door: {error}",
            quantity=error.quantity,
            value=error.value,
            limit=error.limit,
        ) from error
    return KnownDoor(
        name=message.door,
        door=door,
        width=float(message.leaf_width),
        frame=frame,
        hinge=hinge,
        top=FLOOR_CLEARANCE + message.leaf_height if message.leaf_height >= 0.0 else math.inf,
        parameters=parameters,
        covariance=covariance,
        warnings=tuple(message.warnings),
    )


def failure_response(
    response: PlanDoorImpact.Response, error: DoorImpactError
) -> PlanDoorImpact.Response:
    """Fill in a response with the error that prevented a plan."""
    response.success = False
    response.error_code = getattr(PlanDoorImpact.Response, error.reason.upper())
    response.message = str(error)
    return response


def _uncertainty(message: CloserParameters) -> tuple[tuple[str, ...], Array | None]:
    """Return the names of the uncertain parameters and their covariance, None if all are exact."""
    names = tuple(message.identified)
    for place, name in enumerate(names):
        given = name in UNITS and (name == "tau_c0_prime" or getattr(message, name) >= 0.0)
        if not given or name in names[:place]:
            raise DoorParameterError(
                "each name in identified", repr(name), "a parameter of the message, named once")
    if len(message.covariance) not in (0, len(names) ** 2):
        raise DoorParameterError(
            f"covariance of {len(names)} identified parameters",
            f"{len(message.covariance)} numbers", f"{len(names) ** 2} numbers or none")
    covariance = np.array(message.covariance, dtype=float)
    if not covariance.any():
        return (), None
    covariance = covariance.reshape(len(names), -1)
    require_covariance("covariance", covariance)
    return names, covariance


def _given(value: float) -> float | None:
    return None if value < 0.0 else float(value)


def _phase(phase: PhasePlan, names: Sequence[str]) -> PlanPhase:
    return PlanPhase(
        name=phase.name,
        trajectory=trajectory_message(phase.knots, names),
        com=[_point(row) for row in phase.com],
        zmp=[_point((*row, 0.0)) for row in phase.zmp],
    )


def _point(position: Sequence[float] | Array) -> Point:
    x, y, z = (float(value) for value in position)
    return Point(x=x, y=y, z=z)


def _pose(position: Array) -> Pose:
    return Pose(position=_point(position), orientation=Quaternion(w=1.0))
