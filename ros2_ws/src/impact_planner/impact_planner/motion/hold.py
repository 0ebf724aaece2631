"""The ending `hold`, section II.C.1: the arm catches the closing leaf and pushes it back.

The phase begins at the door's peak. The robot has no contact with the door then (constraint 4 of
section II.B), so the leaf closes while the arm extends. `impact_planner.motion.catch` chooses where
and when they meet. While the hand pushes the leaf to the desired angle, the CoM leans against the
closer's torque of eq. (12).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from humanoid_motion.dynamics import Load
from humanoid_motion.errors import JointLimit, PostureUnreachable
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import min_jerk, rest_to_rest
from humanoid_motion.spline import evaluate, quintic
from humanoid_motion.whole_body import solve

from impact_planner.errors import AngleUnreachable
from impact_planner.motion.approach import StandingPhase, sample_times
from impact_planner.motion.arm_reach import ArmReach, HandOnLeaf
from impact_planner.motion.catch import Catch, HoldTask, choices, require_force, unreachable
from impact_planner.motion.phase_plan import PhasePlan

_NODES = 0.035  # time between solved postures, which a spline connects [s]
# Shares of the lean that keeps the ZMP in place; the second is tried where the legs do not reach.
_LEANS = (1.0, 0.5)
_PASSES = 2  # iterations of base and arm, which move each other a little
_ENTRY = 4  # number of postures on the leaf that decide the speed and acceleration of the catch
_SPEEDS = 25  # number of samples of the extension's speed
# Ratio of an extension's speed to its limit from which the extension is refused before its whole
# motion is computed; the speed that is then known was at most 0.6 % too large on 900 motions.
_CLEARLY = 1.02


@dataclass(frozen=True)
class HoldPlan:
    """The phase `hold` before its check.

    Attributes:
        phase: Motion and supporting feet.
        load: Force of the leaf on the hand.
        catch: Meeting of the hand with the leaf.
        hand: Spot of the hand on the leaf.
        force: Largest force of the leaf on the hand after the arrival [N].
    """

    phase: StandingPhase
    load: Load
    catch: Catch
    hand: HandOnLeaf
    force: float


def plan_hold(hold: HoldTask, check: Callable[[HoldPlan], PhasePlan]) -> PhasePlan:
    """Plan the phase `hold`: the first candidate that passes every check.

    Args:
        check: Function that checks a motion against the limits of joints, floor and bodies and
            returns it as a phase of the plan.

    Raises:
        AngleUnreachable: The arm does not reach, the force is too large, or the door is shut
            before the arm arrives. Where no candidate exists, the limit is the nearest angle that
            can be held [rad].
        JointLimit: A joint would be too fast or leave its range.
        PostureUnreachable: The legs do not reach, or bodies come too near to each other.
    """
    reach = ArmReach(hold.task.robot, hold.task.known.top)
    best: Candidate | None = None
    for catch, hand in choices(hold, reach):
        for lean in _LEANS:
            candidate = Candidate(hold, reach, catch, hand, lean)
            best = best or candidate
            with suppress(AngleUnreachable, JointLimit, PostureUnreachable):
                if not candidate.is_hopeless():
                    return check(candidate.plan())
    if best is None:
        raise unreachable(hold)
    return check(best.plan())  # raises the error of the best candidate


class Candidate:
    """A catch of the leaf with a lean of the body, whose motion is computed on request.

    Args:
        catch: Meeting of the hand with the leaf.
        hand: Spot of the hand on the leaf and the arm's postures.
        lean_share: Share of the lean that keeps the ZMP in place.
    """

    def __init__(
        self, hold: HoldTask, reach: ArmReach, catch: Catch, hand: HandOnLeaf, lean_share: float
    ) -> None:
        self._robot, self._reach, self._hold = hold.task.robot, reach, hold
        self._catch, self._hand = catch, hand
        self._time = time = sample_times(catch.duration, _NODES)
        self._angles = angles = catch.angle_at(time)
        # The CoM leans against the force at the end, so that the ZMP stays in place.
        lean = -lean_share * self._pressing(time[-1:])[0, :2] * hand.height / (
            self._robot.mass * GRAVITY)
        com = self._robot.com(self._robot.configuration(hold.base, hold.joints))[:2]
        self._com_xy = com + min_jerk(time, catch.at_rest)[:, None] * lean
        self._first = first = int(np.argmax(time >= catch.reach))
        self._targets = LeafFrame(hold.hinge, angles[first:]).point(
            hand.radius, hand.height, reach.hand_radius)
        # The first guess interpolates between the two chosen postures, so that the course is
        # smooth.
        opening = (catch.final - catch.lowest) or 1.0  # without a push both are the same
        part = ((angles - catch.lowest) / opening)[first:, None]
        self._guess = hand.nearest + part * (hand.final - hand.nearest)

    def is_hopeless(self) -> bool:
        """Whether `plan` or the check of the joints' speeds would certainly fail.

        Only the postures that decide the extension of the arm, and the last one, are computed, and
        in one pass only.
        """
        reach, hold = self._reach, self._hold
        rows = np.append(np.arange(_ENTRY), len(self._guess) - 1)
        guess, base = self._guess[rows], np.tile(hold.base, (len(rows), 1))
        whole = np.tile(hold.joints, (len(rows), 1))
        whole[:, reach.columns] = guess
        try:
            require_force(hold, self._catch, self._hand)
            _, bases = self._stand(whole, self._first + rows, base)
        except (AngleUnreachable, PostureUnreachable):
            return True
        arc = reach.follow(bases, hold.joints, guess, self._targets[rows])
        limit = hold.task.settings.limit_share * self._robot.speed_limit[reach.columns]
        too_fast = np.abs(self._extension_speed(arc)) > _CLEARLY * limit
        return bool(np.isnan(arc).any() or too_fast.any())

    def plan(self) -> HoldPlan:
        """Compute the whole-body motion of the phase, and the leaf's force on the hand.

        Raises:
            AngleUnreachable: The arm cannot follow the leaf, or the force is too large.
            PostureUnreachable: The legs do not reach.
        """
        robot, reach, hold = self._robot, self._reach, self._hold
        time, first, arc = self._time, self._first, self._guess
        force = require_force(hold, self._catch, self._hand)
        whole, bases = np.tile(hold.joints, (len(time), 1)), np.tile(hold.base, (len(time), 1))
        for _ in range(_PASSES):
            whole[:, reach.columns] = self._with_extension(arc)
            whole, bases = self._stand(whole, slice(None), bases)
            arc = reach.follow(bases[first:], hold.joints, arc, self._targets)
            _require_followed(arc, self._angles[first:], time[first:])
        whole[:, reach.columns] = self._with_extension(arc)
        dense = sample_times(self._catch.duration, hold.task.settings.period)
        motion = rest_to_rest(time, whole, bases, dense)
        point = robot.hand_chain.place(motion.joints, motion.base).end
        phase = StandingPhase("hold", motion, hold.feet)
        load = Load(point, self._pressing(dense))
        return HoldPlan(phase, load, self._catch, self._hand, force)

    def _pressing(self, when: Array) -> Array:
        """Compute the leaf's force on the hand at times (N,) [s], axes of odom, (N, 3) [N]."""
        hold, catch = self._hold, self._catch
        at = catch.angle_at(when)
        torque = np.where(when >= catch.reach, hold.door.restoring_torque(at), 0.0)
        return -(torque / self._hand.radius)[:, None] * LeafFrame(hold.hinge, at).normal

    def _stand(self, whole: Array, rows: Array | slice, near: Array) -> tuple[Array, Array]:
        """Find joints (M, J) [rad] and base (M, 3) [m] that put the CoM where it belongs.

        Args:
            whole: Joints whose upper body is kept, (M, J) [rad].
            rows: Which M of the phase's nodes these are.
            near: Positions of the base where the search begins, (M, 3) [m].
        """
        return solve(
            self._robot, upper=whole, com_xy=self._com_xy[rows],
            waist_z=float(self._hold.base[2]), feet=self._hold.feet, near=near)

    def _with_extension(self, arc: Array) -> Array:
        """Compute the arm's course (N, A) [rad]: its extension, then the arc (M, A) on the leaf."""
        time, first = self._time, self._first
        extension, _, _ = evaluate(self._extension(arc), time[:first] / time[first])
        return np.vstack([extension, arc])

    def _extension_speed(self, entry: Array) -> Array:
        """Compute speeds of the arm at some times of its extension, (T, A) [rad/s]."""
        _, speed, _ = evaluate(self._extension(entry), np.linspace(0.0, 1.0, _SPEEDS))
        return speed / self._time[self._first]

    def _extension(self, entry: Array) -> Array:
        """Compute coefficients (6, A) [rad] of the extension, by powers of the share of its time.

        It is a quintic in joint space that meets the arc with equal speed and acceleration.

        Args:
            entry: Joints of the arm on the leaf, at least at the first four times, (M, A) [rad].
        """
        step = float(self._time[1] - self._time[0])
        # One-sided differences of the arc: speed of third order, acceleration of second.
        a, b, c, d = entry[:_ENTRY]
        speed = (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / (6.0 * step)
        curve = (2.0 * a - 5.0 * b + 4.0 * c - d) / step**2
        start, end = self._hold.joints[self._reach.columns], self._time[self._first]
        still = np.zeros_like(start)
        return quintic(start, still, still, a, speed * end, curve * end**2)


def _require_followed(arc: Array, angles: Array, time: Array) -> None:
    """Check that the arm follows the leaf.

    Args:
        arc: Joints of the arm, (N, A) [rad]; NaN where the hand does not reach.
        angles: Angles of the leaf, (N,) [rad].
        time: Times from the start of the phase, (N,) [s].

    Raises:
        AngleUnreachable: A posture is missing. Value and limit are the first angle out of reach
            and the last one within reach [rad].
    """
    lost = np.flatnonzero(np.isnan(arc[:, 0]))
    if lost.size:
        i = int(lost[0])
        at, kept = float(angles[i]), float(angles[max(i - 1, 0)])
        raise AngleUnreachable(
            f"the arm loses the leaf at {math.degrees(at):.1f} deg, {time[i]:.2f} s after the "
            f"door's peak, and follows it only to {math.degrees(kept):.1f} deg; request a smaller "
            "angle or the ending retreat",
            quantity="leaf angle [rad]", value=at, limit=kept, phase="hold")
