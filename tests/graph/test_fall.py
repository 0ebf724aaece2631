"""A robot that falls in a walk says so; after a reset it walks again."""

from typing import Any

import pytest
from door_impact_msgs.srv import PushRobot
from geometry_msgs.msg import Vector3

from graph.test_walk import Result, stands, to, walker


def test_a_fallen_robot_reports_drops_its_plan_and_walks_again_after_a_reset(graph: Any) -> None:
    """A shove of 120 N s, and none of 10,000; the next goal is refused while the robot lies."""
    graph.client(PushRobot, "/sim/push_robot")
    with walker(graph) as walk:
        sent = walk.begin(to(2.0), 2)
        refused = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=1e4))
        assert not refused.success
        assert "impulse" in refused.message
        answer = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=20.0, y=-120.0))
        assert answer.success, answer.message
        found = sent.end.result
        assert found.error_code == Result.FELL, found.message
        assert walk.send(to(0.5)).end.result.error_code == Result.NOT_READY
        graph.reset()
        again = walk.arrive(to(0.3)).end.result
        assert again.pose.pose.position.x == pytest.approx(0.3, abs=0.02)
        stands(graph)
