"""A missed contact: how far the robot is then from a fall, and where its CoM must be to stand.

The run-up keeps its speed for `PlannerSettings.overrun` past the nominal contact and then brakes by
itself, without a command. The reserve is stated for that instant.
"""

from __future__ import annotations

import math

from door_impact_common.constants import GRAVITY
from hrp2_description.robot import RobotConfig
from humanoid_motion.robot_model import RobotModel

from impact_planner.hit.posture import HitPosture
from impact_planner.hit.stance import HitStance
from impact_planner.motion.run_up import RunUpPlan
from impact_planner.task.settings import RESERVE


def needed_reserve(robot: RobotConfig) -> float:
    """Return the `missed_margin` below which a robot that misses the door may fall [m]."""
    return RESERVE * robot.sole_scale


def way_to_stop(speed: float, height: float) -> float:
    """Compute how far the capture point is ahead of the CoM [m].

    The capture point of the linear inverted pendulum (Pratt et al., 2006) is ydot / sqrt(g / h)
    ahead of the CoM. While it is inside the support polygon, the robot can come to rest without a
    step.

    Args:
        speed: Speed of the CoM [m/s].
        height: Height of the CoM above the floor [m].
    """
    return speed * math.sqrt(height / GRAVITY)


def missed_margin(stance: HitStance, run_up: RunUpPlan) -> float:
    """Compute how far the capture point is inside the soles when a missed contact is noticed [m].

    That is the end of the overrun, where the run-up still has its full speed and begins to brake:
    5 mm, or 10 to 15 ms, past the farthest place where a door is expected.
    """
    table, law = run_up.table, run_up.law
    ahead = way_to_stop(law.speed, stance.posture.b_r)
    return table.y_hit - run_up.overrun - ahead - table.edges[0]


def inside_edge_for(
    robot: RobotModel, posture: HitPosture, speed: float, overrun: float, reserve: float
) -> float:
    """Compute how far inside the right sole's inner edge the CoM gives a `missed_margin` [m].

    The soles end at the right sole's outer edge. A negative distance means that the CoM is still
    between the soles when the elbow meets the leaf.

    Args:
        speed: Speed of the CoM at the hit [m/s].
        overrun: Distance of the run-up past the nominal contact [m].
        reserve: Desired `missed_margin` [m].
    """
    outer, inner = robot.feet["right"].rectangle[2:]
    return inner - outer - overrun - way_to_stop(speed, posture.b_r) - reserve
