"""Servers of actions."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from enum import Enum
from typing import Any

from ros2_embedded.messages import message_class

from rclpy.action.goal_handle import CANCELABLE, ServerGoalHandle
from rclpy.action.names import GoalStatus, check_action_type, part
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import RCLError
from rclpy.executors import await_or_execute
from rclpy.qos import (
    QoSProfile,
    qos_profile_action_status_default,
    qos_profile_services_default,
)
from rclpy.service import RequestHeader, Service
from rclpy.task import Future

_NONE, _UNKNOWN_GOAL, _TERMINATED = 0, 2, 3  # action_msgs/srv/CancelGoal


class GoalResponse(Enum):
    """Answer to a goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """Answer to a request to cancel a goal."""

    REJECT = 1
    ACCEPT = 2


def default_handle_accepted_callback(goal_handle: ServerGoalHandle) -> None:
    """Executes the goal at once."""
    goal_handle.execute()


def default_goal_callback(goal_request: Any) -> GoalResponse:
    """Accepts every goal."""
    return GoalResponse.ACCEPT


def default_cancel_callback(cancel_request: Any) -> CancelResponse:
    """Rejects every cancellation."""
    return CancelResponse.REJECT


class _ActionService(Service):
    """A service whose callback replies itself: it gets the request and its header."""

    def answer(self, request: Any, header: RequestHeader) -> Any:
        """Calls the callback, a coroutine function."""
        return self.callback(request, header)


