"""Where the right hand meets the leaf, section II.C.1: as far from the hinge as the arm reaches.

One small nonlinear programme chooses two postures of the arm at once, with the hand on the same
spot of the leaf. The first posture stops the falling leaf and is near enough to the braced arm to
be reached in time. The second posture holds the leaf at the desired angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.robot_model import RobotModel
from scipy.optimize import minimize

from impact_planner.hit.leaf import LeafFrame

CLEARANCE = 0.02  # distance of elbow and wrist from the leaf beyond their radius [m]
_RESERVE = np.deg2rad(4.0)  # distance kept from the joints' limits [rad]
_EDGE = 0.02  # smallest part of the leaf beyond the hand [m]
_EFFORT = 0.02  # weight of the joints' travel against the hand's distance from the hinge [m]
_TOLERANCE = 1e-5  # largest distance of the hand from its target [m]
_NEWTON_STEPS = 10  # limit of iterations: seven are enough wherever the hand can reach
_LARGEST_VIOLATION = 1e-4  # of a constraint in an accepted solution [m]
_HAND, _ELBOW, _WRIST = 0, 1, 2  # indices of the frames of `ArmReach`
_EQUALITIES, _INEQUALITIES = 4, 7  # numbers of constraints

FramePlace = tuple[Array, Array]
"""Position of a frame in odom (3,) [m], and its Jacobian to scaled joints (3, A) [m]."""


@dataclass(frozen=True)
class HandOnLeaf:
    """Two postures of the arm with the hand on one spot of the leaf.

    Attributes:
        nearest: Joints of the arm where the leaf comes nearest to the robot, (A,) [rad].
        final: Joints of the arm at the desired angle, (A,) [rad].
        radius: Distance of the hand from the hinge along the leaf [m].
        height: Height of the hand above the floor [m].
    """

    nearest: Array
    final: Array
    radius: float
    height: float


class ArmReach:
    """Kinematics of the right arm for a base that stands still.

    Attributes:
        columns: Columns of the arm's joints among the robot's joints, (A,).
        hand_radius: Radius of the sphere that stands for the hand [m].
        elbow_radius: Radius of the spheres that stand for elbow and wrist [m].
        heights: Lowest and highest allowed height of the hand above the floor [m].
        lower: Lower limits of the arm's joints with a reserve, (A,) [rad].
        upper: Upper limits of the arm's joints with a reserve, (A,) [rad].
    """

    def __init__(self, robot: RobotModel) -> None:
        """Look up the arm of a robot."""
        self._robot = robot
        self.columns = robot.arm_columns
        self._v = robot.v_index[self.columns]
        self._frames = (
            robot.config.hand_link, robot.config.contact_link, robot.config.arm.wrist_link)
        self.hand_radius = robot.hand_radius()
        self.elbow_radius = robot.config.contact_radius
        self.heights = robot.config.arm.heights
        self.lower = robot.lower[self.columns] + _RESERVE
        self.upper = robot.upper[self.columns] - _RESERVE
        arm = robot.config.arm
        bound = self.upper if arm.straightest_elbow < 0.0 else self.lower
        bound[arm.joints.index(arm.elbow)] = arm.straightest_elbow

    def furthest(self, width: float) -> float:
        """Largest distance of the hand from the hinge on a leaf of a given width [m]."""
        return width - _EDGE - self.hand_radius

    def follow(self, bases: Array, joints: Array, arm: Array, targets: Array) -> Array:
        """Find the smallest change of the arm that puts the hand on targets.

        Args:
            bases: Positions of base_link in odom, (N, 3) [m].
            joints: Joints of the robot, (J,) [rad]; the arm's are ignored.
            arm: Postures of the arm to start from, (N, A) [rad].
            targets: Targets for the middle of the hand in odom, (N, 3) [m].

        Returns:
            Postures of the arm, (N, A) [rad]. A row is NaN where the hand does not reach.
        """
        chain = self._robot.hand_chain
        mine = np.array([list(chain.columns).index(column) for column in self.columns])
        whole = np.tile(joints, (len(arm), 1))
        whole[:, self.columns] = arm
        for _ in range(_NEWTON_STEPS):
            pose = chain.place(whole, bases)
            error = targets - pose.end
            if np.abs(error).max() < 1e-9:
                break
            j = pose.jacobian()[:, :, mine]
            gram = j @ np.swapaxes(j, 1, 2) + 1e-9 * np.eye(3)
            change = np.swapaxes(j, 1, 2) @ np.linalg.solve(gram, error[:, :, None])
            whole[:, self.columns] += change[:, :, 0]
        found = whole[:, self.columns]
        inside = (found > self.lower - _RESERVE) & (found < self.upper + _RESERVE)
        reached = np.linalg.norm(targets - chain.place(whole, bases).end, axis=1) < _TOLERANCE
        return np.where((reached & inside.all(axis=1))[:, None], found, np.nan)

    def choose(
        self,
        base: Array,
        joints: Array,
        leaf: tuple[LeafFrame, LeafFrame],
        furthest: float,
        travel: Array,
    ) -> HandOnLeaf | None:
        """Choose the spot on the leaf and both postures.

        Args:
            base: Position of base_link in odom, (3,) [m].
            joints: Joints of the robot with its arm braced, (J,) [rad].
            leaf: The leaf where it comes nearest to the robot, and the leaf at the end.
            furthest: Largest allowed distance of the hand from the hinge [m].
            travel: How far each joint of the arm can turn before the catch, (A,) [rad].

        Returns:
            The postures; None where the arm has no such postures.
        """
        start = joints[self.columns]
        low = np.concatenate([np.maximum(self.lower, start - travel), self.lower])
        high = np.concatenate([np.minimum(self.upper, start + travel), self.upper])
        if np.any(low > high):
            return None
        programme = _HandProgramme(self, base, joints, leaf, furthest, travel)
        low, high = ((bound - np.tile(start, 2)) / programme.unit for bound in (low, high))
        result = minimize(
            programme.cost,
            np.clip(0.0, low, high),
            jac=True,
            method="SLSQP",
            bounds=list(zip(low, high, strict=True)),
            constraints=programme.constraints(),
            options={"maxiter": 120, "ftol": 1e-5},
        )
        return programme.solution(np.asarray(result.x))

    def places(self, base: Array, joints: Array, arm: Array, unit: Array) -> list[FramePlace]:
        """Places of hand, elbow and wrist for one posture of the arm.

        Args:
            base: Position of base_link in odom, (3,) [m].
            joints: Joints of the robot, (J,) [rad]; the arm's are replaced.
            arm: Joints of the arm, (A,) [rad].
            unit: Change of each joint of the arm that counts as 1, (A,) [rad].
        """
        full = joints.copy()
        full[self.columns] = arm
        q = self._robot.configuration(base, full)
        return [(place, jacobian[:3, self._v] * unit)
                for place, jacobian in self._robot.frames_at(q, self._frames)]


class _HandProgramme:
    """The nonlinear programme: unknowns are the joints of both postures, (2 A,), without unit.

    An unknown is a joint's change from the braced arm over `unit`, so that the cost of travel is
    half of the squared unknowns: SLSQP starts with the unit matrix as its Hessian.
    """

    def __init__(
        self,
        reach: ArmReach,
        base: Array,
        joints: Array,
        leaf: tuple[LeafFrame, LeafFrame],
        furthest: float,
        travel: Array,
    ) -> None:
        """State the programme; arguments as for `ArmReach.choose`."""
        self._reach, self._base, self._joints = reach, base, joints
        self._leaf, self._furthest = leaf, furthest
        self._start = joints[reach.columns]
        self._n = len(self._start)
        self.unit = np.tile(travel, 2) / np.sqrt(_EFFORT)
        # SLSQP asks for cost, constraints and slopes at the same unknowns in turn.
        self._cached = lru_cache(maxsize=2)(self._compute)

    def cost(self, x: Array) -> tuple[float, Array]:
        """Travel of the joints less the hand's distance from the hinge, and the slope of that."""
        (_, _), (final, jacobian) = self._both(x, _HAND)
        leaf = self._leaf[1]
        slope = x.copy()
        slope[self._n:] -= leaf.along @ jacobian
        return 0.5 * float(x @ x) - float(leaf.radius(final)), slope

    def constraints(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """The constraints in the form of `scipy.optimize.minimize`."""
        return (
            {"type": "eq", "fun": self._equal, "jac": self._equal_slope},
            {"type": "ineq", "fun": self._clear, "jac": self._clear_slope},
        )

    def solution(self, x: Array) -> HandOnLeaf | None:
        """The postures of a solution (2 A,); None where it breaks a constraint."""
        if np.max(np.abs(self._equal(x))) > _LARGEST_VIOLATION:
            return None
        if np.min(self._clear(x)) < -_LARGEST_VIOLATION:
            return None
        final = self._both(x, _HAND)[1][0]
        radius = float(self._leaf[1].radius(final))
        if radius < self._reach.hand_radius + _EDGE:
            return None  # the hand is behind the hinge, where the leaf has no face
        nearest, last = self._arms(x)
        return HandOnLeaf(nearest, last, radius, float(final[2]))

    def _arms(self, x: Array) -> Array:
        """Joints of the arm in both postures, (2, A) [rad]."""
        return np.asarray(self._start + (x * self.unit).reshape(2, self._n))

    def _compute(self, x: bytes) -> list[list[FramePlace]]:
        """Places of all frames in both postures, for the bytes of the unknowns."""
        unit = self.unit[:self._n]
        return [
            self._reach.places(self._base, self._joints, arm, unit)
            for arm in self._arms(np.frombuffer(x))]

    def _both(self, x: Array, frame: int) -> list[FramePlace]:
        """Place of a frame in both postures."""
        return [place[frame] for place in self._cached(x.tobytes())]

    def _equal(self, x: Array) -> Array:
        """Zero where the hand is on the face in both postures, and on the same spot, (4,) [m]."""
        (a, _), (b, _) = self._both(x, _HAND)
        leaf, radius = self._leaf, self._reach.hand_radius
        return np.array([
            leaf[0].gap(a) - radius,
            leaf[1].gap(b) - radius,
            leaf[0].radius(a) - leaf[1].radius(b),
            a[2] - b[2],
        ])

    def _equal_slope(self, x: Array) -> Array:
        """Slope of `_equal` by the unknowns, (4, 2 A) [m]."""
        (_, ja), (_, jb) = self._both(x, _HAND)
        leaf, n = self._leaf, self._n
        out = np.zeros((_EQUALITIES, 2 * n))
        out[0, :n] = -leaf[0].normal @ ja
        out[1, n:] = -leaf[1].normal @ jb
        out[2, :n], out[2, n:] = leaf[0].along @ ja, -leaf[1].along @ jb
        out[3, :n], out[3, n:] = ja[2], -jb[2]
        return out

    def _clear(self, x: Array) -> Array:
        """Positive where elbow and wrist clear the leaf and the hand is within bounds, (7,) [m].

        In order: elbow at both leaves, wrist at both leaves, distance to the furthest spot, and
        the hand's distance to its lowest and highest place.
        """
        leaf, reach = self._leaf, self._reach
        gaps = [
            leaf[i].gap(place[i][0]) - reach.elbow_radius - CLEARANCE
            for place in (self._both(x, _ELBOW), self._both(x, _WRIST))
            for i in (0, 1)
        ]
        final = self._both(x, _HAND)[1][0]
        lowest, highest = reach.heights
        room = self._furthest - leaf[1].radius(final)
        return np.array([*gaps, room, final[2] - lowest, highest - final[2]])

    def _clear_slope(self, x: Array) -> Array:
        """Slope of `_clear` by the unknowns, (7, 2 A) [m]."""
        leaf, n = self._leaf, self._n
        out = np.zeros((_INEQUALITIES, 2 * n))
        row = 0
        for place in (self._both(x, _ELBOW), self._both(x, _WRIST)):
            for i in (0, 1):
                out[row, i * n : (i + 1) * n] = -leaf[i].normal @ place[i][1]
                row += 1
        jb = self._both(x, _HAND)[1][1]
        out[4, n:] = -leaf[1].along @ jb
        out[5, n:], out[6, n:] = jb[2], -jb[2]
        return out
