"""A robot that falls in a walk says so; after a reset it walks again."""

from typing import Any

import pytest
from door_impact_msgs.srv import PushRobot
from geometry_msgs.msg import PointStamped, Vector3
from std_srvs.srv import Trigger

from graph.test_walk import Result, stands, to, walker


def test_a_fallen_robot_reports_drops_its_plan_and_walks_again_after_a_reset(graph: Any) -> None:
    """A shove of 120 N s, and none of 10,000; the next goal is refused while the robot lies."""
    with walker(graph) as walk:
        sent = walk(to(2.0))
        sent.until_step(2)
        refused = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=1e4))
        assert not refused.success
        assert "impulse" in refused.message
        answer = graph.call(PushRobot, "/sim/push_robot", impulse=Vector3(x=20.0, y=-120.0))
        assert answer.success, answer.message
        found = sent.end.result
        assert found.error_code == Result.FELL, found.message
        assert walk(to(0.5)).end.result.error_code == Result.NOT_READY
        assert graph.call(Trigger, "/sim/reset").success
        graph.last(PointStamped, "/zmp")
        again = walk(to(0.3)).end.result
        assert again.success, again.message
        assert again.pose.pose.position.x == pytest.approx(0.3, abs=0.02)
        stands(graph)
