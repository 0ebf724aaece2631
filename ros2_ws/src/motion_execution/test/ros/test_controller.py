"""A ros2_control controller over DDS: its action, its words, and what it says that it follows."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import rclpy
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState
from door_impact_common.node import GuardedNode, executor_of, spin_for
from humanoid_motion.mirror import Straight
from motion_execution.ros.controller import Controller
from rclpy.action import ActionServer, GoalResponse
from rclpy.parameter import Parameter
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NAME = "joint_trajectory_controller"
ENDED = {"good": "", "bad": "Aborted due to state tolerance violation"}


class Rig:
    """A controller that goes by the name of a trajectory's first joint, and its client."""

    def __init__(self) -> None:
        self.node = GuardedNode("client", parameter_overrides=[
            Parameter("controller", value=NAME), Parameter("interface", value="action")])
        self.followed: list[tuple[float, Any]] = []
        self.refused: list[str] = []
        self.controller = Controller(
            self.node, ["a", "b"], Straight(), lambda *state: self.followed.append(state),
            self.refused.append)
        self.server = ActionServer(
            self.node, FollowJointTrajectory, f"{NAME}/follow_joint_trajectory", self._end,
            goal_callback=lambda goal: GoalResponse(
                1 if goal.trajectory.joint_names[0] == "refused" else 2))
        self.states = self.node.create_publisher(
            JointTrajectoryControllerState, f"{NAME}/controller_state", 10)

    def _end(self, handle: Any) -> Any:
        words = ENDED[handle.request.trajectory.joint_names[0]]
        (handle.abort if words else handle.succeed)()
        return FollowJointTrajectory.Result(error_code=-4 if words else 0, error_string=words)


@pytest.fixture
def rig() -> Iterator[Rig]:
    rclpy.init()
    made = Rig()
    with executor_of(made.node) as executor:
        made.spin = lambda done: until(executor, done)
        made.spin(made.controller._action.server_is_ready)
        yield made
    made.server.destroy()
    made.node.destroy_node()
    rclpy.shutdown()


def until(executor: Any, done: Any) -> None:
    for _ in range(500):
        if done():
            return
        spin_for(executor, 0.01)
    raise AssertionError("it does not come")


def test_only_the_last_trajectorys_bad_end_is_told_in_the_controllers_words(rig: Rig) -> None:
    for name, words in (("refused", "rejected a trajectory"),
                        ("bad", "gave a trajectory up: Aborted due to state tolerance violation")):
        rig.refused.clear()
        rig.controller.send(JointTrajectory(joint_names=[name]))
        rig.spin(lambda: rig.refused)
        assert words in rig.refused[0]
    rig.refused.clear()
    rig.controller.send(JointTrajectory(joint_names=["bad"]))  # is preempted
    ends = [rig.node.get_clock().now()]
    rig.controller.send(JointTrajectory(joint_names=["good"]))
    rig.spin(lambda: (rig.node.get_clock().now() - ends[0]).nanoseconds > 3e8)
    assert not rig.refused


def test_no_motion_begins_unless_the_controller_says_what_it_follows(
        rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    assert f"{NAME}/controller_state: is the controller active" in rig.controller.silence
    state = JointTrajectoryControllerState(joint_names=["b", "a"])
    state.header.stamp.sec, state.reference = 7, JointTrajectoryPoint(positions=[0.2, 0.1])

    def heard() -> bool:
        rig.states.publish(state)
        return bool(rig.followed)

    rig.spin(heard)
    assert rig.controller.silence == ""
    monkeypatch.setattr(rig.controller, "_said", rig.controller._said - 0.7)
    assert "controller_state for 0.7" in rig.controller.silence
    assert rig.followed[0][0] == 7.0
    np.testing.assert_array_equal(rig.followed[0][1], [0.1, 0.2])
