"""Preflight: a good plan passes; a plan that jumps or breaks a limit is refused by the joint."""

from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.knots import Knots
from impact_planner.errors import GoalRefused
from impact_planner.execution.execution import Execution
from impact_planner.execution.point_b import PointB
from impact_planner.execution.preflight import require_door, require_limits, require_start
from impact_planner.execution.types import ExecutablePlan


@pytest.fixture
def good(plan) -> ExecutablePlan:
    """The nominal plan, ready for an execution."""
    return ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases})


def check(robot, plan: ExecutablePlan) -> None:
    sent = Execution(plan, PointB(robot)).start(0.0).knots
    require_limits(robot, plan, sent)


def changed(plan: ExecutablePlan, phase: str, **fields: np.ndarray) -> ExecutablePlan:
    """The plan with other knots in one phase."""
    return replace(plan, phases={**plan.phases, phase: replace(plan.phases[phase], **fields)})


def test_a_plan_of_the_planner_passes(robot, good: ExecutablePlan) -> None:
    check(robot, good)


def test_a_joint_outside_its_range_is_named(robot, good: ExecutablePlan) -> None:
    position = good.phases["shift"].position.copy()
    position[1, 3] = 9.0
    with pytest.raises(GoalRefused, match="RLEG_JOINT3") as error:
        check(robot, changed(good, "shift", position=position))
    assert error.value.reason == "no_plan"


def test_a_joint_that_is_too_fast_is_named(robot, good: ExecutablePlan) -> None:
    knots = good.phases["hold"]
    fast = Knots(knots.time / 20.0, knots.position, knots.velocity * 20.0, knots.acceleration)
    with pytest.raises(GoalRefused, match="rad/s, its limit is"):
        check(robot, replace(good, phases={**good.phases, "hold": fast}))


def test_phases_that_do_not_join_are_refused(robot, good: ExecutablePlan) -> None:
    position = good.phases["hold"].position.copy()
    position[:, 14] += 0.02
    with pytest.raises(GoalRefused, match="HEAD_JOINT0"):
        check(robot, changed(good, "hold", position=position))


def test_a_robot_or_a_door_elsewhere_is_refused(robot, good: ExecutablePlan) -> None:
    start = good.phases["prepare"].position[0]
    require_start(robot.joint_names, start + 0.04, start)
    off = start.copy()
    off[3] += 0.06
    with pytest.raises(GoalRefused, match="RLEG_JOINT3"):
        require_start(robot.joint_names, off, start)
    require_door(-0.01)
    for angle in (0.05, np.nan):
        with pytest.raises(GoalRefused, match="the door stands"):
            require_door(angle)
