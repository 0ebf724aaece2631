"""Clients of actions."""

from __future__ import annotations

import threading
import time
import uuid
import weakref
from collections.abc import Callable
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.action.names import GoalStatus, check_action_type, part
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import await_or_execute
from rclpy.node import Node
from rclpy.qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_services_default,
)
from rclpy.service import Client
from rclpy.task import Future

_POLL = 0.01
_ENDED = (GoalStatus.SUCCEEDED, GoalStatus.CANCELED, GoalStatus.ABORTED)


class ClientGoalHandle:
    """A goal, as the client sees it."""

    def __init__(self, action_client: ActionClient, goal_id: Any, goal_response: Any) -> None:
        """Made by the client when the server has answered."""
        self._action_client, self._goal_id = action_client, goal_id
        self._goal_response = goal_response
        self._status = int(GoalStatus.UNKNOWN)

    def __eq__(self, other: object) -> bool:
        """Whether both handles are of the same goal."""
        return bool(self._goal_id == other.goal_id)  # type: ignore[attr-defined]

    def __repr__(self) -> str:
        """A text with the identity, the acceptance and the state."""
        return (
            f"ClientGoalHandle <id={self.goal_id.uuid}, accepted={self.accepted}, "
            f"status={self.status}>"
        )

    @property
    def goal_id(self) -> Any:
        """unique_identifier_msgs/msg/UUID of the goal."""
        return self._goal_id

    @property
    def stamp(self) -> Any:
        """Time of the acceptance, builtin_interfaces/msg/Time."""
        return self._goal_response.stamp

    @property
    def accepted(self) -> bool:
        """Whether the server has accepted it."""
        return bool(self._goal_response.accepted)

    @property
    def status(self) -> int:
        """The last state of the goal that was received on the topic `status`."""
        return self._status

    def set_status(self, status: int) -> None:
        """Stores a state that was received on the topic `status`."""
        self._status = status

    def cancel_goal_async(self) -> Future:
        """Asks for a cancellation; the future gets the CancelGoal response."""
        return self._action_client.cancel_goal_async(self)

    def cancel_goal(self) -> Any:
        """Asks for a cancellation and waits; another thread must spin the node."""
        return _wait(self.cancel_goal_async())

    def get_result_async(self) -> Future:
        """The future gets the response with `status` and `result` when the goal has ended."""
        return self._action_client.get_result_async(self)

    def get_result(self) -> Any:
        """Waits for the result; another thread must spin the node."""
        return _wait(self.get_result_async())


def _wait(future: Future) -> Any:
    event = threading.Event()
    future._add_waker(event.set)
    event.wait()
    return future.result()


def _check_handle(handle: Any) -> None:
    if not isinstance(handle, ClientGoalHandle):
        raise TypeError(f"Expected type ClientGoalHandle but received {type(handle)}")


