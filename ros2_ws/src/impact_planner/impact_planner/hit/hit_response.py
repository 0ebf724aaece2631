"""Response of the robot to an impulse at point B: effective mass, and impulses of floor and brace.

The drives keep the speed of the run-up during the contact and the brace holds the arm, so the
robot turns as one rigid body. Its soles do not slip, but their rubber yields along the vertical
and in tilt. The elbow slides along the leaf as the robot turns, and friction acts against the
slide. If the robot is hit at its center of percussion and the leaf is smooth, the floor exerts no
horizontal impulse, and the effective mass is that of eq. (3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from humanoid_motion.robot_model import RobotModel
from numpy.typing import ArrayLike
from scipy.linalg import null_space

_STEPS = 60  # number of integration steps in a contact
_BASE = slice(0, 6)  # entries of the free base in Pinocchio's velocity vector


@dataclass(frozen=True)
class HitResponse:
    """Response of the robot to 1 N s at point B along the leaf's normal.

    Attributes:
        mass: Effective mass at B [kg].
        floor: Impulse of the floor's force on the robot per impulse at B, axes of odom, (3,) [-].
        floor_yaw: Impulse of the floor's moment about the vertical through the CoM per impulse at
            B [m].
        brace: Impulse of the torque at each braced joint per impulse at B [m].
        slide: Speed that the soles would reach per impulse at B without friction [1/kg].
    """

    mass: float
    floor: Array
    floor_yaw: float
    brace: dict[str, float]
    slide: float


def hit_response(
    robot: RobotModel, q: Array, *, normal: ArrayLike, leaf_friction: float, duration: float
) -> HitResponse:
    """Integrate the motion of the robot through a force at B that is a half sine over time.

    Without friction and rubber, the effective mass is that of a rigid body, Khatib's
    ``1 / (J M^-1 J^T)`` (1987) with the horizontal places of the soles as constraints.

    Args:
        robot: The robot.
        q: Configuration at the hit with level soles.
        normal: Normal of the leaf in odom, pointing into the door, (3,); any length.
        leaf_friction: Coefficient of friction between elbow and leaf.
        duration: Duration of the contact [s].
    """
    n = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    inertia = robot.mass_matrix(q)
    whole = inertia[_BASE, _BASE]
    touched = _contact_point_jacobian(robot, q, n)
    point = touched[:, _BASE]
    grip, stiffness, damping = _soles(robot, q)
    free = null_space(grip)  # motions of the base that the soles allow
    reduced = free.T @ whole @ free
    outer = _force(reduced, point @ free, n, leaf_friction)  # force of the leaf for 1 N
    speed, rubber = _through_contact(
        reduced, free.T @ point.T @ outer, free, stiffness, damping, duration)
    change = free @ speed
    # The momentum that leaf and rubber do not explain comes from the floor's grip.
    rest = whole @ change - point.T @ outer - rubber
    held = np.linalg.lstsq(grip.T, rest, rcond=None)[0]
    floor = rubber[:3] + grip.T[:3] @ held
    braced = robot.config.braced_joints
    rows = robot.v_index[robot.indices(braced)]
    torque = inertia[rows, _BASE] @ change - touched[:, rows].T @ outer
    arm = robot.com(q) - q[:3]  # moments on the base are about its origin
    loose = grip @ np.linalg.solve(whole, point.T @ outer)
    yaw = float((grip.T[3:] @ held + rubber[3:] - np.cross(arm, floor))[2])
    return HitResponse(
        mass=-1.0 / float(n @ point @ change), floor=floor, floor_yaw=yaw,
        brace=dict(zip(braced, torque.tolist(), strict=True)),
        slide=float(np.hypot(*loose[:2])))


def _through_contact(
    reduced: Array, pushed: Array, free: Array, stiffness: Array, damping: Array, duration: float
) -> tuple[Array, Array]:
    """Integrate the motion of the base through a half sine of force with an impulse of 1 N s.

    Args:
        reduced: Mass matrix of the motions that the soles allow, (F, F).
        pushed: Generalised force of the leaf on these motions for 1 N, (F,).
        free: Motions of the base that the soles allow, (6, F).
        stiffness: Stiffness of the soles' rubber for motions of the base, (6, 6).
        damping: Damping of the soles' rubber for motions of the base, (6, 6).
        duration: Duration of the contact [s].

    Returns:
        Speeds of the allowed motions after the contact, (F,), and the impulse of the rubber on
        the base, (6,).
    """
    soft, damped = free.T @ stiffness @ free, free.T @ damping @ free
    step = duration / _STEPS
    # Implicit Euler, which is stable for any stiffness of the rubber.
    ahead = np.linalg.inv(reduced + step * damped + step**2 * soft)
    moved, speed = np.zeros(len(pushed)), np.zeros(len(pushed))
    rubber = np.zeros(6)
    force = 0.5 * np.pi / duration * np.sin(np.pi * (np.arange(_STEPS) + 0.5) / _STEPS)
    for now in force / (step * force.sum()):  # the sum of all impulses is 1 N s
        speed = ahead @ (reduced @ speed + step * (pushed * now - soft @ moved))
        moved = moved + step * speed
        rubber -= step * (stiffness @ free @ moved + damping @ free @ speed)
    return speed, rubber


def _contact_point_jacobian(robot: RobotModel, q: Array, normal: Array) -> Array:
    """Jacobian of the elbow's outermost point along a normal (3,), axes of odom, (3, nv)."""
    center, turn = robot.contact_jacobian(q), robot.contact_turn_jacobian(q)
    return np.asarray(center - pin.skew(robot.config.contact_radius * normal) @ turn)


