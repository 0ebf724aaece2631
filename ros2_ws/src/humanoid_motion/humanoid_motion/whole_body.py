"""Whole-body inverse kinematics: the waist moves to where the CoM is as wanted, the legs follow.

Section II.C.4 of the paper keeps the upper body and the height of the hip fixed during the run-up.
The same solver serves every phase, with upper body, height and feet given for each sample.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES
from numpy.typing import ArrayLike, NDArray

from humanoid_motion.chain import yaw_matrices
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel

# Displacement of the waist per displacement of the CoM in the first step of the search; the legs
# move less than the waist.
_WAIST_PER_COM = 1.17
_SLOPES = (0.5, 3.0)  # range of this ratio in later steps
_RELIABLE = 1e-7  # shortest displacement of the CoM that gives the ratio [m]
_TOLERANCE = 1e-8  # largest error of the CoM [m]; larger ones would show in accelerations
_MAX_ITERATIONS = 25
_ROUNDING = 1e-9  # by how much a planned motion may exceed a limit [rad, share of the limit]


def solve(
    robot: RobotModel,
    *,
    upper: ArrayLike,
    com_xy: ArrayLike,
    waist_z: ArrayLike,
    feet: dict[str, Array],
    strict: bool = True,
    near: Array | None = None,
    tolerance: float = _TOLERANCE,
    waist_per_com: float | None = None,
    base_yaw: ArrayLike | None = None,
    feet_yaw: Mapping[str, ArrayLike] | None = None,
) -> tuple[Array, Array]:
    """Compute joints and base for a course of the CoM over the floor.

    Args:
        upper: Joints of the upper body in the robot's order, (N, J) or (J,) [rad]; the legs'
            columns are ignored.
        com_xy: x and y of the CoM in odom, (N, 2) [m].
        waist_z: Height of base_link in odom, (N,) or a number [m].
        feet: Position of the sole in odom for each side, (N, 3) or (3,) [m]; soles stay level.
        strict: Whether to raise an error if a leg does not reach; otherwise that sample is NaN.
        near: Positions of base_link in odom where the search begins, (N, 3) [m]; None begins
            above the CoM.
        tolerance: Largest error of the CoM [m].
        waist_per_com: Displacement of the waist per displacement of the CoM, where it is known to a
            few percent; None means that the search finds it.
        base_yaw: Headings of the upright base_link, (N,) or a number [rad]; with `feet_yaw`.
        feet_yaw: Headings of the soles by side, (N,) or numbers [rad]; None means that soles and
            base_link stay parallel to odom.

    Returns:
        Joints (N, J) [rad] and positions of base_link in odom (N, 3) [m].

    Raises:
        PostureUnreachable: A leg does not reach, or no position of the waist puts the CoM there.
    """
    target = np.atleast_2d(np.asarray(com_xy, dtype=float))
    n = len(target)
    joints = np.array(np.broadcast_to(np.asarray(upper, dtype=float), (n, len(robot.joint_names))))
    base = np.empty((n, 3))
    base[:, :2] = target if near is None else near[:, :2]
    base[:, 2] = waist_z
    heading = turns = None
    if base_yaw is not None and feet_yaw is not None:
        heading = np.array(np.broadcast_to(np.asarray(base_yaw, dtype=float), n))
        turns = _LegTurns(robot, heading, feet_yaw)
    q = robot.configurations(base, joints, heading)
    slope = np.full((n, 2), waist_per_com or _WAIST_PER_COM)
    before, step = None, np.zeros((n, 2))
    for _ in range(_MAX_ITERATIONS):
        _place_legs(robot, joints, base, feet, strict, turns)
        q[:, :3] = base
        q[:, robot.q_index] = joints
        error = target - _com_xy(robot, q)
        if np.nanmax(np.abs(error), initial=0.0) < tolerance:
            return joints, base
        if before is not None and waist_per_com is None:
            _correct(slope, before - error, step)
        before, step = error, slope * error
        base[:, :2] += step
    raise _unplaced(float(np.nanmax(np.abs(error))), tolerance)


def _correct(slope: Array, gained: Array, step: Array) -> None:
    """Set the slopes by the secant method where a step was long enough for a reliable one."""
    clear = np.abs(gained) > _RELIABLE
    slope[clear] = (step[clear] / gained[clear]).clip(*_SLOPES)


def _unplaced(worst: float, tolerance: float) -> PostureUnreachable:
    """Make the error of a search that ends with a CoM that is `worst` [m] off its place."""
    return PostureUnreachable(
        f"no position of the waist puts the CoM where it should be: an error of {worst:.2e} m "
        f"remains, {tolerance:.0e} m are allowed",
        quantity="CoM error [m]", value=worst, limit=tolerance)


class _LegTurns:
    """Turns of base and feet about the vertical that stay the same throughout the search."""

    def __init__(
        self, robot: RobotModel, base_yaw: Array, feet_yaw: Mapping[str, ArrayLike]
    ) -> None:
        self.to_base = yaw_matrices(-base_yaw)
        self.sole, self.foot = {}, {}
        for side in SIDES:
            yaw = np.broadcast_to(np.asarray(feet_yaw[side], dtype=float), base_yaw.shape)
            self.sole[side] = yaw_matrices(yaw) @ robot.feet[side].sole
            self.foot[side] = yaw_matrices(yaw - base_yaw)


def _place_legs(
    robot: RobotModel, joints: Array, base: Array, feet: dict[str, Array], strict: bool,
    turns: _LegTurns | None,
) -> None:
    """Set the legs' joints such that the soles are at their places under the base."""
    for side in SIDES:
        place, rotation = np.asarray(feet[side], dtype=float), None
        if turns is None:
            ankle = place - robot.feet[side].sole - base
        else:
            rotation = turns.foot[side]
            ankle = np.einsum("nij,nj->ni", turns.to_base, place - turns.sole[side] - base)
        joints[:, robot.leg_columns[side]] = robot.legs[side].solve(
            ankle, rotation, strict=strict)


