"""Node door_passer: goes through the door, as the action /walk_through_door."""

from __future__ import annotations

import math
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import GuardedNode, run_node, until
from door_impact_common.parameters import Parameters
from door_impact_msgs.action import ExecuteDoorImpact, WalkThroughDoor
from door_impact_msgs.msg import HandCompliance
from door_impact_msgs.srv import PlanDoorPassage
from door_model.door.config import hinge_of
from humanoid_motion.driver_interface import Command
from humanoid_motion.tolerances import STILL
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.task import Future
from robot_driver.active_goals import ActiveGoals
from robot_driver.names import TRAJECTORY
from trajectory_msgs.msg import JointTrajectory
from walking.errors import HitNotPlanned, NoDoor, NotReady, PassageInfeasible, Stopped
from walking.footsteps.footstep import as_array
from walking.passing.approach import AS_SURVEYED
from walking.passing.held import Hold
from walking.passing.passage import PassagePlan
from walking.passing.passage_task import PassageTask
from walking.passing.settings import PassageSettings

from motion_execution.ros.clients import HitPlanner, MotionClient
from motion_execution.ros.openings import Openings, Way
from motion_execution.ros.passage_planner import PassagePlanner, never
from motion_execution.ros.passer_messages import (
    CAUGHT,
    codes,
    end_code,
    last_posture,
    require_angles,
    without_numbers,
)
from motion_execution.ros.walk_up import WALK, WalkUp
from motion_execution.ros.walking_robot import PATIENCE, WalkingRobot
from motion_execution.walk.passage import STANDS, Passage
from motion_execution.walk.reaching import Reaching
from motion_execution.walk.start import require_near
from motion_execution.walk.walk import Outcome

Result = WalkThroughDoor.Result

FEEDBACK_PERIOD = 0.05  # time between two messages of feedback, by the robot's clock [s]
REST = 0.3  # time at rest with the hand on the leaf before the passage is planned from there [s]
STIFFNESSES = (50.0, 2000.0)  # that HandCompliance allows [N/m]
EXECUTE = "/execute_door_impact"
PARAMETERS = {
    "door": ("", "name or YAML file of the door, for its frame, and for its closer while nothing "
             "is identified"),
    "hand_stiffness": (0.0, "stiffness with which the hand yields to the leaf, by a driver that "
                       "takes /hand_compliance [N/m]; 0: the hand is stiff"),
}


