"""Servers of actions."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.action.names import GoalStatus, check_action_type, part
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import RCLError
from rclpy.qos import QoSProfile, qos_profile_action_status_default
from rclpy.task import Future

_UNKNOWN_GOAL, _TERMINATED, _REJECTED = 2, 3, 1  # action_msgs/srv/CancelGoal
_FEEDBACK_QOS = QoSProfile(depth=10)


class GoalResponse(IntEnum):
    """Answer to a goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(IntEnum):
    """Answer to a wish to cancel."""

    REJECT = 1
    ACCEPT = 2


class ServerGoalHandle:
    """A goal, as the callback that executes it sees it."""

    def __init__(self, server: ActionServer, goal_id: Any, request: Any, stamp: Any) -> None:
        """Is accepted at first."""
        self._server, self._goal_id, self._request = server, goal_id, request
        self.stamp = stamp
        self._status = GoalStatus.ACCEPTED
        self.result_future = Future()
        self.ended_at: int | None = None

    @property
    def goal_id(self) -> Any:
        """unique_identifier_msgs/msg/UUID of the goal."""
        return self._goal_id

    @property
    def request(self) -> Any:
        """The goal."""
        return self._request

    @property
    def status(self) -> GoalStatus:
        """State of the goal."""
        return self._status

    @property
    def is_active(self) -> bool:
        """Whether it has not ended."""
        return self._status.active

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a cancellation was asked for and granted."""
        return self._status == GoalStatus.CANCELING

    def set_status(self, status: GoalStatus, *allowed_from: GoalStatus) -> None:
        """Changes the state and publishes it.

        Raises:
            RCLError: the state it is in does not allow that.
        """
        if self._status not in allowed_from:
            raise RCLError(
                f"Failed to update goal state: no way from {self._status.name} to {status.name}"
            )
        self._status = status
        self._server.publish_status()

    def execute(self, execute_callback: Callable[[ServerGoalHandle], Any] | None = None) -> None:
        """Has the goal executed by the executor."""
        if not self.is_cancel_requested:
            self.set_status(GoalStatus.EXECUTING, GoalStatus.ACCEPTED)
        self._server.notify_execute(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Tells the client how it goes.

        Raises:
            TypeError: a message that is not the action's feedback.
        """
        self._server.publish_feedback(self._goal_id, feedback)

    def succeed(self, response: Any = None) -> None:
        """Ends it well; the result may be given here."""
        self._end(GoalStatus.SUCCEEDED, response)

    def abort(self, response: Any = None) -> None:
        """Ends it as failed; the result may be given here."""
        self._end(GoalStatus.ABORTED, response)

    def canceled(self, response: Any = None) -> None:
        """Ends it as cancelled; the result may be given here."""
        self.set_status(GoalStatus.CANCELED, GoalStatus.CANCELING)
        if response is not None:
            self.result_future.set_result(response)

    def _end(self, status: GoalStatus, response: Any) -> None:
        self.set_status(status, GoalStatus.EXECUTING, GoalStatus.CANCELING)
        if response is not None:
            self.result_future.set_result(response)

    def destroy(self) -> None:
        """Forgets the goal."""


