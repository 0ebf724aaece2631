"""The robot and the leaf in the hit as a linear system: masses, rubber, gears, and contact rows.

The system describes deviations from the commanded run-up, which begin at zero when the elbow
touches the leaf, in the posture of the hit, in which the arm has yielded to the pads that press it:
within the contact the robot moves by some millimetres.
Its coordinates are the motions that the soles allow (they neither slide nor turn on the floor,
their rubber yields along the vertical and in tilt), and the leaf's angle. Where the robot's
configuration has drives, each joint is a coordinate too, which hangs on its motor by the gear.
Otherwise the joints keep their commanded course, and the robot is one rigid body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.drives_and_pads import Drives
from hrp2_description.robot import SIDES
from humanoid_motion.dynamics import inverse_dynamics, joint_torques
from humanoid_motion.motion import still
from humanoid_motion.pads import TANGENTIAL, normal_and_tangents, pad_contact
from humanoid_motion.robot_model import RobotModel
from numpy.typing import NDArray
from scipy.linalg import block_diag, null_space

BASE = slice(0, 6)  # entries of the free base in Pinocchio's velocity vector
_SAME = 1e-9  # smallest independent motion, relative to the largest


@dataclass(frozen=True)
class PadRow:
    """The pads in the posture of the hit.

    Attributes:
        row: Derivatives of the depth and of the two tangential displacements by Pinocchio's
            velocity, (3, nv).
        stiffness: Stiffness along the normal and the tangents, (3,) [N/m].
        damping: Damping along them, (3,) [N s/m].
        friction: Coefficient of friction.
        preload: Force that presses the pads in the commanded posture, and their friction along the
            tangents that is left from the pressing, (3,) [N].
    """

    row: Array
    stiffness: Array
    damping: Array
    friction: float
    preload: Array


@dataclass(frozen=True)
class HitStructure:
    """The robot in the posture of the hit.

    F is the number of motions that the soles allow.

    Attributes:
        motions: These motions as columns of Pinocchio's velocity, (nv, F).
        inertia: Pinocchio's mass matrix, (nv, nv).
        stiffness: Stiffness of the soles' rubber by Pinocchio's velocity, (nv, nv).
        damping: Its damping, (nv, nv).
        run_up: Pinocchio's velocity for 1 m/s of point B along the leaf's normal, (nv,).
        touch: Derivatives of point B along the leaf's normal and two tangents, (3, nv).
        approach: Velocity of B along the normal and the tangents for 1 m/s along the normal, (3,).
        pads: The pads; None without a brace, or where the posture does not press them.
        columns: Columns of the joints in Pinocchio's velocity, (J,).
        drives: Motors and gears; None means rigid joints.
        torque: Torques of the gears before the hit, (J,) [N m].
        limit: Largest torques of the motors, (J,) [N m].
        com: Position of the CoM relative to base_link, (3,) [m].
        loose: Speed that 1 N s across the soles, along y, gives to them on ice, if the robot is
            rigid [1/kg].
    """

    motions: Array
    inertia: Array
    stiffness: Array
    damping: Array
    run_up: Array
    touch: Array
    approach: Array
    pads: PadRow | None
    columns: NDArray[np.int_]
    drives: Drives | None
    torque: Array
    limit: Array
    com: Array
    loose: float


def hit_structure(
    robot: RobotModel, base: Array, joints: Array, feet: dict[str, Array], normal: Array
) -> HitStructure:
    """Describe the robot in the posture of the hit.

    Args:
        base: Position of base_link in odom, (3,) [m].
        joints: Commanded angles of the joints, (J,) [rad].
        feet: Places of the soles in odom by side, (3,) each [m].
        normal: Unit normal of the leaf in odom, pointing into the door, (3,).
    """
    held, pads, give = _at_rest(robot, base, joints, feet)
    q = robot.configuration(base, joints + give)
    inertia = robot.mass_matrix(q)
    grip, stiffness, damping = _soles(robot, q)
    columns = np.arange(robot.model.nv) if robot.config.drives else np.arange(6)
    free = null_space(grip[:, columns], rcond=_SAME)
    motions = np.zeros((robot.model.nv, free.shape[1]))
    motions[columns] = free
    axes = normal_and_tangents(normal)
    jacobian = robot.frame_jacobian(q, robot.config.contact_link)
    center = jacobian[:3]
    point = center - pin.skew(robot.config.contact_radius * normal) @ jacobian[3:]
    run_up = _run_up(robot, q) / -float(normal[1])
    across = grip[1::3, BASE].mean(axis=0)  # motion of both soles along y
    return HitStructure(
        motions, inertia, stiffness, damping, run_up, axes @ point, axes @ center @ run_up, pads,
        robot.v_index, robot.config.drives, held, robot.effort_limit, robot.com(q) - base,
        float(across @ np.linalg.solve(inertia[BASE, BASE], across)))


def _run_up(robot: RobotModel, q: Array) -> Array:
    """Compute Pinocchio's velocity in the run-up for 1 m/s of the upper body along -y, (nv,)."""
    velocity = np.zeros(robot.model.nv)
    velocity[1] = -1.0
    for side in SIDES:
        jacobian = robot.frame_jacobian(q, robot.feet[side].frame)
        leg = robot.v_index[robot.leg_columns[side]]
        velocity[leg] = np.linalg.lstsq(jacobian[:, leg], jacobian[:, 1], rcond=None)[0]
    return velocity


