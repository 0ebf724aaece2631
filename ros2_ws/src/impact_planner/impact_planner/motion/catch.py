"""Where and when the hand catches the closing leaf, for the ending `hold` of section II.C.1.

The arm extends from the door's peak on, while the leaf closes. Eq. (1) gives the place where they
meet. The hand arrives with most of the leaf's speed, yields until the leaf is at rest, and pushes
the leaf to the desired angle; with the ending `pass` it stays where it came to rest, because the
passage will push it farther. `impact_planner.motion.hold` makes the motion of a catch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.door import Door
from door_model.motion.dynamics import follow_free
from door_model.motion.free_motion import FreeMotion
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.motion import min_jerk

from impact_planner.errors import AngleUnreachable
from impact_planner.motion.arm_reach import ArmReach, HandOnLeaf
from impact_planner.motion.post import way_to_rest
from impact_planner.task.request import Task

_REACH_TIMES = (0.6, 0.5, 0.7, 0.8, 1.0)  # times to extend the arm, tried in this order [s]
_NEARER = 0.06  # step towards the hinge where the furthest spot cannot be used [m]
_NEARER_TRIES = 4  # number of spots that are tried
LATE = 0.12  # delay between the door's peak and its detection, while the leaf closes [s]
_YIELD = 0.35  # time from the hand's arrival until the leaf is at rest [s]
_SPEED_SHARE = 0.8  # speed of the hand at its arrival as a share of the leaf's
_PUSH = 1.5  # shortest time of the push to the desired angle [s]
# Deceleration at the end of the push as a share of the closer's: a leaf that the hand slows down
# less than the closer does stays on the hand, also while the robot sways.
_PUSH_BRAKING = 0.4
# Time at rest in the end: at the desired angle, and where the hand has caught the leaf [s].
_REST, _REST_CAUGHT = 0.3, 0.1
_NEARLY_SHUT = math.radians(1.0)  # smallest angle that leaves room for the hand [rad]
_PEAK_SPEED = 1.875  # largest speed of a minimum-jerk motion divided by its mean speed
_PEAK_BRAKING = 5.774  # its largest deceleration, times duration squared over distance
_FURTHER = 30.0  # range above a refused angle that is searched for one that can be held [deg]


@dataclass(frozen=True)
class HoldTask:
    """The door to hold, and the posture to start from.

    Attributes:
        task: The robot, the door and the settings.
        hinge: x and y of the hinge in odom, (2,) [m].
        feet: Places of the soles in odom by side, (3,) each [m].
        angle: Opening angle to hold [rad].
        joints: Joints at the end of the previous phase, (J,) [rad].
        base: Position of base_link at the end of the previous phase in odom, (3,) [m].
    """

    task: Task
    hinge: Array
    feet: dict[str, Array]
    angle: float
    joints: Array
    base: Array

    @property
    def door(self) -> Door:
        """Dynamics of the door."""
        return self.task.known.door


@dataclass(frozen=True)
class Catch:
    """Meeting of the hand with the closing leaf.

    Attributes:
        reach: Time in which the arm extends [s].
        angle: Opening angle of the leaf when the hand arrives [rad].
        speed: Angular speed of the hand about the hinge at its arrival, negative [rad/s].
        lowest: Opening angle at which leaf and hand come to rest [rad].
        final: Opening angle at the end [rad].
        push: Time of the push to it [s]; 0: there is none.
    """

    reach: float
    angle: float
    speed: float
    lowest: float
    final: float
    push: float

    @property
    def at_rest(self) -> float:
        """Time at which leaf and hand come to rest, from the start of the phase [s]."""
        return self.reach + _YIELD

    @property
    def duration(self) -> float:
        """Duration of the phase [s]."""
        return self.at_rest + (self.push + _REST if self.push else _REST_CAUGHT)

    def angle_at(self, time: Array) -> Array:
        """Compute the leaf angle that the hand follows from its arrival, (N,) [rad].

        Args:
            time: Times from the start of the phase, (N,) [s].
        """
        caught = self.angle + self.speed * way_to_rest(time - self.reach, _YIELD)
        if not self.push:
            return caught
        return caught + (self.final - self.lowest) * min_jerk(time - self.at_rest, self.push)


def can_hold(hold: HoldTask) -> bool:
    """Whether the arm reaches the leaf in time and bears the closer's force.

    Only the reach is computed, no motion.
    """
    if float(hold.door.restoring_torque(hold.angle)) <= 0.0:
        return False  # the door would not close onto the hand
    for catch, hand in choices(hold, ArmReach(hold.task.robot, hold.task.known.top), 1):
        with suppress(AngleUnreachable):
            require_force(hold, catch, hand)
            return True
    return False


def choices(
    hold: HoldTask, reach: ArmReach, tries: int = _NEARER_TRIES
) -> Iterator[tuple[Catch, HandOnLeaf]]:
    """Find candidates for meeting the leaf: first the spots furthest from the hinge, then nearer.

    Where the leaf stays where it was caught, the hand is to be there early, before it has fallen
    far: longer times to extend the arm are tried later.

    Args:
        tries: Number of spots to try for each time to extend the arm.
    """
    speed = hold.task.settings.limit_share * hold.task.robot.speed_limit[reach.columns]
    fall = follow_free(hold.door, hold.angle, 0.0, until=max(_REACH_TIMES) + LATE + 1e-6)
    found = [_catch(hold, fall, duration) for duration in _REACH_TIMES]
    tried = [catch for catch in found if catch is not None]
    together = [tried] if hold.task.wanted.ending != "pass" else [
        [catch] for catch in sorted(tried, key=lambda catch: catch.reach)]
    for catches in together:
        furthest = dict.fromkeys(catches, reach.furthest(hold.task.known.width))
        for _ in range(tries):
            for catch, radius in list(furthest.items()):
                # The hand yields: the elbow is nearest to the leaf where the leaf comes to rest.
                leaf = (LeafFrame(hold.hinge, catch.lowest), LeafFrame(hold.hinge, catch.final))
                hand = reach.choose(
                    hold.base, hold.joints, leaf, radius, speed * catch.reach / _PEAK_SPEED)
                if hand is None:
                    del furthest[catch]
                    continue
                yield catch, hand
                furthest[catch] = hand.radius - _NEARER  # a less stretched arm


def require_force(hold: HoldTask, catch: Catch, hand: HandOnLeaf) -> float:
    """Compute the largest force of the leaf on the hand after its arrival [N].

    Raises:
        AngleUnreachable: The force exceeds `hand_force_limit`.
    """
    angles, limit = np.linspace(catch.lowest, catch.final, 20), hold.task.settings.hand_force_limit
    force = float(np.max(hold.door.restoring_torque(angles))) / hand.radius
    if force > limit:
        raise AngleUnreachable(
            f"the closer would press with {force:.1f} N on the hand {hand.radius:.2f} m from the "
            f"hinge, {limit:.1f} N are allowed; request a larger angle or the ending retreat",
            quantity="hand force [N]", value=force, limit=limit, phase="hold")
    return force


def unreachable(hold: HoldTask) -> AngleUnreachable:
    """Make the error of an angle that cannot be held; it names the nearest angles that can."""
    tries = np.radians(np.arange(2.0, math.degrees(hold.angle) + _FURTHER, 2.0))
    tries = tries[tries < hold.door.closer.opening_limit() - 0.02]
    sides = (tries[tries < hold.angle][::-1], tries[tries > hold.angle])
    nearest = [
        next((float(angle) for angle in side if can_hold(replace(hold, angle=angle))), None)
        for side in sides
    ]
    known = [angle for angle in nearest if angle is not None]
    named = " and ".join(
        f"{where} about {math.degrees(angle):.0f} deg"
        for where, angle in zip(("up to", "from"), nearest, strict=True) if angle is not None)
    return AngleUnreachable(
        f"the hand cannot catch the door and hold it at {math.degrees(hold.angle):.1f} deg"
        + (f"; it can {named}, so request such an angle" if named
           else ", and at no angle near it; request a quite different angle")
        + " or the ending retreat",
        quantity="desired_opening_angle [rad]",
        value=hold.angle,
        limit=min(known, key=lambda angle: abs(angle - hold.angle), default=0.0),
        phase="hold",
    )


def _catch(hold: HoldTask, fall: FreeMotion, reach: float) -> Catch | None:
    """Compute the meeting with the leaf after a time of reach [s]; None if it is shut then."""
    if fall.end_time[0] < reach + LATE:
        return None
    theta, omega = fall.at(np.array([reach + LATE]))
    angle, speed = float(theta[0, 0]), _SPEED_SHARE * float(omega[0, 0])
    lowest = angle + 0.5 * speed * _YIELD
    if lowest < _NEARLY_SHUT:
        return None
    if hold.task.wanted.ending == "pass":
        return Catch(reach, angle, speed, lowest, lowest, 0.0)
    return Catch(reach, angle, speed, lowest, hold.angle, _push_time(hold, lowest))


def _push_time(hold: HoldTask, lowest: float) -> float:
    """Compute the time of a push in which the closer keeps the leaf on the hand [s].

    Args:
        lowest: Opening angle at which the push begins [rad].
    """
    angles = np.linspace(lowest, hold.angle, 20)
    torque = float(np.min(hold.door.restoring_torque(angles)))
    if torque <= 0.0:
        return _PUSH  # no closer decelerates the leaf, however slow the push is
    braking = _PUSH_BRAKING * torque / hold.door.i_a
    return max(_PUSH, math.sqrt(_PEAK_BRAKING * max(hold.angle - lowest, 0.0) / braking))
