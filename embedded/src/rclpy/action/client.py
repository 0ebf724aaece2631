"""Clients of actions."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.action.names import GoalStatus, check_action_type, part
from rclpy.callback_groups import CallbackGroup
from rclpy.qos import QoSProfile, qos_profile_action_status_default
from rclpy.task import Future

_POLL = 0.01


class ClientGoalHandle:
    """A goal, as the client sees it."""

    def __init__(self, client: ActionClient, goal_id: Any, response: Any) -> None:
        """Made by the client when the server has answered."""
        self._client, self._goal_id = client, goal_id
        self.accepted = bool(response.accepted)
        self.stamp = response.stamp
        self.status = int(GoalStatus.ACCEPTED if self.accepted else GoalStatus.UNKNOWN)

    @property
    def goal_id(self) -> Any:
        """unique_identifier_msgs/msg/UUID of the goal."""
        return self._goal_id

    def cancel_goal_async(self) -> Future:
        """Asks for a cancellation; the future gets the CancelGoal response."""
        return self._client.cancel_goal_async(self)

    def cancel_goal(self) -> Any:
        """Asks for a cancellation and waits; another thread must spin the node."""
        return _wait(self.cancel_goal_async())

    def get_result_async(self) -> Future:
        """The future gets the response with `status` and `result` when the goal has ended."""
        return self._client.get_result_async(self)

    def get_result(self) -> Any:
        """Waits for the result; another thread must spin the node."""
        return _wait(self.get_result_async())


def _wait(future: Future) -> Any:
    event = threading.Event()
    future.add_done_callback(lambda _: event.set())
    event.wait()
    return future.result()


class ActionClient:
    """Sends goals to an action's server."""

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        **_: Any,
    ) -> None:
        """Starts it."""
        check_action_type(action_type)
        self._node, self._type = node, action_type
        self._goals: dict[bytes, ClientGoalHandle] = {}
        self._feedback: dict[bytes, Callable[[Any], Any]] = {}
        self.action_name = node.resolve_topic_name(action_name)
        impl = action_type.Impl
        self._send, self._cancel, self._result = self._clients = [
            node.create_client(kind, part(self.action_name, name), callback_group=callback_group)
            for kind, name in (
                (impl.SendGoalService, "send_goal"),
                (impl.CancelGoalService, "cancel_goal"),
                (impl.GetResultService, "get_result"),
            )
        ]
        self._subscriptions = [
            node.create_subscription(kind, part(self.action_name, name), callback, qos,
                                     callback_group=callback_group)
            for kind, name, callback, qos in (
                (impl.FeedbackMessage, "feedback", self._on_feedback, QoSProfile(depth=10)),
                (message_class("action_msgs/msg/GoalStatusArray"), "status", self._on_status,
                 qos_profile_action_status_default),
            )
        ]  # fmt: skip
        node.add_waitable(self)

    def _on_feedback(self, message: Any) -> Any:
        callback = self._feedback.get(bytes(message.goal_id.uuid))
        return callback(message) if callback is not None else None

    def _on_status(self, message: Any) -> None:
        for state in message.status_list:
            key = bytes(state.goal_info.goal_id.uuid)
            handle = self._goals.get(key)
            if handle is not None:
                handle.status = int(state.status)
                if not GoalStatus(state.status).active:
                    del self._goals[key]

    def send_goal_async(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: Any = None,
    ) -> Future:
        """Sends a goal; the future gets a `ClientGoalHandle`.

        Raises:
            TypeError: a message that is not the action's goal.
        """
        if not isinstance(goal, self._type.Goal):
            raise TypeError(f"Expected {self._type.Goal.__name__}, got {type(goal).__name__}")
        if goal_uuid is None:
            goal_uuid = message_class("unique_identifier_msgs/msg/UUID")(uuid=uuid.uuid4().bytes)
        key = bytes(goal_uuid.uuid)
        if feedback_callback is not None:
            self._feedback[key] = feedback_callback
        future = Future(executor=self._node.executor)

        def answered(sent: Future) -> None:
            handle = ClientGoalHandle(self, goal_uuid, sent.result())
            if handle.accepted:
                self._goals[key] = handle
            else:
                self._feedback.pop(key, None)
            future.set_result(handle)

        request = self._type.Impl.SendGoalService.Request(goal_id=goal_uuid, goal=goal)
        self._send.call_async(request).add_done_callback(answered)
        return future

    def send_goal(self, goal: Any, **options: Any) -> Any:
        """Sends a goal and waits for its result; another thread must spin the node."""
        handle = _wait(self.send_goal_async(goal, **options))
        return handle.get_result() if handle.accepted else None

    def cancel_goal_async(self, handle: ClientGoalHandle) -> Future:
        """Asks for the cancellation of a goal."""
        request = self._type.Impl.CancelGoalService.Request()
        request.goal_info.goal_id = handle.goal_id
        return self._cancel.call_async(request)

    def get_result_async(self, handle: ClientGoalHandle) -> Future:
        """Asks for the result of a goal."""
        request = self._type.Impl.GetResultService.Request(goal_id=handle.goal_id)
        future = self._result.call_async(request)

        def ended(done: Future) -> None:
            handle.status = int(done.result().status)
            self._feedback.pop(bytes(handle.goal_id.uuid), None)

        future.add_done_callback(ended)
        return future

    def server_is_ready(self) -> bool:
        """Whether a server has been discovered."""
        heard = all(s.get_publisher_count() for s in self._subscriptions)
        return heard and all(client.service_is_ready() for client in self._clients)

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Waits for a server; False if none came in time or the context was shut down."""
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while self._node.context.ok() and not self.server_is_ready():
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(_POLL)
        return self.server_is_ready()

    def destroy(self) -> None:
        """Ends it."""
        for client in self._clients:
            self._node.destroy_client(client)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._node.remove_waitable(self)