class ActionServer:
    """Takes goals and executes them."""

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], GoalResponse] = lambda goal: GoalResponse.ACCEPT,
        handle_accepted_callback: Callable[[Any], Any] = lambda handle: handle.execute(),
        cancel_callback: Callable[[Any], CancelResponse] = lambda handle: CancelResponse.REJECT,
        result_timeout: int = 10,
        **_: Any,
    ) -> None:
        """Starts it.

        Args:
            node: the node that it belongs to.
            action_type: class of the action.
            action_name: name of the action.
            execute_callback: executes a goal and returns the result; may be a coroutine function.
            callback_group: group of the callbacks.
            goal_callback: accepts or rejects a goal.
            handle_accepted_callback: starts an accepted goal; by default at once.
            cancel_callback: accepts or rejects a cancellation; by default rejects.
            result_timeout: how long a result is kept [s].
        """
        check_action_type(action_type)
        self._node, self._type = node, action_type
        self._execute_callback = execute_callback
        self._goal_callback, self._cancel_callback = goal_callback, cancel_callback
        self._accepted_callback = handle_accepted_callback
        self._result_timeout_ns = int(result_timeout * 1e9)
        self._lock = threading.RLock()
        self._goals: dict[bytes, ServerGoalHandle] = {}
        impl = action_type.Impl
        self.action_name = node.resolve_topic_name(action_name)
        self._publishers = [
            node.create_publisher(
                impl.FeedbackMessage, part(self.action_name, "feedback"), _FEEDBACK_QOS
            ),
            node.create_publisher(
                message_class("action_msgs/msg/GoalStatusArray"),
                part(self.action_name, "status"),
                qos_profile_action_status_default,
            ),
        ]
        self._services = [
            node.create_service(
                kind, part(self.action_name, name), handler, callback_group=callback_group
            )
            for kind, name, handler in (
                (impl.SendGoalService, "send_goal", self._on_goal),
                (impl.CancelGoalService, "cancel_goal", self._on_cancel),
                (impl.GetResultService, "get_result", self._on_get_result),
            )
        ]
        node.add_waitable(self)

    def register_goal_callback(self, goal_callback: Callable[[Any], GoalResponse]) -> None:
        """Replaces the callback that accepts or rejects goals."""
        self._goal_callback = goal_callback

    def register_cancel_callback(self, cancel_callback: Callable[[Any], CancelResponse]) -> None:
        """Replaces the callback that accepts or rejects cancellations."""
        self._cancel_callback = cancel_callback

    def _now(self) -> Any:
        return self._node.get_clock().now().to_msg()

    def _on_goal(self, request: Any, response: Any) -> Any:
        """Answers `send_goal`."""
        self._expire()
        key = bytes(request.goal_id.uuid)
        if key in self._goals:
            self._node.get_logger().error(f"A goal with the id {key.hex()} is there already")
            return response
        response.accepted = self._goal_callback(request.goal) == GoalResponse.ACCEPT
        if response.accepted:
            response.stamp = self._now()
            handle = ServerGoalHandle(self, request.goal_id, request.goal, response.stamp)
            with self._lock:
                self._goals[key] = handle
            self.publish_status()
            # As a task: the client has the answer before the execution begins.
            self._node.executor.create_task(self._accepted_callback, handle)
        return response

    def _candidates(self, info: Any) -> list[ServerGoalHandle]:
        """Goals that a cancellation means: by id, or up to a time, or all."""
        key = bytes(info.goal_id.uuid)
        until = (info.stamp.sec, info.stamp.nanosec)
        chosen = []
        for goal_key, handle in self._goals.items():
            before = until != (0, 0) and (handle.stamp.sec, handle.stamp.nanosec) <= until
            if goal_key == key or before or (not any(key) and until == (0, 0)):
                chosen.append(handle)
        return chosen

    def _on_cancel(self, request: Any, response: Any) -> Any:
        """Answers `cancel_goal`."""
        info = message_class("action_msgs/msg/GoalInfo")
        with self._lock:
            candidates = self._candidates(request.goal_info)
        active = [handle for handle in candidates if handle.is_active]
        granted = []
        for handle in active:
            if self._cancel_callback(handle) != CancelResponse.ACCEPT or not handle.is_active:
                continue
            if not handle.is_cancel_requested:
                handle.set_status(GoalStatus.CANCELING, GoalStatus.ACCEPTED, GoalStatus.EXECUTING)
            granted.append(info(goal_id=handle.goal_id, stamp=handle.stamp))
        response.goals_canceling = granted
        one = any(request.goal_info.goal_id.uuid)
        if one and not candidates:
            response.return_code = _UNKNOWN_GOAL
        elif one and not active:
            response.return_code = _TERMINATED
        elif not granted:
            response.return_code = _REJECTED
        return response

    async def _on_get_result(self, request: Any, response: Any) -> Any:
        """Answers `get_result` when the goal has ended."""
        handle = self._goals.get(bytes(request.goal_id.uuid))
        if handle is None:
            response.status = int(GoalStatus.UNKNOWN)
            return response
        response.result = await handle.result_future
        response.status = int(handle.status)
        return response

    def notify_execute(
        self, handle: ServerGoalHandle, execute_callback: Callable[[Any], Any] | None
    ) -> None:
        """Has a goal executed by the executor."""
        callback = execute_callback or self._execute_callback
        self._node.executor.create_task(self._execute, callback, handle)

    async def _execute(self, callback: Callable[[Any], Any], handle: ServerGoalHandle) -> None:
        result = None
        try:
            returned = callback(handle)
            result = await returned if inspect.isawaitable(returned) else returned
        except Exception as error:
            self._node.get_logger().error(f"Error raised in execute callback: {error!r}")
        if handle.is_active:
            self._node.get_logger().warning(
                f"Goal state not set, assuming aborted. Goal ID: {bytes(handle.goal_id.uuid).hex()}"
            )
            if handle.status == GoalStatus.ACCEPTED:
                handle.set_status(GoalStatus.EXECUTING, GoalStatus.ACCEPTED)
            handle.abort()
        handle.ended_at = self._node.get_clock().nanoseconds()
        handle.result_future.set_result(self._type.Result() if result is None else result)

    def publish_status(self) -> None:
        """Publishes the states of all goals."""
        status = message_class("action_msgs/msg/GoalStatus")
        info = message_class("action_msgs/msg/GoalInfo")
        publisher = self._publishers[1]
        with self._lock:
            states = [
                status(
                    goal_info=info(goal_id=handle.goal_id, stamp=handle.stamp),
                    status=int(handle.status),
                )
                for handle in self._goals.values()
            ]
        publisher.publish(publisher.msg_type(status_list=states))

    def publish_feedback(self, goal_id: Any, feedback: Any) -> None:
        """Publishes feedback on a goal."""
        if not isinstance(feedback, self._type.Feedback):
            expected = self._type.Feedback.__name__
            raise TypeError(f"Expected {expected}, got {type(feedback).__name__}")
        message = self._type.Impl.FeedbackMessage(goal_id=goal_id, feedback=feedback)
        self._publishers[0].publish(message)

    def _expire(self) -> None:
        """Forgets goals that ended long ago."""
        now = self._node.get_clock().nanoseconds()
        with self._lock:
            for key, handle in list(self._goals.items()):
                if handle.ended_at is not None and now - handle.ended_at > self._result_timeout_ns:
                    del self._goals[key]

    def destroy(self) -> None:
        """Ends it."""
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)
        for service in self._services:
            self._node.destroy_service(service)
        self._node.remove_waitable(self)
