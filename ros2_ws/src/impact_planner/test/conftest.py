"""The robot, the paper's door and its plan, made once for all tests."""

import numpy as np
import pytest
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from impact_planner.execution.types import ExecutablePlan
from impact_planner.hit.stance import stance_for_step
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest


@pytest.fixture(scope="session")
def robot():
    """The model of HRP-2."""
    return RobotModel(load_robot_config())


@pytest.fixture(scope="session")
def stance(robot):
    """The stance after the nominal step."""
    return stance_for_step(robot, robot.config.step.nominal, 0.01)


@pytest.fixture(scope="session")
def known():
    """The paper's door with exactly known parameters."""
    return KnownDoor.configured(load_door("paper"))


@pytest.fixture(scope="session")
def plan(robot, known):
    """The plan that opens the paper's door to 25 deg at its nominal place."""
    return plan_impact(PlanRequest(np.radians(25.0)), known, robot)


@pytest.fixture(scope="session")
def good(plan):
    """This plan, ready for an execution."""
    return ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases})
