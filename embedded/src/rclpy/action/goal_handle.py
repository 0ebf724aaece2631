"""Goals, as their server sees them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rclpy.action.names import GoalStatus
from rclpy.exceptions import RCLError

_ACTIVE = (GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)
CANCELABLE = (GoalStatus.ACCEPTED, GoalStatus.EXECUTING)
"""States in which a cancellation can be asked for."""

_BEFORE = {
    GoalStatus.EXECUTING: (GoalStatus.ACCEPTED,),
    GoalStatus.CANCELING: CANCELABLE,
    GoalStatus.SUCCEEDED: (GoalStatus.EXECUTING, GoalStatus.CANCELING),
    GoalStatus.ABORTED: (GoalStatus.EXECUTING, GoalStatus.CANCELING),
    GoalStatus.CANCELED: (GoalStatus.CANCELING,),
}
"""From which states each one can be reached (rcl_action's goal_state_machine.c)."""


class ServerGoalHandle:
    """A goal, as the callback that executes it sees it."""

    def __init__(self, action_server: Any, goal_info: Any, goal_request: Any) -> None:
        """Made by the server; is accepted at first."""
        self._action_server, self._goal_info = action_server, goal_info
        self._goal_request = goal_request
        self._status = GoalStatus.ACCEPTED
        self._lock = threading.Lock()

    def __eq__(self, other: object) -> bool:
        """Whether both handles are of the same goal."""
        return bool(self.goal_id == other.goal_id)  # type: ignore[attr-defined]

    @property
    def goal_info(self) -> Any:
        """action_msgs/msg/GoalInfo of the goal."""
        return self._goal_info

    @property
    def goal_id(self) -> Any:
        """unique_identifier_msgs/msg/UUID of the goal."""
        return self._goal_info.goal_id

    @property
    def request(self) -> Any:
        """The goal."""
        return self._goal_request

    @property
    def status(self) -> int:
        """State of the goal, UNKNOWN when the server has forgotten it."""
        return self._status

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self._status in _ACTIVE

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a cancellation was asked for and granted."""
        return self._status == GoalStatus.CANCELING

    def update_state(self, status: GoalStatus) -> None:
        """Changes the state and publishes it; does nothing to a goal that is forgotten.

        Raises:
            RCLError: the state it is in does not allow that.
        """
        with self._lock:
            if self._status == GoalStatus.UNKNOWN:
                return
            if self._status not in _BEFORE[status]:
                raise RCLError(
                    "Failed to update goal state: goal_handle attempted invalid transition from "
                    f"state {self._status.name} to {status.name}"
                )
            self._status = status
        self._action_server.publish_status()

    def execute(self, execute_callback: Callable[[ServerGoalHandle], Any] | None = None) -> None:
        """Has the goal executed by the executor, also if a cancellation was granted already."""
        if not self.is_cancel_requested:
            self.update_state(GoalStatus.EXECUTING)
        self._action_server.notify_execute(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Sends feedback to the client.

        Raises:
            TypeError: The message is not the action's feedback.
        """
        action_type = self._action_server.action_type
        if not isinstance(feedback, action_type.Feedback):
            expected = action_type.Feedback.__name__
            raise TypeError(f"Expected {expected}, got {type(feedback).__name__}")
        if self._status != GoalStatus.UNKNOWN:
            message = action_type.Impl.FeedbackMessage(goal_id=self.goal_id, feedback=feedback)
            self._action_server.publish_feedback(message)

    def succeed(self) -> None:
        """Ends it well."""
        self.update_state(GoalStatus.SUCCEEDED)

    def abort(self) -> None:
        """Ends it as failed."""
        self.update_state(GoalStatus.ABORTED)

    def canceled(self) -> None:
        """Ends it as cancelled; a cancellation must have been granted."""
        self.update_state(GoalStatus.CANCELED)

    def destroy(self) -> None:
        """Forgets the goal."""
        with self._lock:
            self._status = GoalStatus.UNKNOWN
