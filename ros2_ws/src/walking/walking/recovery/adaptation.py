"""Where and when to put a foot down after a push.

The robot is a linear inverted pendulum of the frequency w. Under a constant ZMP p its capture point
moves as x(t) = p + (x(0) - p) exp(w t). Until touchdown p is in the standing sole, at the place
that brings x nearest to where it is wanted; afterwards it may be anywhere under both soles. The
robot can stop on both feet if x is well inside their hull at touchdown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig, StepLimits, needed
from hrp2_description.support import sole_corners

from walking.footsteps.checks import sole_distances
from walking.footsteps.footstep import OUTWARD, Pose, other

UPRIGHT = 0.04
"""Time before touchdown in which a foot moves down only [s]."""
SHORTEST_SWING = 0.24
"""Shortest single support of a step from both feet [s]."""
_SHORTEST = 0.16  # shortest time to a touchdown that is brought forward [s]
_LONGEST = 0.4  # longest time by which a touchdown is delayed [s]
_FASTEST_FOOT = 1.2  # largest speed of the swing foot over the floor [m/s]
_INSET = 0.01  # distance of a plan's ZMP from the edge of a sole, as of HRP-2's sole [m]
_FARTHER = 0.5  # farther way of a recovery step ahead and back, by the largest planned step ahead
# Least distance of a recovery step to the side: nearly that of the hips, so that the legs do not
# meet. Beside the other foot the clearance between the soles decides; as of HRP-2's sole [m].
_NARROWEST = 0.1
# Wanted distance of the capture point from the soles' edge at touchdown, and the error of the
# capture point now, which grows like the pendulum's until then; as of HRP-2's sole [m].
_RESERVE, _UNSURE = 0.07, 0.004
_DIRECTIONS = 64  # of the hull's edges
_PLACES = (12, 10)  # places of the foot that are compared, ahead and to the side
_SLOWER = (1.0, 0.8, 0.65)  # shares of the foot's largest speed, each of which has its best landing
_TIME_STEP = 0.02  # between times of touchdown that are compared [s]
# Costs: of a metre that the reserve lacks, of a metre away from the planned place, of a second away
# from the planned time and of one after it, of each m/s that the foot is too fast.
_LACK, _AWAY, _TIME, _LATE, _FAST = 10.0, 0.3, 0.1, 0.3, 100.0


@dataclass(frozen=True)
class Swing:
    """The foot that is in the air, or will be.

    Attributes:
        side: Its side.
        standing: Pose of the other sole in odom.
        place: x and y of its sole in odom now, (2,) [m].
        speed: Their speeds, (2,) [m/s].
        acceleration: Their accelerations, (2,) [m/s^2].
        planned: Pose of its sole after the step as planned so far.
        left: Time to the planned touchdown [s].
        double: Time until it leaves the floor; 0 if it has [s].
    """

    side: str
    standing: Pose
    place: Array
    speed: Array
    acceleration: Array
    planned: Pose
    left: float
    double: float = 0.0


@dataclass(frozen=True)
class Landing:
    """Where and when a foot lands.

    Attributes:
        side: Side of the foot.
        pose: Pose of its sole in odom.
        time: Time to touchdown [s].
        double: Time until the foot leaves the floor; 0 if it has [s].
        zmp: Place of the ZMP until touchdown in odom, (2,) [m].
        capture_point: Predicted place of the capture point at touchdown in odom, (2,) [m].
        margin: How far it is inside the hull of both soles then [m]; negative outside, where
            the robot cannot stop without another step.
        speed: Largest speed of the foot over the floor on the way there [m/s].
        cost: By which landings are compared.
    """

    side: str
    pose: Pose
    time: float
    double: float
    zmp: Array
    capture_point: Array
    margin: float
    speed: float
    cost: float


def step_limits(robot: RobotConfig) -> StepLimits:
    """Return the limits of a recovery step: longer than planned and, ahead or back, narrower."""
    limits = needed(robot.footsteps, "footsteps")
    farther = _FARTHER * limits.ahead
    return replace(limits, ahead=limits.ahead + farther, back=limits.back + farther,
                   narrowest=min(limits.narrowest, _NARROWEST * robot.sole_scale))


def landings(
    robot: RobotConfig, swing: Swing, capture_point: Array, frequency: float
) -> list[Landing]:
    """Return the best landings for several times of touchdown and speeds, the best one first.

    All of them keep the limits of recovery steps; the last resort is the one that lacks least.

    Args:
        swing: The foot.
        capture_point: Capture point in odom, (2,) [m].
        frequency: Frequency of the pendulum [rad/s].
    """
    standing = swing.standing
    # All vectors are in the axes of the standing sole from here on.
    places = _places(robot, swing)
    origin, aim = np.array(standing[:2]), np.array(swing.planned.seen_from(standing)[:2])
    cos, sin = math.cos(standing.yaw), math.sin(standing.yaw)
    axes = np.array([[cos, sin], [-sin, cos]])
    point, here = axes @ (capture_point - origin), axes @ (swing.place - origin)
    speed, acceleration = axes @ swing.speed, axes @ swing.acceleration
    rect, scale = robot.soles[other(swing.side)], robot.sole_scale
    low = np.array([rect[0], rect[2]]) + _INSET * scale
    high = np.array([rect[1], rect[3]]) - _INSET * scale
    sole = sole_corners(robot.soles[swing.side], np.zeros(3))
    wanted = 0.5 * (places[:, :2] + sole.mean(axis=0) + 0.5 * (low + high))
    normals, support = _hulls(robot, swing.side, places)
    away = _AWAY * np.linalg.norm(places[:, :2] - aim, axis=1)
    found = []
    for time in _times(swing):
        grow = math.exp(frequency * time)
        zmp = np.clip((wanted - point * grow) / (1.0 - grow), low, high)
        end = zmp + (point - zmp) * grow
        margin = (support - end @ normals).min(axis=1)
        travel = max(time - swing.double - UPRIGHT, UPRIGHT)
        fast = _fastest(places[:, :2] - here, speed, acceleration, travel)
        slow = (_LACK * np.maximum(0.0, scale * (_RESERVE + _UNSURE * grow) - margin) + away
                + _TIME * abs(time - swing.left) + _LATE * max(0.0, time - swing.left))
        for share in _SLOWER:
            cost = slow + _FAST * np.maximum(0.0, fast - share * _FASTEST_FOOT)
            best = int(np.argmin(cost))
            x, y, yaw = places[best].tolist()
            found.append(Landing(
                swing.side, standing.moved(x, y, yaw), float(time), swing.double,
                origin + zmp[best] @ axes, origin + end[best] @ axes, float(margin[best]),
                float(fast[best]), float(cost[best])))
    return sorted(found, key=lambda landing: landing.cost)


def _times(swing: Swing) -> Array:
    """Times of touchdown that are compared, (N,) [s]."""
    earliest = swing.double + SHORTEST_SWING if swing.double else min(_SHORTEST, swing.left)
    latest = max(swing.left, _SHORTEST) + _LONGEST
    return np.arange(earliest, latest, _TIME_STEP)


def _places(robot: RobotConfig, swing: Swing) -> Array:
    """Places of the sole that keep the limits, x, y [m] and yaw [rad], (P, 3)."""
    limits = step_limits(robot)
    out, aim = OUTWARD[swing.side], swing.planned.seen_from(swing.standing)
    ahead = np.append(np.linspace(-limits.back, limits.ahead, _PLACES[0]), aim.x)
    aside = np.append(np.linspace(limits.narrowest, limits.widest, _PLACES[1]), out * aim.y)
    x, y = (rows.ravel() for rows in np.meshgrid(
        ahead.clip(-limits.back, limits.ahead), aside.clip(limits.narrowest, limits.widest)))
    yaw = max(-limits.turn, min(limits.turn, aim.yaw))
    places = np.column_stack([x, out * y, np.full(len(x), yaw)])
    clear = sole_distances(robot, swing.side, places, np.zeros_like(places))
    return places[clear >= limits.clearance - 1e-9]


def _hulls(robot: RobotConfig, side: str, places: Array) -> tuple[Array, Array]:
    """Directions (2, D), and how far the hull of both soles reaches along them, (P, D) [m]."""
    angle = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    normals = np.stack([np.cos(angle), np.sin(angle)])
    yaw = float(places[0, 2])
    sole = (sole_corners(robot.soles[side], np.array([0.0, 0.0, yaw])) @ normals).max(axis=0)
    own = (sole_corners(robot.soles[other(side)], np.zeros(3)) @ normals).max(axis=0)
    return normals, np.maximum(places[:, :2] @ normals + sole, own)


def _fastest(way: Array, speed: Array, acceleration: Array, duration: float) -> Array:
    """Largest speeds of quintics over ways (P, 2) to rest from a speed and acceleration, (P,)."""
    x = np.linspace(0.1, 0.9, 9)
    u = 1.0 - x
    along = 30.0 * (x * u) ** 2 / duration
    fixed = np.outer(1.0 - 18.0 * x**2 + 32.0 * x**3 - 15.0 * x**4, speed)
    fixed += np.outer(x - 4.5 * x**2 + 6.0 * x**3 - 2.5 * x**4, acceleration * duration)
    rate = along[:, None, None] * way + fixed[:, None]
    return np.asarray(np.sqrt((rate**2).sum(axis=2)).max(axis=0))
