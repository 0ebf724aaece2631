"""A missed contact: how far the robot is then from a fall, and where its CoM must be to stand.

The run-up keeps its speed for `PlannerSettings.overrun` past the nominal contact and then brakes by
itself, without a command. The reserve is stated for that instant.
"""

from __future__ import annotations

import math

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.posture import HitPosture
from impact_planner.hit.stance import HitStance, sole_edges
from impact_planner.motion.run_up import RunUpPlan

STANDS = 0.03
"""Reserve with which the robot stood after each simulated miss; with less it may fall [m]."""


def way_to_stop(speed: float | Array, height: float) -> Array:
    """Distance of the capture point ahead of the CoM [m], any shape.

    The capture point of the linear inverted pendulum (Pratt et al., 2006) is ydot / sqrt(g / h)
    ahead of the CoM. While it is inside the support polygon, the robot can come to rest without a
    step.

    Args:
        speed: Speed of the CoM [m/s].
        height: Height of the CoM above the floor [m].
    """
    return np.asarray(speed) * math.sqrt(height / GRAVITY)


def capture_reserve(
    robot: RobotModel, stance: HitStance, run_up: RunUpPlan, distance: Array, speed: Array
) -> Array:
    """Distance of the capture point inside the soles' edge towards the door, (N,) [m].

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        run_up: The run-up.
        distance: Distance of the CoM from the start of the run-up, (N,) [m].
        speed: Speed of the CoM towards the door, (N,) [m/s].
    """
    ahead = way_to_stop(speed, stance.posture.b_r)
    return np.asarray(
        run_up.y_start - distance - ahead - sole_edges(robot, stance.feet)[0])


def missed_margin(robot: RobotModel, stance: HitStance, run_up: RunUpPlan) -> float:
    """Capture reserve at the instant at which a missed contact is noticed [m].

    That is the end of the overrun, where the run-up still has its full speed and begins to brake:
    5 mm, or 10 to 15 ms, past the farthest place where a door is expected.

    Args:
        robot: The robot.
        stance: Feet and posture at the hit.
        run_up: The run-up.
    """
    law = run_up.law
    return float(capture_reserve(
        robot, stance, run_up, np.array([law.distance + run_up.overrun]), np.array([law.speed]))[0])


def inside_edge_for(
    robot: RobotModel, posture: HitPosture, speed: float, overrun: float, reserve: float
) -> float:
    """Distance of the CoM inside the right sole's inner edge that gives a `missed_margin` [m].

    The soles end at the right sole's outer edge. A negative distance means that the CoM is still
    between the soles when the elbow meets the leaf.

    Args:
        robot: The robot.
        posture: Posture at the hit.
        speed: Speed of the CoM at the hit [m/s].
        overrun: Distance of the run-up past the nominal contact [m].
        reserve: Desired `missed_margin` [m].
    """
    outer, inner = robot.feet["right"].rectangle[2:]
    return float(inner - outer - overrun - way_to_stop(speed, posture.b_r) - reserve)