class ActionServer:
    """Accepts goals and executes them."""

    def __init__(
        self,
        node: Any,
        action_type: Any,
        action_name: str,
        execute_callback: Callable[[ServerGoalHandle], Any],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: Callable[[Any], Any] | None = default_goal_callback,
        handle_accepted_callback: Callable[[Any], Any] | None = default_handle_accepted_callback,
        cancel_callback: Callable[[Any], Any] | None = default_cancel_callback,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_pub_qos_profile: QoSProfile | None = None,
        status_pub_qos_profile: QoSProfile = qos_profile_action_status_default,
        result_timeout: float = 900,
    ) -> None:
        """Starts it. Each callback may be a coroutine function.

        Args:
            node: the node that it belongs to.
            action_type: class of the action.
            action_name: name of the action.
            execute_callback: executes a goal and returns the result.
            callback_group: group of the callbacks but `execute_callback`, which has none.
            goal_callback: accepts or rejects a goal.
            handle_accepted_callback: starts an accepted goal; by default at once.
            cancel_callback: accepts or rejects a cancellation; by default rejects.
            goal_service_qos_profile: quality of the service `send_goal`.
            result_service_qos_profile: quality of the service `get_result`.
            cancel_service_qos_profile: quality of the service `cancel_goal`.
            feedback_pub_qos_profile: quality of the topic `feedback`; by default reliable, 10 deep.
            status_pub_qos_profile: quality of the topic `status`.
            result_timeout: how long a result is kept, from the acceptance of the goal [s].

        Raises:
            TypeError: no action type, or an `execute_callback` that cannot be called.
        """
        check_action_type(action_type)
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_goal_callback(goal_callback)
        self.register_cancel_callback(cancel_callback)
        self.register_execute_callback(execute_callback)
        self._node, self._action_type = node, action_type
        self._result_timeout_ns = int(result_timeout * 1e9)
        self._lock = threading.RLock()
        self._goal_handles: dict[bytes, ServerGoalHandle] = {}
        self._result_futures: dict[bytes, Future] = {}
        self._logger = node.get_logger().get_child("action_server")
        impl = action_type.Impl
        self._feedback_publisher, self._status_publisher = (
            node.create_publisher(kind, part(action_name, name), qos)
            for kind, name, qos in (
                (impl.FeedbackMessage, "feedback", feedback_pub_qos_profile or 10),
                (message_class("action_msgs/msg/GoalStatusArray"), "status",
                 status_pub_qos_profile),
            )
        )  # fmt: skip
        self._goal_service, self._cancel_service, self._result_service = self._services = [
            _ActionService(node, kind, part(action_name, name), handler, qos, callback_group)
            for kind, name, handler, qos in (
                (impl.SendGoalService, "send_goal", self._on_goal, goal_service_qos_profile),
                (impl.CancelGoalService, "cancel_goal", self._on_cancel,
                 cancel_service_qos_profile),
                (impl.GetResultService, "get_result", self._on_get_result,
                 result_service_qos_profile),
            )
        ]  # fmt: skip
        node.add_waitable(self)

    @property
    def action_type(self) -> Any:
        """Class of the action."""
        return self._action_type

    def entities(self) -> list[Any]:
        """The entities of the server that an executor serves."""
        return list(self._services)

    def register_handle_accepted_callback(self, callback: Callable[[Any], Any] | None) -> None:
        """Replaces the callback that starts accepted goals; None starts them at once."""
        self._handle_accepted_callback = callback or default_handle_accepted_callback

    def register_goal_callback(self, goal_callback: Callable[[Any], Any] | None) -> None:
        """Replaces the callback that accepts or rejects goals; None accepts all."""
        self._goal_callback = goal_callback or default_goal_callback

    def register_cancel_callback(self, cancel_callback: Callable[[Any], Any] | None) -> None:
        """Replaces the callback that accepts or rejects cancellations; None rejects all."""
        self._cancel_callback = cancel_callback or default_cancel_callback

    def register_execute_callback(self, execute_callback: Callable[[Any], Any]) -> None:
        """Replaces the callback that executes goals; raises TypeError unless it can be called."""
        if not callable(execute_callback):
            raise TypeError("Failed to register goal execution callback: not callable")
        self._execute_callback = execute_callback

    # The services.

    async def _on_goal(self, request: Any, header: RequestHeader) -> None:
        self._expire()
        response = self._action_type.Impl.SendGoalService.Response()
        key, handle = bytes(request.goal_id.uuid), None
        if key not in self._goal_handles:
            answer = await await_or_execute(self._goal_callback, request.goal)
            if not isinstance(answer, GoalResponse):
                self._logger.warning(
                    "Goal request callback did not return a GoalResponse type. Rejecting goal."
                )
            elif answer == GoalResponse.ACCEPT:
                response.accepted = True
                response.stamp = self._node.get_clock().now().to_msg()
                handle = self._new_goal(request, response.stamp)
        self._reply(self._goal_service, response, header)
        if handle is not None:
            await await_or_execute(self._handle_accepted_callback, handle)

    def _new_goal(self, request: Any, stamp: Any) -> ServerGoalHandle:
        info = message_class("action_msgs/msg/GoalInfo")(goal_id=request.goal_id, stamp=stamp)
        handle = ServerGoalHandle(self, info, request.goal)
        key = bytes(request.goal_id.uuid)
        with self._lock:
            self._goal_handles[key], self._result_futures[key] = handle, Future()
        return handle

    async def _on_cancel(self, request: Any, header: RequestHeader) -> None:
        self._expire()
        response = self._action_type.Impl.CancelGoalService.Response()
        response.return_code, handles = self._to_cancel(request.goal_info)
        canceling = []
        for handle in handles:
            answer = await await_or_execute(self._cancel_callback, handle)
            if answer != CancelResponse.ACCEPT:
                continue
            try:
                handle.update_state(GoalStatus.CANCELING)
            except RCLError as error:  # it has ended meanwhile
                self._logger.debug(f"Failed to cancel goal in cancel callback: {error}")
            else:
                canceling.append(handle.goal_info)
        response.goals_canceling = canceling
        self._reply(self._cancel_service, response, header)

    def _to_cancel(self, info: Any) -> tuple[int, list[ServerGoalHandle]]:
        """Return code and goals that a cancellation means: by id, up to a time, or all."""
        key, until = bytes(info.goal_id.uuid), (info.stamp.sec, info.stamp.nanosec)
        with self._lock:
            handles = list(self._goal_handles.values())
            one = self._goal_handles.get(key)
        if any(key) and until == (0, 0):
            if one is None:
                return _UNKNOWN_GOAL, []
            return (_NONE, [one]) if one.status in CANCELABLE else (_TERMINATED, [])
        chosen = []
        for handle in handles:
            stamp = handle.goal_info.stamp
            meant = until == (0, 0) or (stamp.sec, stamp.nanosec) <= until or handle is one
            if meant and handle.status in CANCELABLE:
                chosen.append(handle)
        return _NONE, chosen

    async def _on_get_result(self, request: Any, header: RequestHeader) -> None:
        self._expire()
        future = self._result_futures.get(bytes(request.goal_id.uuid))
        if future is None:  # the status of this response is UNKNOWN
            response = self._action_type.Impl.GetResultService.Response()
            self._reply(self._result_service, response, header)
            return
        future._add_waker(lambda: self._reply(self._result_service, future.result(), header))

    def _reply(self, service: Service, response: Any, header: RequestHeader) -> None:
        try:
            service.send_response(response, header)
        except RCLError:
            self._logger.warning("Failed to send response (the client may have gone away)")

    # Goals.

    def notify_execute(
        self, goal_handle: ServerGoalHandle, execute_callback: Callable[[Any], Any] | None
    ) -> None:
        """Has a goal executed by the executor."""
        callback = execute_callback or self._execute_callback
        self._node.executor.create_task(self._execute, callback, goal_handle)

    async def _execute(self, callback: Callable[[Any], Any], handle: ServerGoalHandle) -> None:
        try:
            result = await await_or_execute(callback, handle)
        except Exception as error:
            result = self._action_type.Result()
            self._logger.error(f"Error raised in execute callback: {error}")
            traceback.print_exc()
        if handle.is_active:
            uuid = handle.goal_id.uuid
            self._logger.warning(f"Goal state not set, assuming aborted. Goal ID: {uuid}")
            handle.abort()
        response = self._action_type.Impl.GetResultService.Response()
        response.status, response.result = int(handle.status), result
        future = self._result_futures.get(bytes(handle.goal_id.uuid))
        if future is not None:
            future.set_result(response)

    def publish_status(self) -> None:
        """Publishes the states of all goals."""
        status = message_class("action_msgs/msg/GoalStatus")
        with self._lock:
            states = [
                status(goal_info=handle.goal_info, status=int(handle.status))
                for handle in self._goal_handles.values()
            ]
            publisher = self._status_publisher
            publisher.publish(publisher.msg_type(status_list=states))

    def publish_feedback(self, message: Any) -> None:
        """Publishes a message of the topic `feedback`."""
        self._feedback_publisher.publish(message)

    def _expire(self) -> None:
        """Forgets goals that have ended and were accepted long ago."""
        now = self._node.get_clock().nanoseconds()
        with self._lock:
            for key, handle in list(self._goal_handles.items()):
                stamp = handle.goal_info.stamp
                age = now - stamp.sec * 1_000_000_000 - stamp.nanosec
                if not handle.is_active and age > self._result_timeout_ns:
                    handle.destroy()
                    del self._goal_handles[key], self._result_futures[key]

    def destroy(self) -> None:
        """Ends it."""
        for handle in self._goal_handles.values():
            handle.destroy()
        for publisher in (self._feedback_publisher, self._status_publisher):
            self._node.destroy_publisher(publisher)
        for service in self._services:
            service.destroy()
        self._node.remove_waitable(self)
