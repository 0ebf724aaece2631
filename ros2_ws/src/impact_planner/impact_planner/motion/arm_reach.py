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
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel
from scipy.optimize import minimize

CLEARANCE = 0.02  # distance of elbow and wrist from the leaf beyond their radius [m]
_RESERVE = np.deg2rad(4.0)  # distance kept from the joints' limits [rad]
_EDGE = 0.02  # smallest part of the leaf beyond the hand [m]
_EFFORT = 0.02  # weight of the joints' travel against the hand's distance from the hinge [m]
_TOLERANCE = 1e-5  # largest distance of the hand from its target [m]
_NEWTON_STEPS = 10  # limit of iterations: seven are enough wherever the hand can reach
_LARGEST_VIOLATION = 1e-4  # of a constraint in an accepted solution [m]
_HAND, _ELBOW, _WRIST = 0, 1, 2  # indices of the frames of `ArmReach`

FramePlace = tuple[Array, Array]
"""Position of a frame in odom (3,) [m], and its slope by scaled joints [m]."""


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

    def __init__(self, robot: RobotModel, top: float = np.inf) -> None:
        """Look up the arm of a robot.

        Args:
            robot: The robot.
            top: Height of the leaf's upper edge above the floor [m].
        """
        self._robot = robot
        self.columns = robot.arm_columns
        self._v = robot.v_index[self.columns]
        self._frames = (
            robot.config.hand_link, robot.config.contact_link, robot.config.arm.wrist_link)
        self.hand_radius = robot.hand_radius
        self.elbow_radius = robot.config.contact_radius
        lowest, highest = robot.config.arm.heights
        self.heights = lowest, min(highest, top - self.hand_radius)
        self.lower = robot.lower[self.columns] + _RESERVE
        self.upper = robot.upper[self.columns] - _RESERVE
        arm = robot.config.arm
        bound = self.upper if arm.straightest_elbow < 0.0 else self.lower
        bound[arm.joints.index(arm.elbow)] = arm.straightest_elbow

    def furthest(self, width: float) -> float:
        """Return the largest distance of the hand from the hinge on a leaf of a width [m]."""
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
        # No joint turns farther than its range, and a scale beyond that would hinder the search.
        travel = np.minimum(travel, self.upper - self.lower)
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
        """Compute the places of hand, elbow and wrist for one posture of the arm, slopes (3, A).

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
    half of the squared unknowns: SLSQP starts with the unit matrix as its Hessian. Cost and
    constraints are pairs of values and their slopes by the unknowns.
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
        """Return the joints' travel less the hand's distance from the hinge, and its slope."""
        final, slope, leaf = *self._places(x)[1][_HAND], self._leaf[1]
        return 0.5 * float(x @ x) - float(leaf.radius(final)), x - leaf.along @ slope

    def constraints(self) -> list[dict[str, Any]]:
        """Return the constraints in the form of `scipy.optimize.minimize`."""
        return [
            {"type": kind, "fun": lambda x, of=of: of(x)[0], "jac": lambda x, of=of: of(x)[1]}
            for kind, of in (("eq", self._equal), ("ineq", self._clear))]

    def solution(self, x: Array) -> HandOnLeaf | None:
        """Return the postures of a solution (2 A,); None where it breaks a constraint."""
        if np.max(np.abs(self._equal(x)[0])) > _LARGEST_VIOLATION:
            return None
        if np.min(self._clear(x)[0]) < -_LARGEST_VIOLATION:
            return None
        final = self._places(x)[1][_HAND][0]
        radius = float(self._leaf[1].radius(final))
        if radius < self._reach.hand_radius + _EDGE:
            return None  # the hand is behind the hinge, where the leaf has no face
        nearest, last = self._arms(x)
        return HandOnLeaf(nearest, last, radius, float(final[2]))

    def _arms(self, x: Array) -> Array:
        """Return the joints of the arm in both postures, (2, A) [rad]."""
        return np.asarray(self._start + (x * self.unit).reshape(2, self._n))

    def _places(self, x: Array) -> list[list[FramePlace]]:
        """Return the places of hand, elbow and wrist in both postures, slopes (3, 2 A)."""
        return self._cached(x.tobytes())

    def _compute(self, x: bytes) -> list[list[FramePlace]]:
        unit, none = self.unit[:self._n], np.zeros((3, self._n))
        return [
            [(place, np.hstack([none, slope] if number else [slope, none]))
             for place, slope in self._reach.places(self._base, self._joints, arm, unit)]
            for number, arm in enumerate(self._arms(np.frombuffer(x)))]

    def _equal(self, x: Array) -> tuple[Array, Array]:
        """Return zeros where the hand is on both faces, at the same spot, (4,) [m] and (4, 2 A)."""
        ((a, ja), *_), ((b, jb), *_) = self._places(x)
        (near, last), radius = self._leaf, self._reach.hand_radius
        return np.array([
            near.gap(a) - radius, last.gap(b) - radius, near.radius(a) - last.radius(b),
            a[2] - b[2],
        ]), np.array([
            -near.normal @ ja, -last.normal @ jb, near.along @ ja - last.along @ jb, ja[2] - jb[2],
        ])

    def _clear(self, x: Array) -> tuple[Array, Array]:
        """Return what must be positive, (7,) [m] and (7, 2 A).

        In order: gaps of elbow and wrist at both leaves, distance to the furthest spot, and the
        hand's distance to its lowest and highest place.
        """
        last, reach, places = self._leaf[1], self._reach, self._places(x)
        pairs = [(self._leaf[i], *places[i][frame]) for frame in (_ELBOW, _WRIST) for i in (0, 1)]
        gaps = [leaf.gap(place) - reach.elbow_radius - CLEARANCE for leaf, place, _ in pairs]
        (final, slope), (lowest, highest) = places[1][_HAND], reach.heights
        room = self._furthest - last.radius(final)
        return (
            np.array([*gaps, room, final[2] - lowest, highest - final[2]]),
            np.array([*(-leaf.normal @ one for leaf, _, one in pairs), -last.along @ slope,
                      slope[2], -slope[2]]))
