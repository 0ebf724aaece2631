"""Plans and executes hits through the nodes impact_planner and impact_executor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from door_impact_common.node import GuardedNode, until
from door_impact_msgs.action import ExecuteDoorImpact
from door_impact_msgs.msg import ImpactPlan
from door_impact_msgs.srv import PlanDoorImpact
from rclpy.action import ActionClient

from walking.errors import HitNotPlanned, InvalidGoal, NotReady, Stopped

PLAN, EXECUTE = "/plan_door_impact", "/execute_door_impact"
_PATIENCE = 5.0  # time in which a server must be found and answer, by the computer's clock [s]
_LONGEST = 60.0  # longest time that the planner may take, by the computer's clock [s]


class HitClient:
    """The other side of planner and executor, which does not wait for a node that has ended.

    Args:
        node: Node that calls them.
    """

    def __init__(self, node: GuardedNode) -> None:
        self._node = node
        self._plan = node.create_client(PlanDoorImpact, PLAN)
        self._execute = ActionClient(node, ExecuteDoorImpact, EXECUTE)
        self._handle: Any = None  # of the hit that is being executed

    async def plan(
        self, angle: float, ending: str, run_up: str, stopped: Callable[[], bool]
    ) -> ImpactPlan:
        """Plan a hit that ends with the leaf in the hand.

        Args:
            angle: Opening angle [rad].
            ending: As in PlanDoorImpact, hold or pass.
            run_up: As in PlanDoorImpact.
            stopped: Whether the plan is not wanted any more.

        Raises:
            InvalidGoal: A value makes no sense.
            HitNotPlanned: There is no such hit.
            NotReady: The planner does not answer.
            Stopped: The plan is not wanted any more.
        """
        await self._served(self._plan.service_is_ready, PLAN, "impact_planner")
        future = self._plan.call_async(PlanDoorImpact.Request(
            desired_opening_angle=angle, run_up=run_up, ending=ending,
            include_trajectories=True))
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

    async def execute(
        self, goal: Any, goal_id: Any, on_feedback: Callable[[Any], None],
        stopped: Callable[[], bool],
    ) -> Any:
        """Execute a hit, and return the action's result.

        Args:
            goal: Goal of ExecuteDoorImpact.
            goal_id: Identifier for it, a unique_identifier_msgs/UUID.
            on_feedback: Function that gets each feedback.
            stopped: Whether it is to be cancelled as soon as it is accepted.

        Raises:
            NotReady: The executor does not answer, has ended, or executes another hit.
        """
        ready = self._execute.server_is_ready
        await self._served(ready, EXECUTE, "impact_executor")
        sent = self._execute.send_goal_async(
            goal, feedback_callback=lambda message: on_feedback(message.feedback),
            goal_uuid=goal_id)
        await until(self._node, sent.done, _PATIENCE)
        if not sent.done():
            sent.add_done_callback(lambda late: late.result().cancel_goal_async())
            raise NotReady(f"{EXECUTE} has not answered within {_PATIENCE:g} s", quantity="action",
                           value=EXECUTE)
        if not sent.result().accepted:
            raise NotReady(f"another hit is being executed ({EXECUTE})", quantity="action",
                           value=EXECUTE)
        self._handle = sent.result()
        try:
            if stopped():
                self.cancel()
            result = self._handle.get_result_async()
            await until(self._node, lambda: result.done() or not ready())
            if not result.done():
                raise NotReady("the node impact_executor has ended in the hit; what the driver has "
                               "ends with the robot standing", quantity="action", value=EXECUTE)
            return result.result().result
        finally:
            self._handle = None

    def cancel(self) -> None:
        """Cancel the hit that is being executed, if there is one."""
        if self._handle is not None:
            self._handle.cancel_goal_async()

    async def _served(self, ready: Callable[[], bool], name: str, server: str) -> None:
        """Wait until somebody serves a service or an action.

        Raises:
            NotReady: Nobody serves it.
        """
        await until(self._node, ready, _PATIENCE)
        if not ready():
            raise NotReady(f"nobody serves {name}: does the node {server} run?", quantity="name",
                           value=name)