def _soles(robot: RobotModel, q: Array) -> tuple[Array, Array, Array]:
    """Compute constraints and forces of the soles.

    A rigid sole on rubber resists tilt in proportion to the square of half its length or width.

    Returns:
        Jacobian of the prevented motions, which are sliding along x and y and yaw of each sole,
        (6, nv); stiffness (nv, nv) and damping (nv, nv) of the rubber.
    """
    known, held = robot.config.sole_rubber, []
    give = np.zeros((robot.model.nv, robot.model.nv))
    for side in SIDES:
        foot = robot.feet[side]
        x_min, x_max, y_min, y_max = foot.rectangle
        middle = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
        jacobian = robot.frame_jacobian(q, foot.frame)
        move = jacobian[:3] - pin.skew(middle) @ jacobian[3:]
        held += [*move[:2], jacobian[5]]
        tilt = 0.5 * np.array([[y_max - y_min], [x_max - x_min]]) * jacobian[3:5]
        sinking = np.vstack([move[2], tilt])
        give += sinking.T @ sinking
    if known is None:
        return np.array(held), 0.0 * give, 0.0 * give
    return np.array(held), known.stiffness * give, known.damping * give


def _at_rest(
    robot: RobotModel, base: Array, joints: Array, feet: dict[str, Array]
) -> tuple[Array, PadRow | None, Array]:
    """Compute the gears' torques (J,) [N m], the pads and the joints' give before the hit.

    The commanded posture presses the pads into each other. The servos and the gears between them
    yield until their torques bear the pads' force, which lifts the elbow: the give is what this
    adds to the commanded angles, (J,) [rad]. The driver leads the motors by what they yield under
    the weight. The ball comes along the disc's normal, so that friction holds it where it touches
    as far as it can.
    """
    motion = still(joints, base)
    held = joint_torques(robot, motion, inverse_dynamics(robot, motion), feet, SIDES)[0]
    brace, drives, rigid = robot.config.brace, robot.config.drives, np.zeros(len(joints))
    if brace is None or drives is None:
        return held, None, rigid
    found = pad_contact(robot, robot.configuration(base, joints), brace)
    if found.beside > 0.0 or found.offset[0] >= 0.0:  # nothing presses the pads
        return held, None, rigid
    row = found.jacobian.copy()
    row[0] *= -1.0  # the depth grows as the ball comes nearer
    of_joints = row[:, robot.v_index]
    share = np.array([1.0, TANGENTIAL, TANGENTIAL])
    depth = np.array([-float(found.offset[0]), 0.0, 0.0])
    soft = 1.0 / drives.stiffness + 1.0 / drives.position_gain
    gives = (of_joints * soft) @ of_joints.T + np.diag(1.0 / (brace.stiffness * share))
    preload = np.linalg.solve(gives, depth)
    along, most = float(np.linalg.norm(preload[1:])), brace.friction * float(preload[0])
    if along > most:  # the ball slides until friction holds it
        force = np.array([1.0, *(brace.friction / along * preload[1:])])
        preload = depth[0] / float(gives[0] @ force) * force
    pressed = of_joints.T @ preload
    return held + pressed, PadRow(
        row, brace.stiffness * share, brace.damping * share, brace.friction, preload
    ), -soft * pressed


def reduced(structure: HitStructure, i_a: float) -> tuple[Array, Array, Array]:
    """Return mass, damping and stiffness of the allowed motions and the leaf, (F + 1, F + 1).

    Args:
        i_a: Moment of inertia of the leaf about its hinge [kg m^2].
    """
    along = structure.motions
    mass, damping, stiffness = (
        along.T @ matrix @ along
        for matrix in (structure.inertia, structure.damping, structure.stiffness))
    return block_diag(mass, i_a), block_diag(damping, 0.0), block_diag(stiffness, 0.0)
