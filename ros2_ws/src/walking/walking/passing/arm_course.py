"""The arm's course while its hand keeps the leaf open.

The base moves as the walk demands, the leaf turns as planned, and the hand shall lie on its face
all the time. All nodes of the course are found together, by Gauss-Newton on one sum of squares:
small accelerations, the hand on the face, and no elbow or wrist in the leaf. So the arm looks
ahead, and passes evenly from the leaf in front of the robot to the leaf behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.chain import Chain
from humanoid_motion.knots import Knots
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import Motion
from humanoid_motion.robot_model import RobotModel
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

_NODES = 0.1  # time between two nodes of a course [s]
_ITERATIONS = 40  # limit of the Gauss-Newton steps
_CONVERGED = 1e-3  # share by which a step must reduce the sum, or the search ends
_HOPELESS = 1e8  # damping at which the search ends
# The distances to the leaf count less at first, so that the arm finds its way past the body.
_LOOSER = (100.0, 10.0, 1.0)
_DAMPING = 1.0  # weight of the change in one iteration, growing where a step does not help
# What a residual of 1 is.
_FACE = 0.0005  # distance of the hand from its wanted distance to the face [m]
_LIMIT = 0.005  # by how much a bound is exceeded [m]
_RANGE = 0.005  # by how much a joint exceeds its range [rad]
_BEND = 3.0  # second derivative of the fastest joint; less of slower ones [rad/s^2]
_POSTURE = 0.5  # distance from the comfortable posture [rad]
_RADIUS = 0.1  # distance of the hand from its favourite radius [m]


@dataclass(frozen=True)
class ArmTask:
    """What the arm shall do at N nodes, evenly spaced in time.

    Attributes:
        time: Times of the nodes, (N,) [s].
        joints: Joints of the robot; the arm's are replaced, (N, J) [rad].
        base: Positions of base_link in odom, (N, 3) [m].
        yaw: Headings of base_link, (N,) [rad].
        leaf: The leaf at the nodes.
        holds: Whether the hand shall lie on the face, (N,) of bool.
        gap: Distance of the hand's middle from the face while it holds, (N,) [m].
        radii: Smallest and largest distance of the hand from the hinge while it holds [m].
        radius: Distance of the hand from the hinge that is aimed at while it holds [m].
        heights: Lowest and highest place of the hand above the floor while it holds [m].
        others: Smallest distances of elbow and wrist from the face while it holds [m].
        comfortable: Posture of the arm that is aimed at, (A,) [rad].
    """

    time: Array
    joints: Array
    base: Array
    yaw: Array
    leaf: LeafFrame
    holds: NDArray[np.bool_]
    gap: Array
    radii: tuple[float, float]
    radius: float
    heights: tuple[float, float]
    others: tuple[float, float]
    comfortable: Array


def even_nodes(motion: Motion) -> NDArray[np.int_]:
    """Return the samples of a motion at which the nodes of a course are, (N,).

    They are even: a short last interval would make the spline through them bend hard there.
    """
    count = round(float(motion.time[-1]) / _NODES) + 1
    return np.linspace(0, len(motion) - 1, count).round().astype(int)


class ArmCourse:
    """Finds the course of the right arm.

    Args:
        robot: The robot.
        reserve: Distance kept from the ends of the joints' ranges [rad].

    Attributes:
        columns: Columns of the arm's joints in the robot's order, (A,).
    """

    def __init__(self, robot: RobotModel, reserve: float = 0.05) -> None:
        config = robot.config
        self.columns = robot.arm_columns
        self._lower = robot.lower[self.columns] + reserve
        self._upper = robot.upper[self.columns] - reserve
        fastest = robot.speed_limit[self.columns]
        self._bend = _BEND * fastest / fastest.max()
        self._hand = robot.hand_chain
        self._others = [Chain(robot.model, robot.joint_names, frame)
                        for frame in (config.contact_link, config.arm.wrist_link)]

    def knots(self, time: Array, arm: Array, upper: Knots) -> Knots:
        """Put a course of the arm in the place of what knots of the upper body have for it.

        Args:
            time: Times of the nodes and of the knots, (N,) [s].
            arm: The arm's joints at the nodes, (N, A) [rad].
            upper: The knots.
        """
        spline = CubicSpline(time, arm, bc_type="clamped")
        found = [rows.copy() for rows in (upper.position, upper.velocity, upper.acceleration)]
        for order, rows in enumerate(found):
            rows[:, self.columns] = spline(time, order)
        return Knots(time, *found)

    def solve(self, task: ArmTask, start: Array) -> Array:
        """Find the arm's course, which begins at rest.

        Args:
            task: The task.
            start: The arm at the first two nodes, (A,) [rad].

        Returns:
            Joints of the arm at the nodes, (N, A) [rad].
        """
        step = float(task.time[1] - task.time[0])
        arm = np.tile(start, (len(task.time), 1))
        for looser in _LOOSER:
            arm = self._improved(task, arm, step, looser)
        return arm

    def _improved(self, task: ArmTask, arm: Array, step: float, looser: float) -> Array:
        """Improve a course with all distances to the leaf weighted less by a factor."""
        damping, rows = _DAMPING, self._linearised(task, arm, looser)
        cost = self._cost(rows[0], arm, step)
        for _ in range(_ITERATIONS):
            change = _newton_step(rows, arm, self._bend * step**2, damping)
            tried = arm.copy()
            tried[2:] += change
            new = self._linearised(task, tried, looser)
            new_cost = self._cost(new[0], tried, step)
            if new_cost > cost:
                damping *= 8.0
                if damping > _HOPELESS:
                    break
                continue
            less = (cost - new_cost) / cost
            arm, rows, cost, damping = tried, new, new_cost, max(0.2 * damping, 1e-6)
            if less < _CONVERGED:
                break
        return arm

    def gap(self, task: ArmTask, arm: Array) -> Array:
        """Compute the distance of the hand's middle from the leaf's face, (N,) [m]."""
        return task.leaf.gap(self._hand.place(self._whole(task, arm), task.base, task.yaw).end)

    def radius(self, task: ArmTask, arm: Array) -> Array:
        """Compute the distance of the hand's middle from the hinge along the leaf, (N,) [m]."""
        return task.leaf.radius(self._hand.place(self._whole(task, arm), task.base, task.yaw).end)

    def _whole(self, task: ArmTask, arm: Array) -> Array:
        joints = task.joints.copy()
        joints[:, self.columns] = arm
        return joints

    def _linearised(self, task: ArmTask, arm: Array, looser: float) -> tuple[Array, Array]:
        """Residuals of each node, (N, R), and their slopes by the arm's joints, (N, R, A)."""
        joints, leaf, holds = self._whole(task, arm), task.leaf, task.holds
        hand = self._hand.place(joints, task.base, task.yaw)
        slope = self._mine(self._hand, hand.jacobian())
        gap, gap_slope = leaf.gap(hand.end), -np.einsum("ni,nia->na", leaf.normal, slope)
        radius, radius_slope = leaf.radius(hand.end), np.einsum("ni,nia->na", leaf.along, slope)
        height, height_slope = hand.end[:, 2], slope[:, 2]
        found: list[tuple[Array, Array]] = []

        def add(
            value: Array, rows: Array, unit: float, counts: NDArray[np.bool_] | bool = True,
        ) -> None:
            share = np.broadcast_to(np.where(counts, 1.0 / unit, 0.0), value.shape)
            found.append((share * value, share[:, None] * rows))

        lack, limit = gap - task.gap, _LIMIT * max(1.0, 0.1 * looser)
        add(lack, gap_slope, _FACE * looser, holds)
        add(radius - task.radius, radius_slope, _RADIUS, holds)
        for value, rows, (low, high) in ((radius, radius_slope, task.radii),
                                         (height, height_slope, task.heights)):
            add(value - low, rows, limit, holds & (value < low))
            add(value - high, rows, limit, holds & (value > high))
        for chain, smallest in zip(self._others, task.others, strict=True):
            pose = chain.place(joints, task.base, task.yaw)
            mine = self._mine(chain, pose.jacobian())
            away = leaf.gap(pose.end) - smallest
            add(away, -np.einsum("ni,nia->na", leaf.normal, mine), limit, holds & (away < 0.0))
        unit = np.eye(len(self.columns))
        for joint in range(len(self.columns)):
            rows = np.tile(unit[joint], (len(arm), 1))
            value = arm[:, joint]
            add(value - task.comfortable[joint], rows, _POSTURE)
            out = value - value.clip(self._lower[joint], self._upper[joint])
            add(out, rows, _RANGE, out != 0.0)
        return (np.stack([value for value, _ in found], axis=1),
                np.stack([rows for _, rows in found], axis=1))

    def _cost(self, residuals: Array, arm: Array, step: float) -> float:
        bend = np.diff(arm, 2, axis=0) / step**2 / self._bend
        return float((residuals[2:] ** 2).sum() + (bend**2).sum())

    def _mine(self, chain: Chain, jacobian: Array) -> Array:
        """Columns of a chain's Jacobian (N, 3, C) for the arm's joints, (N, 3, A)."""
        out = np.zeros((*jacobian.shape[:2], len(self.columns)))
        for place, column in enumerate(chain.columns):
            mine = np.flatnonzero(self.columns == column)
            if mine.size:
                out[:, :, mine[0]] = jacobian[:, :, place]
        return out


