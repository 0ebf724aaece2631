"""After a hit the robot walks away, from the posture in which the hit has left it."""

import math

import numpy as np
import pytest
from door_impact_evaluation.run.driver_link import DriverLink
from door_impact_evaluation.run.rehearsal import world_of
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.task.known_door import KnownDoor
from motion_execution.mission.link import HitRequest
from motion_execution.mission.mission import HIT, WALK
from motion_execution.mission.order import Order
from motion_execution.walk.goal import WalkGoal
from robot_driver.motion import Outcome


@pytest.mark.nightly("a hit and a walk, half a minute each")
@pytest.mark.parametrize(("engine", "ending"), [("pybullet", "hold"), ("mujoco", "retreat")])
def test_the_robot_walks_away_after_a_hit(engine, ending):
    """0.4 m away from the door, with the arm where it is: within 20 mm, upright."""
    robot, door = RobotModel(load_robot_config()), load_door("paper")
    world = world_of(robot, door, 0.0, engine=engine)
    try:
        link = DriverLink(world, robot, KnownDoor.configured(door))
        plan = link.plan_hit(HitRequest(math.radians(20.0), ending, "", -1.0, -1.0)).result()
        hit = link.run(link.mission.hit(plan, Order(HIT)), 40.0)
        assert hit.outcome is Outcome.SUCCESS, hit.reason
        goal = link.mission.body.soles().middle.moved(0.0, 0.4)
        done = link.run(
            link.mission.walk(WalkGoal(goal, keep_heading=True), Order(WALK)), 40.0)
        assert done.outcome is Outcome.SUCCESS, done.reason
        assert not world.fell
        log = world.log()
    finally:
        world.close()
    end = np.mean([log[f"{side}_sole_position"][-1, :2] for side in SIDES], axis=0)
    assert end == pytest.approx(goal[:2], abs=0.02)
