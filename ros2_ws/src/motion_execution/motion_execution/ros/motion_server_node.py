"""Node motion_server: the one that moves the robot, for the actions of hit, walk and passage."""

from __future__ import annotations

import math
import sys
import traceback
from collections.abc import Callable, Coroutine
from dataclasses import asdict
from typing import Any

from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters
from door_impact_msgs.action import ExecuteDoorImpact, Walk, WalkThroughDoor
from door_impact_msgs.msg import HitReport
from door_impact_msgs.srv import PlanDoorPassage
from rclpy.action import ActionServer, CancelResponse
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from robot_driver.motion import Outcome
from std_srvs.srv import Trigger
from walking.footsteps.footstep import Pose
from walking.passing.settings import PassageSettings

from motion_execution.hit.execution import Execution
from motion_execution.mission.errors import MotionFailed
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.mission import HIT, PASSAGE, PLAN_PASSAGE, WALK, Mission
from motion_execution.mission.order import Order
from motion_execution.mission.passing import Passed
from motion_execution.ros import hit_messages, passage_messages, walk_messages
from motion_execution.ros.ros_link import RosLink
from motion_execution.settings import ExecutionSettings

POLL_PERIOD = 0.05  # time between two looks at what no message tells, such as a plan [s]
STIFFNESSES = (50.0, 2000.0)  # that HandCompliance allows [N/m]
PARAMETERS = {
    "felt_force": (math.nan, "force of the floor on both feet towards the door above which a "
                   "contact is detected; the run-up itself must stay below it; NaN: 80 N for "
                   "HRP-2, for another robot by its mass [N]"),
    "contact_deceleration": (
        ExecutionSettings.contact_deceleration, "specific force of the trunk away from the door, "
        "above what the run-up needs, from which on two readings of the IMU show a contact "
        "[m/s^2]"),
    "hand_stiffness": (0.0, "stiffness with which the hand yields to the leaf, by a driver that "
                       "takes hand_compliance [N/m]; 0: the hand is stiff"),
    "recover_standing": (False, "whether a push on the standing robot makes it step; it then "
                         "reads the robot's messages all the time"),
    "door_distance": (math.nan, "surveyed distance of the closed leaf's face from where a hit "
                      "begins [m]; NaN: not surveyed, so that nobody passes the door, and walks "
                      "know it by /door_pose alone"),
    "hinge_x": (math.nan, "surveyed x of the hinge, seen from there, or NaN [m]"),
}