class ActionClient:
    """Sends goals to an action's server."""

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_sub_qos_profile: QoSProfile | None = None,
        status_sub_qos_profile: QoSProfile = qos_profile_action_status_default,
    ) -> None:
        """Starts it; feedback is reliable and 10 deep by default."""
        check_action_type(action_type)
        self._node, self._action_type = node, action_type
        self._goal_handles: dict[bytes, weakref.ref[ClientGoalHandle]] = {}
        self._early: dict[bytes, int] = {}
        """States of goals that arrived before the server's answer."""
        self._feedback_callbacks: dict[bytes, Callable[[Any], Any]] = {}
        impl = action_type.Impl
        self._goal_client, self._cancel_client, self._result_client = self._clients = [
            Client(node, kind, part(action_name, name), qos, callback_group)
            for kind, name, qos in (
                (impl.SendGoalService, "send_goal", goal_service_qos_profile),
                (impl.CancelGoalService, "cancel_goal", cancel_service_qos_profile),
                (impl.GetResultService, "get_result", result_service_qos_profile),
            )
        ]
        self._subscriptions = [
            # Of the class itself: as in rclpy, a node that overrides the method takes no part.
            Node.create_subscription(
                node, kind, part(action_name, name), callback, qos, callback_group=callback_group
            )
            for kind, name, callback, qos in (
                (impl.FeedbackMessage, "feedback", self._on_feedback,
                 feedback_sub_qos_profile or 10),
                (message_class("action_msgs/msg/GoalStatusArray"), "status", self._on_status,
                 status_sub_qos_profile),
            )
        ]  # fmt: skip
        node.add_waitable(self)

    def entities(self) -> list[Any]:
        """The entities of the client that an executor serves."""
        return list(self._clients)

    async def _on_feedback(self, message: Any) -> None:
        callback = self._feedback_callbacks.get(bytes(message.goal_id.uuid))
        if callback is not None:
            await await_or_execute(callback, message)

    def _on_status(self, message: Any) -> None:
        for state in message.status_list:
            key = bytes(state.goal_info.goal_id.uuid)
            if key in self._early:
                self._early[key] = int(state.status)
                continue
            reference = self._goal_handles.get(key)
            handle = None if reference is None else reference()
            if handle is not None:
                handle.set_status(int(state.status))
            if handle is None or state.status in _ENDED:
                self._goal_handles.pop(key, None)

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
        if not isinstance(goal, self._action_type.Goal):
            raise TypeError(
                f"Expected {self._action_type.Goal.__name__}, got {type(goal).__name__}"
            )
        if goal_uuid is None:
            goal_uuid = message_class("unique_identifier_msgs/msg/UUID")(uuid=uuid.uuid4().bytes)
        if feedback_callback is not None:
            self._feedback_callbacks[bytes(goal_uuid.uuid)] = feedback_callback
        future = Future()
        request = self._action_type.Impl.SendGoalService.Request(goal_id=goal_uuid, goal=goal)
        self._early[bytes(goal_uuid.uuid)] = int(GoalStatus.UNKNOWN)
        sent = self._goal_client.call_async(request)
        sent._add_waker(lambda: self._on_answer(sent, goal_uuid, future))
        future._add_waker(sent.cancel)  # as after a cancellation
        return future

    def _on_answer(self, sent: Future, goal_uuid: Any, future: Future) -> None:
        key = bytes(goal_uuid.uuid)
        status = self._early.pop(key, int(GoalStatus.UNKNOWN))
        if sent.cancelled():
            return
        handle = ClientGoalHandle(self, goal_uuid, sent.result())
        if handle.accepted:
            handle.set_status(status)
            if key in self._goal_handles:
                raise RuntimeError(f"Two goals were accepted with the same ID ({handle})")
            self._goal_handles[key] = weakref.ref(handle)
        future._set_executor(self._node.executor)
        future.set_result(handle)

    def send_goal(self, goal: Any, **options: Any) -> Any:
        """Sends a goal and waits for the response with its result; another thread must spin."""
        return self.get_result(_wait(self.send_goal_async(goal, **options)))

    def get_result(self, handle: ClientGoalHandle) -> Any:
        """Waits for the response with the result; another thread must spin the node."""
        return _wait(self.get_result_async(handle))

    def cancel_goal_async(self, handle: ClientGoalHandle) -> Future:
        """Asks for the cancellation of a goal."""
        _check_handle(handle)
        request = self._action_type.Impl.CancelGoalService.Request()
        request.goal_info.goal_id = handle.goal_id
        return self._cancel_client.call_async(request)

    def get_result_async(self, handle: ClientGoalHandle) -> Future:
        """Asks for the result of a goal; when it has come there is no more feedback."""
        _check_handle(handle)
        request = self._action_type.Impl.GetResultService.Request(goal_id=handle.goal_id)
        future = self._result_client.call_async(request)
        key = bytes(handle.goal_id.uuid)
        future._add_waker(lambda: self._feedback_callbacks.pop(key, None))
        return future

    def server_is_ready(self) -> bool:
        """Whether a server has been discovered."""
        heard = all(s.get_publisher_count() for s in self._subscriptions)
        return heard and all(client.service_is_ready() for client in self._clients)

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Waits for a server; False after the timeout or a shutdown of the context."""
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while self._node.context.ok() and not self.server_is_ready():
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(_POLL)
        return self.server_is_ready()

    def destroy(self) -> None:
        """Ends it."""
        for client in self._clients:
            client.destroy()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._node.remove_waitable(self)
