"""Has other nodes plan hits and move the robot, without waiting for a node that has ended."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from door_impact_common.node import GuardedNode, until
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from rclpy.action import ActionClient
from walking.errors import HitNotPlanned, InvalidGoal, NotReady, Stopped

PLAN = "/plan_door_impact"
_PATIENCE = 5.0  # time in which a server must be found and answer, by the computer's clock [s]
_LONGEST = 60.0  # longest time that the planner may take, by the computer's clock [s]


class HitPlanner:
    """The other side of the node impact_planner.

    Args:
        node: Node that calls it.
    """

    def __init__(self, node: GuardedNode) -> None:
        self._node = node
        self._plan = node.create_client(PlanDoorImpact, PLAN)

    async def plan(
        self, angle: float, ending: str, run_up: str, seen: tuple[float, float],
        stopped: Callable[[], bool],
    ) -> ImpactPlan:
        """Plan a hit that ends with the leaf in the hand.

        Args:
            angle: Opening angle [rad].
            ending: As in PlanDoorImpact, hold or pass.
            run_up: As in PlanDoorImpact.
            seen: door_distance and l_b, as in PlanDoorImpact.
            stopped: Whether the plan is not wanted any more.

        Raises:
            InvalidGoal: A value makes no sense.
            HitNotPlanned: There is no such hit.
            NotReady: The planner does not answer.
            Stopped: The plan is not wanted any more.
        """
        await _served(self._node, self._plan.service_is_ready, PLAN, "impact_planner")
        future = self._plan.call_async(PlanDoorImpact.Request(
            desired_opening_angle=angle, run_up=run_up, ending=ending, door_distance=seen[0],
            l_b=seen[1], include_trajectories=True))
        await until(self._node, lambda: future.done() or stopped(), _LONGEST)
        if stopped():
            raise Stopped("the goal was stopped while the hit was planned; the robot stands")
        if not future.done():
            raise NotReady(f"{PLAN} has not answered within {_LONGEST:g} s", quantity="service",
                           value=PLAN)
        answer = future.result()
        if answer.success:
            return answer.plan
        invalid = answer.error_code == PlanDoorImpact.Response.INVALID_REQUEST
        raise (InvalidGoal if invalid else HitNotPlanned)(
            f"the hit cannot be planned: {answer.message}", quantity="error_code",
            value=answer.error_code)


class MotionClient:
    """The other side of an action that moves the robot.

    Args:
        node: Node that calls it.
        kind: Type of the action.
        name: Its name.
        server: Name of the node that serves it.
    """

    def __init__(self, node: GuardedNode, kind: Any, name: str, server: str) -> None:
        self._node, self._name, self._server = node, name, server
        self._client = ActionClient(node, kind, name)
        self._handle: Any = None  # of the goal that is being executed

    async def execute(
        self, goal: Any, goal_id: Any, on_feedback: Callable[[Any], None],
        stopped: Callable[[], bool],
    ) -> Any:
        """Execute a goal, and return the action's result.

        Args:
            goal: The goal.
            goal_id: Identifier for it, a unique_identifier_msgs/UUID: that of the goal to which it
                belongs, by which the other node knows that it may move the robot.
            on_feedback: Function that gets each feedback.
            stopped: Whether it is to be cancelled as soon as it is accepted.

        Raises:
            NotReady: The server does not answer, has ended, or executes another goal.
        """
        name, ready = self._name, self._client.server_is_ready
        await _served(self._node, ready, name, self._server)
        sent = self._client.send_goal_async(
            goal, feedback_callback=lambda message: on_feedback(message.feedback),
            goal_uuid=goal_id)
        await until(self._node, sent.done, _PATIENCE)
        if not sent.done():
            sent.add_done_callback(lambda late: late.result().cancel_goal_async())
            raise NotReady(f"{name} has not answered within {_PATIENCE:g} s", quantity="action",
                           value=name)
        if not sent.result().accepted:
            raise NotReady(f"another goal of {name} is being executed", quantity="action",
                           value=name)
        self._handle = sent.result()
        try:
            if stopped():
                self.cancel()
            result = self._handle.get_result_async()
            await until(self._node, lambda: result.done() or not ready())
            if not result.done():
                raise NotReady(f"the node {self._server} has ended in its motion; what the driver "
                               "has ends with the robot standing", quantity="action", value=name)
            return result.result().result
        finally:
            self._handle = None

    def cancel(self) -> None:
        """Cancel the goal that is being executed, if there is one."""
        if self._handle is not None:
            self._handle.cancel_goal_async()


async def _served(
    node: GuardedNode, ready: Callable[[], bool], name: str, server: str
) -> None:
    """Wait until somebody serves a service or an action.

    Raises:
        NotReady: Nobody serves it.
    """
    await until(node, ready, _PATIENCE)
    if not ready():
        raise NotReady(f"nobody serves {name}: does the node {server} run?", quantity="name",
                       value=name)
