"""Preflight: a good plan passes; one that jumps or breaks a limit is refused by the joint."""

from dataclasses import replace

import numpy as np
import pytest
from humanoid_motion.knots import Knots
from impact_planner.errors import GoalRefused
from motion_execution.hit.preflight import require_door, require_limits, require_start


def moved(knots: Knots, rows, joint: int, by: float) -> Knots:
    """Knots of which one joint is elsewhere in some rows [rad]."""
    position = knots.position.copy()
    position[rows, joint] += by
    return replace(knots, position=position)


@pytest.mark.parametrize(("phase", "change", "words"), [
    ("hold", lambda knots: knots, None),
    ("shift", lambda knots: moved(knots, 1, 3, 9.0), "RLEG_JOINT3"),
    ("hold", lambda knots: moved(knots, slice(None), 14, 0.02), "HEAD_JOINT0"),
    ("hold", lambda knots: Knots(knots.time / 20.0, knots.position, knots.velocity * 20.0,
                                 knots.acceleration), "rad/s"),
], ids=["good", "out of range", "jump", "too fast"])
def test_a_plan_passes_unless_a_joint_leaves_its_range_jumps_or_is_too_fast(
        robot, good, phase, change, words):
    plan = replace(good, phases={**good.phases, phase: change(good.phases[phase])})
    if words is None:
        require_limits(robot, plan)
        return
    with pytest.raises(GoalRefused, match=words) as error:
        require_limits(robot, plan)
    assert error.value.reason == "no_plan"


def test_a_robot_or_a_door_elsewhere_is_refused(robot, good):
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
