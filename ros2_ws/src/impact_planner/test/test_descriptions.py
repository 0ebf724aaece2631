"""What the descriptions of robot and door say is judged where the hit is planned."""

from dataclasses import replace

import numpy as np
import pytest
from door_model.door.config import load_door
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest

REQUEST = PlanRequest(np.radians(25.0))


def lower_door(height):
    """Return the paper's door with a leaf of another height [m], and no lintel just above it."""
    paper = load_door("paper")
    return KnownDoor.configured(
        replace(paper, leaf=replace(paper.leaf, height=height), frame=None))


def test_a_leaf_that_ends_below_the_elbow_is_refused_with_both_heights(robot, plan):
    """The elbow's ball must meet the face; a leaf that is just high enough is hit alike."""
    elbow = float(plan.hit.stance.posture.elbow[2])
    with pytest.raises(PostureUnreachable, match=rf"0\.610 m .*hits it at {elbow:.3f} m") as caught:
        plan_impact(REQUEST, lower_door(0.6), robot)
    assert caught.value.value == pytest.approx(0.61)
    assert caught.value.limit == pytest.approx(elbow + robot.config.contact_radius)
    low = plan_impact(REQUEST, lower_door(float(caught.value.limit)), robot)
    assert low.v_rb == plan.v_rb
    hand, sole = robot.poses_in_base(
        low.phases[-1].knots.position[-1], [robot.config.hand_link, robot.feet["left"].frame])
    assert hand[2, 3] - sole[2, 3] <= low.known.top - robot.hand_radius + 1e-3


@pytest.mark.parametrize("factor", [5.0, 1e9])
def test_faster_joints_make_no_plan_impossible(robot, known, plan, factor):
    """The arm's catch is found as well where no joint's speed limits it."""
    limits = factor * robot.config.velocity_limit
    fast = plan_impact(REQUEST, known, RobotModel(replace(robot.config, velocity_limit=limits)))
    assert fast.v_rb == pytest.approx(plan.v_rb, rel=0.01)
    assert [phase.name for phase in fast.phases] == [phase.name for phase in plan.phases]
