"""Whether another node's action is moving the robot."""

from __future__ import annotations

from action_msgs.msg import GoalStatus, GoalStatusArray
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
        self._node, self._topic, self._active = node, f"{action}/_action/status", False
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(GoalStatusArray, self._topic, self._on_states, latched)

    @property
    def running(self) -> bool:
        """Whether a goal is being executed, by a server that still exists."""
        return self._active and bool(self._node.get_publishers_info_by_topic(self._topic))

    def _on_states(self, message: GoalStatusArray) -> None:
        self._active = any(state.status in _ACTIVE for state in message.status_list)
