"""Whether another node's action is moving the robot."""

from __future__ import annotations

from typing import Any

from action_msgs.msg import GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

_ACTIVE = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)


class ActiveGoals:
    """Watches the states of an action's goals, which every action server publishes.

    Args:
        node: Node that subscribes.
        action: Name of the action.

    Attributes:
        action: Name of the action.
    """

    def __init__(self, node: Node, action: str) -> None:
        self.action = action
        self._node, self._topic = node, f"{action}/_action/status"
        self._active: set[bytes] = set()  # identifiers of the goals that are being executed
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(GoalStatusArray, self._topic, self._on_states, latched)
        self._cancel = node.create_client(CancelGoal, f"{action}/_action/cancel_goal")

    @property
    def running(self) -> bool:
        """Whether a goal is being executed, by a server that still exists."""
        return bool(self._active) and bool(self._node.get_publishers_info_by_topic(self._topic))

    def asked_for(self, goal_id: Any) -> bool:
        """Whether a goal of another action belongs to one that is being executed.

        A goal that has another node do a part of its work gives its own identifier to that part.

        Args:
            goal_id: The other goal's unique_identifier_msgs/UUID.
        """
        return bytes(goal_id.uuid) in self._active

    def cancel(self) -> None:
        """Cancel every goal."""
        self._cancel.call_async(CancelGoal.Request())  # without an identifier: all

    def _on_states(self, message: GoalStatusArray) -> None:
        self._active = {bytes(state.goal_info.goal_id.uuid) for state in message.status_list
                        if state.status in _ACTIVE}
