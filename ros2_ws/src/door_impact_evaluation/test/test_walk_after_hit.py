"""After a hit the robot walks away, from the posture in which the hit has left it."""

import math

import numpy as np
import pytest
from door_impact_evaluation.run import rehearsal, walk_run
from door_model.door.config import load_door
from hrp2_description.robot import SIDES, load_robot_config
from hrp2_sim_bridge.world import World
from humanoid_motion.robot_model import RobotModel
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from impact_planner.task.settings import configured_placement, make_settings
from motion_execution.hit.point_b import PointB
from motion_execution.walk.goal import WalkGoal, plan_goal
from motion_execution.walk.start import Standing, require_near, start_state
from robot_driver.motion import Outcome
from walking.pattern.settings import WalkSettings


@pytest.mark.nightly("a hit and a walk, half a minute each")
@pytest.mark.parametrize(("engine", "ending"), [("pybullet", "hold"), ("mujoco", "retreat")])
def test_the_robot_walks_away_after_a_hit(engine, ending):
    """0.4 m away from the door, with the arm where it is: within 20 mm, upright."""
    robot = RobotModel(load_robot_config())
    placement = configured_placement()
    plan = plan_impact(
        PlanRequest(math.radians(20.0), ending=ending),
        KnownDoor.configured(load_door("paper")), robot, make_settings(placement))
    world = World(robot.config, load_door("paper"), placement["door_distance"],
                  placement["hinge_x"], engine=engine)
    try:
        hit = rehearsal.execute(world, plan, PointB(robot), lambda *_: None, None)
        assert hit.outcome is Outcome.SUCCESS, hit.reason
        sample = world.step()
        settings = WalkSettings()
        base = walk_run.base_of(world)
        state = start_state(
            robot, Standing(base, 0.0, sample.position, sample.velocity), settings)
        middle = state.stance.middle
        goal = middle.moved(0.0, 0.4)
        walk = plan_goal(robot, state, WalkGoal(goal, keep_heading=True), settings)
        require_near(robot, walk.knots.position[0], sample.position)
        done, _ = walk_run.execute(world, robot, walk)
        assert done.outcome is Outcome.SUCCESS, done.reason
        assert not world.fell
        log = world.log()
    finally:
        world.close()
    end = np.mean([log[f"{side}_sole_position"][-1, :2] for side in SIDES], axis=0)
    assert end == pytest.approx(goal[:2], abs=0.02)