class DoorPasser(GuardedNode):
    """Has the door hit, passes messages to a `Passage`, and publishes its commands."""

    def __init__(self) -> None:
        """Load robot and door, and connect to the driver's topics and to the nodes of the hit."""
        super().__init__("door_passer")
        given = Parameters(self, PARAMETERS)
        stiffness = given.number("hand_stiffness")
        if stiffness and not STIFFNESSES[0] <= stiffness <= STIFFNESSES[1]:
            raise SettingError("hand_stiffness [N/m]", stiffness, f"0, or within {STIFFNESSES}")
        self._settings = PassageSettings(hand_stiffness=stiffness or math.inf)
        door = given.text("door")
        self._body = WalkingRobot(self, self._after, at_door=True, hinge=hinge_of(door))
        self._robot, self._driver = self._body.model, self._body.topics
        self._inputs = self._driver.inputs
        self._hits = MotionClient(self, ExecuteDoorImpact, EXECUTE, "impact_executor")
        self._walk_up = WalkUp(self, self._body)
        self._planner = PassagePlanner(
            self, self._robot, door, self._settings, HitPlanner(self), self._body.sight)
        self._openings = Openings(self._robot, self._planner, self._hits, self._walk_up.survey,
                                  self._moved, self._on_hit)
        self._others = [ActiveGoals(self, action) for action in (EXECUTE, WALK)]
        self._commanded: Array | None = None  # where the last trajectory ends, (J,) [rad]
        self._busy = False
        self._goal: Any = None  # goal handle under way
        self._phase = ""
        self._way: Way | None = None  # of the goal
        self._left: Way | None = None  # on which a passage has ended with the hand on the leaf
        self._passage: Passage | Reaching | None = None  # of the goal
        self._finished = Future()  # done when it has ended
        self._yields = False  # whether the right hand was told to yield
        self._last_feedback = -math.inf  # on the robot's clock [s]
        self._compliance = self.create_publisher(HandCompliance, "/hand_compliance", 10)
        self.create_subscription(JointTrajectory, TRAJECTORY, self._on_trajectory, 10)
        _create_service(self, PlanDoorPassage, "/plan_door_passage", self._on_request)
        self._server = ActionServer(
            self, WalkThroughDoor, "/walk_through_door", self._execute,
            goal_callback=self.guarded(self._on_goal, "the goal", lambda _: GoalResponse.REJECT),
            cancel_callback=self.guarded(
                self._on_cancel, "the cancel", lambda _: CancelResponse.REJECT))

    def destroy_node(self) -> None:
        """End the action and the planning thread with the node."""
        self._server.destroy()
        self._planner.close()
        super().destroy_node()

    # -- topics ---------------------------------------------------------------------------------

    def _on_trajectory(self, message: JointTrajectory) -> None:
        self._commanded = last_posture(self._body.sight.message(message), self._robot.joint_names)

    def _after(self, now: float, commands: Sequence[Command]) -> None:
        """Send commands and feedback, and notice the end of the passage."""
        for command in commands:
            self._body.send(command)
        passage = self._passage
        if passage is None or self._finished.done():
            return
        if commands:
            passage.prepare_next()
        self._yield_hand(passage.yields_at(now))
        if not passage.running:
            self._finished.set_result(None)
        elif now >= self._last_feedback + FEEDBACK_PERIOD:
            self._last_feedback = now
            self._tell(passage.stage(now))

    def _yield_hand(self, yields: bool) -> None:
        """Let the right hand yield to the leaf, or make it stiff again, where that changes."""
        hand = self._settings
        if yields == self._yields or not hand.yields:
            return
        self._yields = yields
        message = HandCompliance(side="right")  # stiff
        if yields:
            message.stiffness, message.damping, message.mass = hand.impedance
        message.header.stamp = self.get_clock().now().to_msg()
        self._compliance.publish(self._body.sight.message(message))

    # -- feedback -------------------------------------------------------------------------------

    def _on_walk(self, feedback: Any) -> None:
        self._tell("approach", margin=feedback.zmp_margin)

    def _on_hit(self, feedback: Any) -> None:
        # The executor takes the robot for being at the origin of odom.
        known = self._way is not None and self._way.site == AS_SURVEYED
        self._tell("catch" if feedback.phase in CAUGHT else "hit", feedback.phase,
                   feedback.zmp_margin if known else math.nan)

    def _tell(self, phase: str, hit_phase: str = "", margin: float = math.nan) -> None:
        """Publish feedback.

        Args:
            phase: Phase of the goal.
            hit_phase: Phase of the hit, while it is executed.
            margin: ZMP margin by another node that moves the robot [m].
        """
        if self._goal is None:
            return
        if phase != self._phase:
            self._phase = phase
            self.get_logger().info(f"phase {phase}")
        inputs, passage, way, soles = (
            self._inputs, self._passage, self._way, self._body.soles())
        feedback = WalkThroughDoor.Feedback(
            phase=phase, hit_phase=hit_phase, leaf_angle=inputs.door_angle,
            hand_force=inputs.hand_force, zmp_margin=margin, clearance=math.nan)
        if passage is not None and soles is not None and way is not None:
            now, body, hold = self._driver.now(), self._settings.body, way.hold
            place = as_array(soles.middle.seen_from(hold.axes))[None]
            feedback.step = min(passage.steps, passage.steps_made(now) + 1)
            feedback.steps = passage.steps
            feedback.zmp_margin = self._body.margin(soles, passage, now)
            feedback.clearance = float(min(
                hold.doorway.wall_gaps(body, place)[0],
                hold.doorway.leaf_gaps(body, place, np.array([inputs.door_angle]))[0]))
        self._goal.publish_feedback(feedback)

    # -- plans ----------------------------------------------------------------------------------

    async def _on_request(
        self, request: PlanDoorPassage.Request, response: PlanDoorPassage.Response
    ) -> PlanDoorPassage.Response:
        """Plan a passage from the leaf that the robot holds, otherwise a way through the door."""
        try:
            if self._busy:
                raise NotReady("another passage is planned or under way")
            self._busy = True
            self._driver.start()
            try:
                require_angles(request)
                await until(self, lambda: self._body.heard, PATIENCE)
                way = await self._held(request) or await self._openings.plan(
                    request, self._walk_up.site())
            finally:
                self._driver.stop()
                self._busy = False
        except DoorImpactError as error:
            (_, response.error_code), text = codes(error), str(error)
            response.message = self._body.sight.text(text)
            self.get_logger().warning(f"no passage was planned: {error}")
            return response
        except Exception as error:  # the service must answer, and the node must go on
            response.error_code = PlanDoorPassage.Response.NOT_READY
            response.message = f"the planner failed: {type(error).__name__}: {error}"
            self.get_logger().error(traceback.format_exc())
            return response
        plan, response.success, response.plan = way.passage, True, self._message(way)
        response.message = (f"the robot is clear after {plan.clear:.1f} s and "
                            f"{len(plan.walk.footsteps)} footsteps; the planning took "
                            f"{plan.planning_time:.1f} s")
        return response

    async def _held(self, wanted: Any, stopped: Callable[[], bool] = never) -> Way | None:
        """Plan the way from the leaf that the robot holds; None: it holds none.

        It holds the leaf after a hit, or after a passage that was stopped on the way.
        """
        if wanted.hit_angle >= 0.0 or wanted.opening:
            return None
        left, last = self._left, self._planner.last_hit
        held: list[tuple[str, Hold, PassagePlan | None]] = [] if left is None else [
            (left.door, left.hold, left.passage)]
        if last is not None:
            with suppress(HitNotPlanned, NoDoor):
                held.append((last.door, self._planner.hold(last), None))
        for door, hold, before in held:
            with suppress(NotReady):
                task = self._found(hold)
                return Way(door, hold, await self._planner.passage(
                    task, wanted.leaf_angle, before, stopped))
        return None

    def _message(self, way: Way) -> Any:
        return self._planner.message(way.passage, way.hold, way.door, way.opening)

    def _found(self, hold: Hold) -> PassageTask:
        """Return the passage from where the robot has its hand on the leaf, as it is measured.

        Raises:
            NotReady: Messages are missing or old, the robot moves, or it does not hold the leaf.
        """
        standing, soles, recent = self._body.standing(), self._body.soles(), self._inputs.recent
        assert soles is not None
        fastest = float(np.abs(standing.velocity).max())
        if not fastest <= STILL:
            raise NotReady(f"a joint turns at {fastest:.2f} rad/s; a passage begins at rest, with "
                           f"at most {STILL:g} rad/s", quantity="speed [rad/s]", value=fastest,
                           limit=STILL)
        return hold.found(standing.position, soles, self._inputs.door_angle, self._commanded,
                          recent[-1].imu.orientation if recent else None)

    # -- action ---------------------------------------------------------------------------------

    def _on_goal(self, _: Any) -> GoalResponse:
        if self._busy:
            self.get_logger().warning("the goal was rejected: another passage is under way")
            return GoalResponse.REJECT
        self._busy = True
        return GoalResponse.ACCEPT

    def _on_cancel(self, _: Any) -> CancelResponse:
        if self._passage is not None:
            self._passage.stop("the passage was stopped, as requested; the robot stands, and its "
                               "hand stays where it is")
        for motion in (self._walk_up, self._hits):
            motion.cancel()
        return CancelResponse.ACCEPT

    async def _execute(self, goal_handle: Any) -> Any:
        result = without_numbers()
        self._goal, self._phase = goal_handle, ""
        self._driver.start()
        try:
            await self._through(
                goal_handle.request, result, lambda: bool(goal_handle.is_cancel_requested))
        except DoorImpactError as error:
            (result.error_code, _), result.message = codes(error), str(error)
        finally:
            self._driver.stop()
            self._inputs.motion = self._passage = self._goal = self._way = None
            self._yield_hand(False)
            self._busy = False
        result.success = result.error_code == Result.NONE
        result.message = self._body.sight.text(result.message)
        if result.success:
            goal_handle.succeed()
            self.get_logger().info(result.message)
        else:
            (goal_handle.canceled if goal_handle.is_cancel_requested else goal_handle.abort)()
            self.get_logger().error(result.message)
        return result

    async def _through(self, goal: Any, result: Any, stopped: Callable[[], bool]) -> None:
        """Do what a goal asks for, and fill in its result.

        Raises:
            DoorImpactError: It cannot be done, or was cancelled between two motions.
        """
        require_angles(goal)
        self._require_free()
        await until(self, lambda: self._body.heard or stopped(), PATIENCE)
        self._body.standing()  # refuses missing messages before anything is planned
        if self._settings.yields:
            takers = self._compliance.get_subscription_count
            await until(self, lambda: takers() > 0 or stopped(), PATIENCE)
            if not takers():
                raise NotReady(
                    "no driver takes /hand_compliance, and a stiff hand would press on the leaf as "
                    "far as it should yield: set hand_stiffness to 0", quantity="/hand_compliance")
        self._tell("plan")
        began, way = self._driver.now(), await self._held(goal, stopped)
        if way is None:
            way = await self._open(goal, result, stopped)
        else:
            result.plan = self._message(way)
        if way is None:
            return
        if goal.dry_run:
            first = f"{way.opening.way} and " if way.opening.way else ""
            result.message = (
                f"this was a dry run: {first}passage could be made, in {way.passage.clear:.1f} s "
                f"and {len(way.passage.walk.footsteps)} footsteps")
            return
        self._way, passage = way, Passage(self._robot, way.passage, yields=self._settings.yields)
        await self._moved(way, passage, stopped)
        ends = (Outcome.STOPPED, Outcome.LEAF_LOST)
        if passage.outcome in ends and math.isnan(passage.release_angle):
            assert self._commanded is not None  # by the passage
            self._left = replace(
                way, hold=replace(way.hold, stance=passage.stance, joints=self._commanded))
        self._ended(result, passage, began)

    async def _open(self, goal: Any, result: Any, stopped: Callable[[], bool]) -> Way | None:
        """Open the door, and return the way from there; None: the result says why there is none.

        Raises:
            DoorImpactError: It cannot be done, or was cancelled between two motions.
        """
        planned = self._walk_up.site()
        self._walk_up.require_reachable(planned, goal.walk_up)
        way = await self._openings.plan(goal, planned, stopped)
        site = await self._walk_up.arrive(
            planned, way.ahead, goal, self._goal.goal_id, stopped, self._on_walk)
        if site != planned:
            self._tell("plan")
            way = await self._openings.plan(goal, site, stopped)
        self.get_logger().info(self._body.sight.text(way.opening.reason))
        self._way, result.plan = way, self._message(way)
        if not await self._openings.make(way, goal, self._goal.goal_id, result, stopped):
            return None
        if goal.dry_run:
            return way
        self._tell("plan")
        rested = self._driver.now() + REST
        await until(self, lambda: self._driver.now() >= rested, 10.0 * REST)
        try:
            plan = await self._planner.passage(
                self._found(way.hold), goal.leaf_angle, way.passage, stopped)
        except PassageInfeasible as error:
            raise PassageInfeasible(
                f"{error}; the robot stands and holds the leaf", quantity=error.quantity,
                value=error.value, limit=error.limit) from error
        way = replace(way, passage=plan)
        result.plan = self._message(way)
        return way

    def _require_free(self) -> None:
        """Check that no other node moves the robot.

        Raises:
            NotReady: A hit or a walk is under way.
        """
        for other in self._others:
            if other.running:
                raise NotReady(f"a goal of {other.action} is being executed: a passage begins when "
                               "it has ended", quantity="action", value=other.action)

    async def _moved(
        self, way: Way, motion: Passage | Reaching, stopped: Callable[[], bool]
    ) -> None:
        """Make a motion on a way through the door, and return when it has ended.

        Raises:
            DoorImpactError: It cannot begin.
        """
        # The messages that came in during the planning are handled first.
        await until(self, lambda: self._inputs.lag == 0.0 and not self._others[0].running, PATIENCE)
        self._require_free()
        require_near(self._robot, motion.plan.knots.position[0], self._body.standing().position)
        if stopped():
            raise Stopped(f"the passage was stopped before its first step; {STANDS}")
        self._finished, self._last_feedback = Future(), -math.inf
        self._inputs.intake.begin()
        self._inputs.motion = self._passage = motion
        self._body.show(way.hold.in_odom(motion.plan.footsteps))
        self._body.send(motion.start(self._driver.now() + self._inputs.lag))
        motion.prepare_next()
        await self._finished
        self._body.show(())  # the walker shows its footsteps there, too
        for what, value in self._inputs.intake.noticed().items():
            self.get_logger().warning(
                f"noticed in the passage: {self._body.sight.text(what)}: {value}")

    def _ended(self, result: Any, passage: Passage, began: float) -> None:
        """Fill in the result of a passage that has ended.

        Args:
            began: Time of the robot's clock at which the first motion began [s].
        """
        now, watch = self._driver.now(), passage.watch
        cleared = passage.cleared(now)
        result.error_code, result.steps = end_code(passage), passage.steps_made(now)
        result.start_time = now - passage.since(now)
        result.time_to_clear, result.hit_to_clear = cleared - began, cleared - result.contact_time
        result.release_angle = passage.release_angle
        result.largest_hand_force = watch.largest_force
        result.largest_leaf_error = watch.largest_error
        since = (f"{result.time_to_clear:.1f} s after its first motion" if
                 math.isnan(result.contact_time) else f"{result.hit_to_clear:.1f} s after the hit")
        result.message = passage.reason or (
            f"the robot has passed the door in {result.steps} steps, clear of it {since} by the "
            "odometry")


def _create_service(node: Any, kind: Any, name: str, answer: Callable[..., Any]) -> None:
    """Create a service that is answered by a coroutine, which EventsExecutor does not do itself.

    Meanwhile the node handles messages.
    """
    service = node.create_service(
        kind, name, lambda *asked: node.executor.create_task(answer, *asked))
    send = service.send_response
    service.send_response = lambda task, header: task.add_done_callback(
        lambda done: send(done.result(), header))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(DoorPasser, args=args)


if __name__ == "__main__":
    sys.exit(main())
