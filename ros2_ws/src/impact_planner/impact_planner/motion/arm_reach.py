"""Where the right hand meets the leaf, section II.C.1: as far from the hinge as the arm reaches.

One small nonlinear programme chooses two postures of the arm at once, with the hand on the same
spot of the leaf: one that stops the falling leaf, near enough to the braced arm to be reached
in time, and one that holds it at the desired angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.robot_model import RobotModel
from scipy.optimize import minimize

from impact_planner.hit.leaf import LeafFrame

CLEARANCE = 0.02  # of elbow and wrist from the leaf beyond their radius [m]
_RESERVE = np.deg2rad(4.0)  # kept from the joints' limits
_EDGE = 0.02  # of the leaf beyond the hand [m]
_EFFORT = 0.02  # [m]; weight of the joints' travel against distance from the hinge
_TOLERANCE = 1e-5  # [m]
_NEWTON_STEPS = 10  # they converge within seven, or the hand is out of reach
_HAND = 0  # place in what `_places` gives: hand, elbow, wrist


@dataclass(frozen=True)
class HandOnLeaf:
    """The two postures of the arm.

    Attributes:
        nearest: The arm's joints where the leaf comes nearest to the robot, (A,) [rad].
        final: The same at the desired angle.
        radius: Distance of the hand from the hinge along the leaf [m].
        height: Of the hand [m].
    """

    nearest: Array
    final: Array
    radius: float
    height: float


class ArmReach:
    """Kinematics of the right arm for a base that stands still."""

    def __init__(self, robot: RobotModel) -> None:
        """Look up the arm in the model."""
        self._robot = robot
        self.columns = robot.arm_columns
        self._v = robot.v_index[self.columns]
        self._frames = (
            robot.config.hand_link, robot.config.contact_link, robot.config.arm.wrist_link)
        self.hand_radius = robot.hand_radius()
        self.lower = robot.lower[self.columns] + _RESERVE
        self.upper = robot.upper[self.columns] - _RESERVE
        arm = robot.config.arm
        bound = self.upper if arm.straightest_elbow < 0.0 else self.lower
        bound[arm.joints.index(arm.elbow)] = arm.straightest_elbow

    def furthest(self, width: float) -> float:
        """Largest distance of the hand from the hinge on a leaf of a width [m]."""
        return width - _EDGE - self.hand_radius

    def follow(self, bases: Array, joints: Array, arm: Array, targets: Array) -> Array:
        """Least change of the arm that puts the hand on targets; NaN where it does not get there.

        Args:
            bases: base_link (N, 3) [m].
            joints: The robot (J,) [rad]; its arm is ignored.
            arm: Postures of the arm near by (N, A) [rad].
            targets: Middle of the hand (N, 3) [m].

        Returns:
            (N, A) [rad].
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
            base: base_link (3,) [m].
            joints: The robot with its arm braced, (J,) [rad].
            leaf: The leaf where it comes nearest and at the end.
            furthest: Largest distance of the hand from the hinge [m].
            travel: How far each joint of the arm can turn before the catch, (A,) [rad].

        Returns:
            The postures; None where there are none.
        """
        start = joints[self.columns]
        n = len(start)
        low = np.concatenate([np.maximum(self.lower, start - travel), self.lower])
        high = np.concatenate([np.minimum(self.upper, start + travel), self.upper])
        if np.any(low > high):
            return None

        # Unknowns in which the cost of travel is half their square, as SLSQP takes it at first.
        unit = np.tile(travel, 2) / np.sqrt(_EFFORT)
        low, high = ((bound - np.tile(start, 2)) / unit for bound in (low, high))

        @lru_cache(maxsize=2)  # cost, constraints and their slopes are asked for in turn
        def places(x: bytes) -> list[list[tuple[Array, Array]]]:
            """Hand, elbow and wrist at both leaves: position and Jacobian to the unknowns."""
            arms = start + (np.frombuffer(x) * unit).reshape(2, n)
            return [self._places(base, joints, arm, unit[:n]) for arm in arms]

        def both(x: Array, frame: int) -> list[tuple[Array, Array]]:
            return [place[frame] for place in places(x.tobytes())]

        def cost(x: Array) -> tuple[float, Array]:
            (_, _), (final, jacobian) = both(x, _HAND)
            slope = x.copy()
            slope[n:] -= leaf[1].along @ jacobian
            return 0.5 * float(x @ x) - float(leaf[1].radius(final)), slope

        result = minimize(
            cost,
            np.clip(0.0, low, high),
            jac=True,
            method="SLSQP",
            bounds=list(zip(low, high, strict=True)),
            constraints=self._constraints(both, leaf, furthest, n),
            options={"maxiter": 120, "ftol": 1e-5},
        )
        x = np.asarray(result.x)
        equal, clear = self._constraints(both, leaf, furthest, n)
        if np.max(np.abs(equal["fun"](x))) > 1e-4 or np.min(clear["fun"](x)) < -1e-4:
            return None
        final = both(x, _HAND)[1][0]
        radius = float(leaf[1].radius(final))
        if radius < self.hand_radius + _EDGE:
            return None  # behind the hinge, where there is no leaf
        nearest, last = start + (x * unit).reshape(2, n)
        return HandOnLeaf(nearest, last, radius, float(final[2]))

    def _places(
        self, base: Array, joints: Array, arm: Array, unit: Array
    ) -> list[tuple[Array, Array]]:
        """Position (3,) [m] of hand, elbow and wrist, Jacobian to joints over units (A,) [m]."""
        full = joints.copy()
        full[self.columns] = arm
        q = self._robot.configuration(base, full)
        return [(place, jacobian[:3, self._v] * unit)
                for place, jacobian in self._robot.frames_at(q, self._frames)]

    def _constraints(self, both, leaf, furthest, n):  # type: ignore[no-untyped-def]
        """Hand on the face and on one spot; elbow and wrist clear of the leaf; on the leaf."""
        robot, radius = self._robot, self.hand_radius
        hand, elbow, wrist = _HAND, 1, 2
        lowest, highest = robot.config.arm.heights

        def equal(x: Array) -> Array:
            (a, _), (b, _) = both(x, hand)
            return np.array(
                [
                    leaf[0].gap(a) - radius,
                    leaf[1].gap(b) - radius,
                    leaf[0].radius(a) - leaf[1].radius(b),
                    a[2] - b[2],
                ]
            )

        def equal_slope(x: Array) -> Array:
            (_, ja), (_, jb) = both(x, hand)
            out = np.zeros((4, 2 * n))
            out[0, :n] = -leaf[0].normal @ ja
            out[1, n:] = -leaf[1].normal @ jb
            out[2, :n], out[2, n:] = leaf[0].along @ ja, -leaf[1].along @ jb
            out[3, :n], out[3, n:] = ja[2], -jb[2]
            return out

        def clear(x: Array) -> Array:
            gaps = [
                leaf[i].gap(place[i][0]) - robot.config.contact_radius - CLEARANCE
                for place in (both(x, elbow), both(x, wrist))
                for i in (0, 1)
            ]
            final = both(x, hand)[1][0]
            room = furthest - leaf[1].radius(final)
            return np.array([*gaps, room, final[2] - lowest, highest - final[2]])

        def clear_slope(x: Array) -> Array:
            out = np.zeros((7, 2 * n))
            row = 0
            for place in (both(x, elbow), both(x, wrist)):
                for i in (0, 1):
                    out[row, i * n : (i + 1) * n] = -leaf[i].normal @ place[i][1]
                    row += 1
            jb = both(x, hand)[1][1]
            out[4, n:] = -leaf[1].along @ jb
            out[5, n:], out[6, n:] = jb[2], -jb[2]
            return out

        return (
            {"type": "eq", "fun": equal, "jac": equal_slope},
            {"type": "ineq", "fun": clear, "jac": clear_slope},
        )
