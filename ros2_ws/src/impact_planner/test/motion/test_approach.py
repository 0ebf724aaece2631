"""The slow phases before the run-up."""

import pytest
from humanoid_motion.clearance import BodyGeometry, require_clearance
from impact_planner.motion.approach import plan_approach
from impact_planner.task.settings import ApproachTiming

LIMIT = 0.01


@pytest.fixture(scope="module")
def geometry(robot):
    """The collision shapes of HRP-2."""
    return BodyGeometry(robot)


def test_the_approach_keeps_clear_of_itself(robot, geometry, stance):
    """In every phase, bodies of the robot keep at least 10 mm from each other."""
    for phase in plan_approach(robot, stance, 0.04, ApproachTiming(), 0.005):
        require_clearance(geometry.self_clearance(phase.motion, LIMIT), phase.name)