def _soles(robot: RobotModel, q: Array) -> tuple[Array, Array, Array]:
    """Constraints and forces of the soles on the base.

    A rigid sole on rubber resists tilt in proportion to the square of half its length or width.

    Returns:
        Jacobian of the prevented motions, which are sliding along x and y and yaw, (3, 6); the
        stiffness (6, 6) and the damping (6, 6) of the rubber for motions of the base.
    """
    known = robot.config.sole_rubber
    held, give, share = np.zeros((3, 6)), np.zeros((6, 6)), 1.0 / len(SIDES)
    for side in SIDES:
        foot = robot.feet[side]
        x_min, x_max, y_min, y_max = foot.rectangle
        middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
        jacobian = robot.frame_jacobian(q, foot.frame)[:, _BASE]
        move = jacobian[:3] - pin.skew(middle) @ jacobian[3:]
        held += share * np.vstack([move[:2], jacobian[5]])
        tilt = 0.5 * np.array([[y_max - y_min], [x_max - x_min]]) * jacobian[3:5]
        sinking = np.vstack([move[2], tilt])
        give += sinking.T @ sinking
    if known is None:
        return held, 0.0 * give, 0.0 * give
    return held, known.stiffness * give, known.damping * give


def _force(reduced: Array, point: Array, normal: Array, friction: float) -> Array:
    """Force of the leaf on the elbow for a normal force of 1 N, (3,) [N].

    Friction acts against the sliding of the elbow and is at most what stops it.

    Args:
        reduced: Mass matrix of the motions that the soles allow, (F, F).
        point: Jacobian of the contact point for these motions, (3, F).
        normal: Unit normal of the leaf, pointing into the door, (3,).
        friction: Coefficient of friction between elbow and leaf.
    """
    mobility = point @ np.linalg.solve(reduced, point.T)
    slide = (np.eye(3) - np.outer(normal, normal)) @ mobility @ -normal
    speed = float(np.linalg.norm(slide))
    if speed == 0.0:
        return -normal
    along = slide / speed
    stops = speed / float(along @ mobility @ along)
    return np.asarray(-normal - min(friction, stops) * along)