def _com_xy(robot: RobotModel, q: Array) -> Array:
    """Compute x and y of the CoM in odom for configurations (N, nq), (N, 2) [m]."""
    com = np.empty((len(q), 2))
    for i, row in enumerate(q):
        com[i] = pin.centerOfMass(robot.model, robot.data, row, False)[:2]
    return com


def within_ranges(
    robot: RobotModel, joints: Array, reserve: float | Array = 0.0
) -> NDArray[np.bool_]:
    """Return whether joints (..., J) [rad] keep a reserve [rad] from their ranges' ends, (..., J).

    NaN, which stands for a leg that does not reach, counts as outside.
    """
    return np.asarray((joints >= robot.lower + reserve) & (joints <= robot.upper - reserve))


def require_joint_limits(
    robot: RobotModel, motion: Motion, phase: str, reserve: float = 0.0, share: float = 1.0
) -> None:
    """Check positions and speeds of a motion against the joints' limits in the URDF.

    Args:
        phase: Name of the motion's phase, for the message.
        reserve: Distance that positions must keep from the ends of their ranges [rad].
        share: Share of the speed limits that may be used.

    Raises:
        JointLimit: A joint leaves its range or is too fast; the error names joint, value and limit.
    """
    out = np.maximum(robot.lower - motion.joints, motion.joints - robot.upper)
    i, j = np.unravel_index(int(np.argmax(out)), out.shape)
    if out[i, j] > _ROUNDING - reserve:
        value, name = float(motion.joints[i, j]), robot.joint_names[j]
        low, high = float(robot.lower[j]), float(robot.upper[j])
        raise JointLimit(
            f"{phase}: {name} would go to {np.rad2deg(value):.1f} deg, its range is "
            f"{np.rad2deg(low):.1f} to {np.rad2deg(high):.1f} deg",
            joint=name, phase=phase, quantity="position [rad]", value=value, limit=(low, high))
    _require_share(
        robot, motion.joint_speed, robot.speed_limit, share, phase, "speed [rad/s]",
        "turn at {:.2f} rad/s")


def require_torque_limits(
    robot: RobotModel, torque: Array, phase: str, share: float = 1.0
) -> None:
    """Check joint torques against the joints' limits in the URDF.

    Args:
        torque: Torques, (N, J) [N m].
        phase: Name of the motion's phase, for the message.
        share: Share of the torque limits that may be used.

    Raises:
        JointLimit: A torque is too large; the error names joint, value and limit.
    """
    _require_share(
        robot, torque, robot.effort_limit, share, phase, "torque [N m]", "need {:.0f} N m")


def _require_share(
    robot: RobotModel, values: Array, limits: Array, share: float, phase: str, quantity: str,
    would: str,
) -> None:
    """Check that values (N, J) stay within a share of their limits (J,)."""
    ratio = shares(values, limits)
    i, j = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    if ratio[i, j] > share + _ROUNDING:
        value, limit, name = abs(float(values[i, j])), share * limits[j], robot.joint_names[j]
        raise JointLimit(
            f"{phase}: {name} would {would.format(value)}, {limit:.2f} are allowed "
            f"({100.0 * share:.0f} % of its limit)",
            joint=name, phase=phase, quantity=quantity, value=value, limit=float(limit))


def shares(values: Array, limits: Array) -> Array:
    """Divide absolute values (N, J) by their limits (J,); infinite for NaN and for a limit of 0."""
    size = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(size == 0.0, 0.0, size / limits)
    return np.where(np.isnan(ratio), np.inf, ratio)