def _newton_step(
    rows: tuple[Array, Array], arm: Array, bend: Array, damping: float
) -> Array:
    """Solve the linearised problem for the change of all nodes but the first two, (N - 2, A).

    Args:
        rows: Residuals and their slopes.
        arm: The course, (N, A) [rad].
        bend: Second differences that count as 1, (A,) [rad].
        damping: Weight of the change.
    """
    residuals, slopes = rows[0][2:], rows[1][2:]
    count, joints = len(residuals), arm.shape[1]
    weight = 1.0 / bend**2
    second = np.diff(arm, 2, axis=0)
    gradient = second.copy()
    gradient[:-1] -= 2.0 * second[1:]
    gradient[:-2] += second[2:]
    gradient = weight * gradient + np.einsum("nra,nr->na", slopes, residuals)
    blocks = np.swapaxes(slopes, 1, 2) @ slopes + damping * np.eye(joints)
    # Banded by joints within nodes: a node has its own block and two neighbours on each side.
    banded = np.zeros((2 * joints + 1, count * joints))
    for one in range(joints):
        for two in range(one, joints):
            banded[one - two - 1, two::joints] += blocks[:, one, two]
    # The squares of the second differences, of which the first two nodes are given.
    before_last, before = np.arange(count) < count - 2, np.arange(count) < count - 1
    for away, diagonal in enumerate((
            1.0 + 4.0 * before + before_last, -2.0 - 2.0 * before_last[:-1],
            np.ones(count - 2))):
        for joint in range(joints):
            banded[-1 - away * joints, away * joints + joint :: joints] += weight[joint] * diagonal
    found = solveh_banded(banded, -gradient.ravel(), lower=False, check_finite=False)
    return np.asarray(found.reshape(count, joints))
