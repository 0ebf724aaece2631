"""Compute "passage" of `summary.json`, by the definitions of `run/passage_measures.py`."""

import math
from typing import Any

import numpy as np
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel

from door_impact_evaluation.run import passage_measures
from door_impact_evaluation.run.body_distances import body_distances
from door_impact_evaluation.run.record import DemoRecord
from door_impact_evaluation.run.simulation_log import SimulationLog


def figures(outcome: Any, door: str, log: SimulationLog, record: DemoRecord) -> dict[str, Any]:
    """Compute the figures; None for those that are not known.

    Args:
        outcome: Result of the action WalkThroughDoor.
        door: Name or YAML file of the simulated door.
        log: The simulation's log.
        record: What was measured of the motion.
    """
    robot, walk = RobotModel(load_robot_config()), None
    plan, begin, t = outcome.plan, outcome.start_time, log.motion.t
    if math.isfinite(begin):
        walk = passage_measures.WalkedThrough(
            begin, begin + plan.release_time, outcome.steps,
            np.interp(t - begin, plan.times, plan.leaf_angle),
            body_distances(robot, log.motion, load_door(door),
                           (log.hinge_x, -log.door_distance), begin))
    first = min(begin for begin, _ in record.phases.values())
    found = passage_measures.summary(passage_measures.PassageRecord(
        log, record.support.margin, first, record.contact_time, record.peak_time, walk), robot)
    return {name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in found.items()}