class MotionServer(GuardedNode):
    """Passes goals to a `Mission`, and its progress and results back."""

    def __init__(self) -> None:
        """Load robot and door, and connect to the driver's topics and to the planner."""
        super().__init__("motion_server")
        given = Parameters(self, PARAMETERS)
        stiffness = given.number("hand_stiffness")
        if stiffness and not STIFFNESSES[0] <= stiffness <= STIFFNESSES[1]:
            raise SettingError("hand_stiffness [N/m]", stiffness, f"0, or within {STIFFNESSES}")
        self._link = RosLink(
            self, self._after,
            lambda stamp, reference: self._mission.body.follows(stamp, reference),
            lambda why: self._mission.body.refused(why))
        felt = given.number("felt_force", unknown=True)
        self._mission = Mission(
            self._link.model, self._link,
            Pose(given.number("hinge_x", unknown=True),
                 -given.number("door_distance", unknown=True), 0.0),
            PassageSettings.of(self._link.model, hand_stiffness=stiffness or math.inf),
            ExecutionSettings.of(
                self._link.model, contact_deceleration=given.number("contact_deceleration"),
                **({} if math.isnan(felt) else {"felt_force": felt})),
            recover=given.switch("recover_standing"))
        self._reports = self.create_publisher(HitReport, "hit_report", 10)
        self._orders: dict[bytes, Order] = {}  # of the goals under way, by their identifiers
        self.create_service(Trigger, "stop", self._on_stop)
        self.create_service(PlanDoorPassage, PLAN_PASSAGE, self._on_request)
        self._servers = [
            self._serve(ExecuteDoorImpact, HIT, self._hit),
            self._serve(Walk, WALK, self._walk),
            self._serve(WalkThroughDoor, PASSAGE, self._pass)]
        self.create_timer(POLL_PERIOD, self._mission.poll, clock=Clock(
            clock_type=ClockType.STEADY_TIME))

    def destroy_node(self) -> None:
        """End the actions and the planning process with the node."""
        for server in self._servers:
            server.destroy()
        self._link.close()
        super().destroy_node()

    def _serve(self, kind: Any, name: str, carry_out: Callable[..., Any]) -> ActionServer:
        """Serve an action; every goal is accepted, because only a result can say why not."""
        def on_cancel(handle: Any) -> CancelResponse:
            order = self._orders.get(bytes(handle.goal_id.uuid))
            if order is not None:
                order.stop()
            return CancelResponse.ACCEPT

        async def execute(handle: Any) -> Any:
            identifier, tell = bytes(handle.goal_id.uuid), self._teller(kind, handle)
            order = self._orders[identifier] = Order(name, tell)
            if handle.is_cancel_requested:
                order.stop()
            try:
                result = await carry_out(handle, order)
            except Exception as error:  # whoever asked must get an answer
                self.get_logger().error(traceback.format_exc())
                result = kind.Result(
                    error_code=kind.Result.NOT_READY,
                    message=f"the motion server failed: {type(error).__name__}: {error}")
            finally:
                del self._orders[identifier]
            result.success = result.error_code == kind.Result.NONE
            result.message = self._link.sight.text(result.message)
            if result.success:
                handle.succeed()
                self.get_logger().info(result.message)
            elif handle.is_cancel_requested:
                handle.canceled()
                self.get_logger().info(result.message)
            else:
                handle.abort()
                self.get_logger().error(result.message)
            return result

        return ActionServer(
            self, kind, name, execute, cancel_callback=self.guarded(
                on_cancel, "the cancel", lambda _: CancelResponse.REJECT))

    def _teller(self, kind: Any, handle: Any) -> Callable[[Any], None]:
        """Return a function that publishes the progress of a goal, and logs each new phase."""
        last = ""

        def tell(progress: Any) -> None:
            nonlocal last
            fields = asdict(progress)
            if kind is Walk:
                fields["pose"] = walk_messages.stamped(
                    self._link.turned(progress.pose), self._stamp(), self._link.world)
            elif progress.phase != last:
                last = progress.phase
                self.get_logger().info(f"phase {last}")
            handle.publish_feedback(kind.Feedback(**fields))

        return tell

    # -- goals ----------------------------------------------------------------------------------

    async def _hit(self, handle: Any, order: Order) -> Any:
        goal = handle.request
        try:
            self._mission.require_free(order)
            plan = self._link.hit_plan(goal.plan_id)
            execution = await self._done(self._mission.hit(
                plan, order, probe=hit_messages.probe_of(goal.probe),
                speed_scale=goal.speed_scale, dry_run=goal.dry_run))
        except DoorImpactError as error:
            return hit_messages.Result(
                error_code=hit_messages.error_code(error), message=str(error))
        if execution is None:
            return hit_messages.Result(message="this was a dry run: the plan "
                                       f"{plan.plan_id} could be executed")
        self._report(plan, handle, execution)
        result = hit_messages.result_message(execution)
        if result.contact_sensor:
            self.get_logger().info(f"the contact was shown by: {result.contact_sensor}")
        return result

    async def _walk(self, handle: Any, order: Order) -> Any:
        steps = 0
        try:
            goal = walk_messages.goal_from(handle.request, self._link.hinge, self._link.world)
            if handle.request.dry_run:
                plan = await self._done(self._mission.plan_walk(goal, order))
                code, text = walk_messages.Result.NONE, (
                    f"this was a dry run: {len(plan.footsteps)} footsteps in "
                    f"{plan.duration:.1f} s could be made")
            else:
                walk = await self._done(self._mission.walk(goal, order))
                steps = walk.steps_made(self._link.now())
                code, text = hit_messages.code_of(walk_messages.Result, walk.outcome), (
                    walk.reason or f"the robot made {steps} steps and stands at the goal")
        except DoorImpactError as error:
            code, text = walk_messages.error_code(error), str(error)
            if code == walk_messages.Result.REPLACED:
                steps = int(error.value)  # type: ignore[call-overload]
        soles = self._mission.body.soles()
        place = Pose(math.nan, math.nan, math.nan) if soles is None else soles.middle
        return walk_messages.Result(
            error_code=code, message=text, steps=steps,
            pose=walk_messages.stamped(self._link.turned(place), self._stamp(), self._link.world))

    async def _pass(self, handle: Any, order: Order) -> Any:
        passed, code, text = Passed(), passage_messages.Result.NONE, ""
        try:
            wanted = passage_messages.wanted_from(handle.request)
            await self._done(self._mission.pass_door(wanted, order, passed))
            text = passed.message
            if passed.passage is not None and passed.passage.outcome is not Outcome.SUCCESS:
                MotionFailed.check(passed.passage)
        except DoorImpactError as error:
            code, text = passage_messages.codes(error)[0], str(error)
        result = passage_messages.result_message(passed, self._link.now())
        if passed.way is not None:
            result.plan = self._plan(passed.way, handle.request)
        result.error_code, result.message = code, text
        if passed.hit is not None and passed.way is not None and passed.way.hit is not None:
            self._report(passed.way.hit, handle, passed.hit)
        return result

    def _report(self, plan: HitPlan, handle: Any, hit: Execution) -> None:
        """Let the planner learn from a hit that has opened the door."""
        if hit.turned_round:
            self._reports.publish(hit_messages.hit_report(
                plan, handle.goal_id, hit.outcome, hit.measured, self._stamp()))

    # -- services -------------------------------------------------------------------------------

    async def _on_request(
        self, request: PlanDoorPassage.Request, response: PlanDoorPassage.Response
    ) -> PlanDoorPassage.Response:
        """Plan a passage from the leaf that the robot holds, otherwise a way through the door."""
        try:
            way = await self._done(self._mission.plan_passage(
                passage_messages.wanted_from(request), Order(PLAN_PASSAGE)))
        except DoorImpactError as error:
            response.error_code = passage_messages.codes(error)[1]
            response.message = self._link.sight.text(str(error))
            self.get_logger().warning(f"no passage was planned: {error}")
            return response
        except Exception as error:  # the service must answer, and the node must go on
            response.error_code = PlanDoorPassage.Response.NOT_READY
            response.message = f"the planner failed: {type(error).__name__}: {error}"
            self.get_logger().error(traceback.format_exc())
            return response
        plan, response.success, response.plan = way.passage, True, self._plan(way, request)
        response.message = (f"the robot is clear after {plan.clear:.1f} s and "
                            f"{len(plan.walk.footsteps)} footsteps; the planning took "
                            f"{plan.planning_time:.1f} s")
        return response

    def _on_stop(self, _: Any, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, self._mission.stop()
        return response

    # -- the mission ----------------------------------------------------------------------------

    def _after(self, now: float, commands: Any) -> None:
        self._mission.after(now, commands)

    async def _done(self, coroutine: Coroutine[Any, None, Any]) -> Any:
        """Let the mission run a coroutine, and return its result when it has ended."""
        ended = Future()

        async def ending() -> None:
            try:
                ended.set_result(await coroutine)
            except Exception as error:  # raised again below
                ended.set_exception(error)

        self._mission.run(ending())
        return await ended

    def _plan(self, way: Any, request: Any) -> Any:
        return self._link.sight.message(passage_messages.plan_message(
            way, self._link.next_number(), self._stamp(), self._link.world,
            trajectories=request.include_trajectories))

    def _stamp(self) -> Any:
        return self.get_clock().now().to_msg()


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(MotionServer, args=args)


if __name__ == "__main__":
    sys.exit(main())
