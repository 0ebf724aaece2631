"""Where and when to put the swinging foot down after a push.

The robot is a linear inverted pendulum of the frequency w. With the ZMP p its capture point moves
as x(t) = p + (x(0) - p) exp(w t). Until touchdown p is in the standing sole, at the place that
brings x nearest to where it is wanted; afterwards it may be anywhere under both soles. The robot
can stop on both feet without another step if x is well inside their hull at touchdown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import RobotConfig, StepLimits, needed
from hrp2_description.support import sole_corners

from walking.footsteps.footstep import OUTWARD, Pose, other
from walking.footsteps.soles import sole_distances
from walking.recovery.settings import RecoverySettings

_DIRECTIONS = 48
_PLACES = (9, 8)
_TIME_STEP = 0.02


@dataclass(frozen=True)
class Landing:
    """Where and when the swinging foot lands.

    Attributes:
        pose: Pose of the sole in odom.
        time: Time to touchdown [s].
        zmp: Place of the ZMP until then in odom, (2,) [m].
        capture_point: Predicted place of the capture point at touchdown in odom, (2,) [m].
        margin: How far it is inside the hull of both soles then [m]; negative outside.
    """

    pose: Pose
    time: float
    zmp: Array
    capture_point: Array
    margin: float
    swing: str = ""
    double: float = 0.0
    cost: float = 0.0


def landings(
    robot: RobotConfig,
    swing: str,
    standing: Pose,
    foot: Array,
    foot_speed: Array,
    foot_acceleration: Array,
    planned: Pose,
    planned_time: float,
    capture_point: Array,
    frequency: float,
    settings: RecoverySettings,
    double: float = 0.0,
) -> list[Landing]:
    """Return landings, the best one first, one for each time of touchdown."""
    limits = needed(robot.footsteps, "footsteps")
    yaw = standing.yaw + max(-limits.turn, min(limits.turn, math.remainder(
        planned.yaw - standing.yaw, 2.0 * math.pi)))
    places = _places(robot, limits, swing, standing, planned, yaw)  # (P, 3)
    latest = max(planned_time, settings.shortest) + settings.longest
    earliest = min(settings.shortest, planned_time) if not double else double + settings.swing
    times = np.arange(earliest, latest, _TIME_STEP)
    rect = robot.soles[other(swing)]
    local = Pose(*capture_point, 0.0).seen_from(standing)
    x = np.array([local.x, local.y])
    out = OUTWARD[swing]
    rel = np.array([Pose(*row).seen_from(standing) for row in places])  # (P, 3) in standing axes
    corners = np.array([sole_corners(robot.soles[swing], row) for row in rel])  # (P, 4, 2)
    own = sole_corners(rect, np.zeros(3))
    angles = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    normals = np.stack([np.cos(angles), np.sin(angles)])  # (2, D)
    support = np.maximum((corners @ normals).max(axis=1), (own @ normals).max(axis=0))  # (P, D)
    low = np.array([rect[0], rect[2]]) + settings.inset
    high = np.array([rect[1], rect[3]]) - settings.inset
    middle = 0.5 * (rel[:, :2] + 0.5 * (low + high)) + np.array([0.01, 0.0])
    here = np.array(Pose(foot[0], foot[1], 0.0).seen_from(standing)[:2])
    axes = np.array([[math.cos(standing.yaw), math.sin(standing.yaw)],
                     [-math.sin(standing.yaw), math.cos(standing.yaw)]])
    speed, bend = axes @ foot_speed, axes @ foot_acceleration
    aim = np.array(planned.seen_from(standing)[:2])
    found = []
    for time in times:
        grow = math.exp(frequency * time)
        zmp = np.clip((middle - x * grow) / (1.0 - grow), low, high)  # (P, 2)
        end = zmp + (x - zmp) * grow
        margin = (support - end @ normals).min(axis=1)
        quick = _fastest(rel[:, :2] - here, speed, bend, max(time - double - 0.04, 0.04))
        lack = np.maximum(0.0, settings.reserve - margin)
        cost = (lack * 10.0 + 0.3 * np.linalg.norm(rel[:, :2] - aim, axis=1)
                + 0.1 * abs(time - planned_time) + settings.late * max(0.0, time - planned_time) + 100.0 * np.maximum(0.0, quick - settings.fastest_foot))
        best = int(np.argmin(cost))
        place = standing.moved(end[best][0], end[best][1])
        z = standing.moved(zmp[best][0], zmp[best][1])
        found.append((float(cost[best]), Landing(
            Pose(*places[best]), float(time), np.array(z[:2]), np.array(place[:2]),
            float(margin[best]), swing, double, float(cost[best]))))
    found.sort(key=lambda pair: pair[0])
    return [landing for _, landing in found]


def _places(
    robot: RobotConfig, limits: StepLimits, swing: str, standing: Pose, planned: Pose, yaw: float
) -> Array:
    out = OUTWARD[swing]
    aim = planned.seen_from(standing)
    xs = np.append(np.linspace(-limits.back, limits.ahead, _PLACES[0]), aim.x)
    ys = np.append(np.linspace(limits.narrowest, limits.widest, _PLACES[1]), out * aim.y)
    x, y = (rows.ravel() for rows in np.meshgrid(
        np.clip(xs, -limits.back, limits.ahead), np.clip(ys, limits.narrowest, limits.widest)))
    poses = np.array([standing.moved(a, out * b, yaw - standing.yaw)
                      for a, b in zip(x, y, strict=True)])
    still = np.tile(np.array(standing), (len(poses), 1))
    clear = sole_distances(robot, swing, poses, still) >= limits.clearance - 1e-9
    return poses[clear]


def _fastest(way: Array, speed: Array, acceleration: Array, duration: float) -> Array:
    """Largest speed of quintics over ways (P, 2) to rest, from a speed and acceleration (2,)."""
    x = np.linspace(0.1, 0.9, 9)[:, None, None]
    rate = (way * (30.0 * x**2 * (1.0 - x) ** 2) / duration
            + speed * (1.0 - 18.0 * x**2 + 32.0 * x**3 - 15.0 * x**4)
            + acceleration * duration * (x - 4.5 * x**2 + 6.0 * x**3 - 2.5 * x**4))
    return np.asarray(np.linalg.norm(rate, axis=2).max(axis=0))
