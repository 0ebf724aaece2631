"""Node walker: walks to a pose or over footsteps, as the action /walk."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_impact_common.node import GuardedNode, run_node, until
from door_impact_common.parameters import Parameters
from door_impact_msgs.action import Walk as WalkAction
from humanoid_motion.driver_interface import Command
from rclpy.action import ActionServer, CancelResponse
from rclpy.task import Future
from robot_driver.active_goals import ActiveGoals
from robot_driver.names import TRAJECTORY
from trajectory_msgs.msg import JointTrajectory
from walking.errors import NotReady
from walking.footsteps.footstep import Pose
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.walk_plan import WalkPlan

from motion_execution.ros.background import Background
from motion_execution.ros.messages import CODES, error_code, goal_from, stamped
from motion_execution.ros.walking_robot import PATIENCE, WalkingRobot
from motion_execution.walk.goal import WalkGoal, plan_goal
from motion_execution.walk.guard import Guard
from motion_execution.walk.start import require_near, start_state
from motion_execution.walk.walk import Outcome, Walk

Result = WalkAction.Result

FEEDBACK_PERIOD = 0.05  # time between two messages of feedback, by the robot's clock [s]
HIT, PASSAGE = "/execute_door_impact", "/walk_through_door"
GUARD = {"recover_standing": (False, "whether a push on the standing robot makes it step; it then "
                              "reads the robot's messages all the time")}


class Replaced(NotReady):
    """A newer goal took the place of this one."""

    reason = "replaced"


class Walker(GuardedNode):
    """Passes messages to a `Walk`, and publishes its commands as trajectories."""

    def __init__(self) -> None:
        """Load the robot and connect to the driver's topics."""
        super().__init__("walker")
        self._body = WalkingRobot(self, self._after)
        self._robot, self._driver = self._body.model, self._body.topics
        self._settings = WalkSettings()
        self._inputs = self._driver.inputs
        self._walk: Walk | None = None  # the walk that was begun last
        self._background = Background(self, self._robot.config)
        self._others = [ActiveGoals(self, action) for action in (HIT, PASSAGE)]
        guards = Parameters(self, GUARD).switch("recover_standing")
        self._guard = self._inputs.motion = Guard(
            self._robot, lambda: guards and not self._moved_by_others(), self._present_state)
        self._handled = int(guards)  # number of goals that are not answered yet, and of the guard
        self._newest = 0  # number of the goal that was accepted last
        self._wanted = WalkGoal(Pose(0.0, 0.0, 0.0))  # of the walk under way
        self._goal: Any = None  # goal handle whose walk is under way
        self._finished: Future | None = None  # gets the walk's outcome, or None if it is replaced
        self._postures: list[np.ndarray] = []  # of the upper body after the last walk
        self._last_feedback = -math.inf  # on the robot's clock [s]
        self._body.show(())
        self._server = ActionServer(
            self, WalkAction, "/walk", self._execute,
            cancel_callback=self.guarded(
                self._on_cancel, "the cancel", lambda _: CancelResponse.REJECT))
        if guards:
            self.create_subscription(
                JointTrajectory, TRAJECTORY, self._on_trajectory, 10, raw=True)
            self._driver.start()

    def destroy_node(self) -> None:
        """End the planning thread with the node."""
        self._background.close()
        super().destroy_node()

    # -- driver ---------------------------------------------------------------------------------

    def _after(self, now: float, commands: Sequence[Command]) -> None:
        """Send commands and feedback, and end the action if the walk has ended."""
        for command in commands:
            self._body.send(command)
        walk = self._walk
        if commands and self._guard.steps:
            self.get_logger().warning("a push on the standing robot makes it step",
                                      throttle_duration_sec=1.0)
            self._body.show(self._guard.steps)
        if walk is None or self._finished is None:
            return
        if commands:
            walk.prepare_next()
        if walk.outcome is not Outcome.RUNNING:
            self._end(walk.outcome)
        elif now >= self._last_feedback + FEEDBACK_PERIOD:
            self._last_feedback = now
            self._send_feedback(walk, now)

    def _on_trajectory(self, _: bytes) -> None:
        """Watch the standing robot anew: a trajectory, perhaps of another node, moves it."""
        if not self._guard.steps:
            self._guard.forget()

    def _end(self, outcome: Outcome | None) -> None:
        """Hand the outcome to the goal whose walk was under way; None says that it is replaced."""
        finished, self._finished = self._finished, None
        if finished is not None and not finished.done():
            finished.set_result(outcome)

    def _send_feedback(self, walk: Walk, now: float) -> None:
        soles = self._body.soles()
        if soles is None or self._goal is None:
            return
        feedback = WalkAction.Feedback(
            step=min(walk.steps_sent, walk.steps_made(now) + 1), steps=walk.steps,
            pose=stamped(soles.middle, self.get_clock().now().to_msg()),
            zmp_margin=self._body.margin(soles, walk, now))
        self._goal.publish_feedback(feedback)

    # -- action ---------------------------------------------------------------------------------

    def _on_cancel(self, goal_handle: Any) -> CancelResponse:
        walk = self._walk
        if walk is not None and goal_handle is self._goal:
            walk.stop("the walk was stopped, as requested; the robot stands on two feet")
        return CancelResponse.ACCEPT

    async def _execute(self, goal_handle: Any) -> Any:
        if not self._handled:
            self._driver.start()
        self._handled += 1
        try:
            return await self._handle(goal_handle)
        finally:
            self._handled -= 1
            if not self._handled:
                self._driver.stop()

    async def _handle(self, goal_handle: Any) -> Any:
        goal = goal_handle.request
        if not goal.dry_run:
            self._newest += 1
        number = self._newest
        try:
            begun = await self._begun(goal_handle, number)
        except DoorImpactError as error:
            (goal_handle.canceled if goal_handle.is_cancel_requested else goal_handle.abort)()
            self.get_logger().error(str(error))
            code = Result.REPLACED if isinstance(error, Replaced) else error_code(error)
            return self._result(code, str(error))
        if isinstance(begun, str):
            goal_handle.succeed()
            return self._result(Result.NONE, begun)
        outcome = await begun
        return self._ended(goal_handle, outcome)

    async def _begun(self, goal_handle: Any, number: int) -> Future | str:
        """Begin the walk of a goal, or put its footsteps in the place of those under way.

        Returns:
            Future of the walk's outcome; what a dry run found.

        Raises:
            DoorImpactError: The walk cannot be made.
        """
        goal, dry = goal_from(goal_handle.request), goal_handle.request.dry_run
        mine = goal_handle.goal_id
        other = self._moved_by_others(mine)
        if other:
            raise NotReady(f"a goal of {other} is being executed: the robot walks when it has "
                           "ended", quantity="action", value=other)
        # After a reset, or when the first goal has just subscribed.
        await until(self, lambda: self._body.heard, PATIENCE)
        await until(self, lambda: not self._guard.steps)
        while not dry and (walk := self._walking()) is not None:
            if await self._replaced(goal_handle, number, goal, walk):
                return self._owned(goal_handle)
        state = self._present_state()
        plan: WalkPlan = await self._background.run(plan_goal, state, goal, self._settings)
        # The messages that came in during the planning are handled first.
        await until(self, lambda: self._inputs.lag == 0.0, PATIENCE)
        joints = self._inputs.joints
        if joints is None:
            raise NotReady("the robot's clock went back while the walk was planned")
        require_near(self._robot, plan.knots.position[0], joints[1])
        if dry:
            return (f"this was a dry run: {len(plan.footsteps)} footsteps in "
                    f"{plan.duration:.1f} s could be made")
        self._require_wanted(goal_handle, number)
        if self._moved_by_others(mine) or self._walking() is not None or self._guard.steps:
            raise NotReady("another motion began while the walk was planned")
        walk = Walk(self._robot, plan, self._settings, onward=self._onward)
        self._inputs.intake.begin()
        self._inputs.motion, self._walk, self._wanted = walk, walk, goal
        self._body.show(plan.footsteps)
        self._body.send(walk.start(self._driver.now() + self._inputs.lag))
        walk.prepare_next()
        return self._owned(goal_handle)

    def _onward(self) -> WalkPlan:
        """Plan how a walk goes on from where a push and the steps against it have left the robot.

        Raises:
            DoorImpactError: The robot does not stand, or the goal cannot be reached from here.
        """
        if self._wanted.footsteps:
            raise NotReady("a push has changed the steps, so that the goal's footsteps do not fit "
                           "any more")
        plan = plan_goal(self._robot, self._present_state(), self._wanted, self._settings)
        self._body.show(plan.footsteps)
        return plan

    def _walking(self) -> Walk | None:
        walk = self._walk
        return walk if walk is not None and walk.running else None

    def _owned(self, goal_handle: Any) -> Future:
        """Make a goal the owner of the walk under way; the one before ends as replaced."""
        self._end(None)
        self._goal, self._finished, self._last_feedback = goal_handle, Future(), -math.inf
        return self._finished

    async def _replaced(
        self, goal_handle: Any, number: int, goal: WalkGoal, walk: Walk
    ) -> bool:
        """Plan new footsteps from a boundary of the walk under way, and put them in their place.

        Returns:
            Whether the walk goes on with them; if not, it has ended meanwhile.

        Raises:
            DoorImpactError: They cannot be made; the walk under way goes on with its own.
        """
        step, state = walk.hold_for_new_footsteps(self._driver.now())
        before = walk.plan.footsteps[step - 1].side if step else ""
        try:
            plan = await self._background.run(plan_goal, state, goal, self._settings, before)
            self._require_wanted(goal_handle, number)
            if walk.replace(step, plan, self._driver.now()):
                self._wanted = goal
                self._body.show(plan.footsteps)
                return True
            # Too late: the robot comes to rest at the boundary, and walks on from there.
            await until(
                self, lambda: walk.outcome is not Outcome.RUNNING
                or walk.resting(self._driver.now()))
            if walk.outcome is not Outcome.RUNNING:
                return False
            # As planned, or as found if the robot was pushed.
            state = self._present_state() if walk.recovered else walk.final
            plan = await self._background.run(plan_goal, state, goal, self._settings)
            self._require_wanted(goal_handle, number)
            if walk.outcome is not Outcome.RUNNING:
                return False
            self._wanted = goal
            self._body.send(walk.resume(plan, self._driver.now()))
            self._body.show(plan.footsteps)
            return True
        except DoorImpactError:
            if number == self._newest:  # otherwise the newest goal holds the walk
                walk.go_on()
            raise

    def _require_wanted(self, goal_handle: Any, number: int) -> None:
        """Check that a goal was neither cancelled nor replaced while it was planned."""
        if goal_handle.is_cancel_requested:
            raise NotReady("the goal was cancelled before its first step")
        if number != self._newest:
            raise Replaced("a newer goal took the place of this one before its first step")

    def _present_state(self) -> WalkState:
        """Return the state in which a walk from the present posture begins.

        Raises:
            NotReady: Messages are missing or old, or the robot does not stand still.
        """
        return start_state(
            self._robot, self._body.standing(), self._settings, self._postures)

    def _moved_by_others(self, goal_id: Any = None) -> str:
        """Name of another node's action that is moving the robot; empty if there is none.

        One that has the walker do a part of its work does not count; a passage walks up to the
        door by a goal with its own identifier.
        """
        return next((each.action for each in self._others if each.running
                     and not (goal_id and each.asked_for(goal_id))), "")

    # -- results --------------------------------------------------------------------------------

    def _ended(self, goal_handle: Any, outcome: Outcome | None) -> Any:
        walk = self._walk
        assert walk is not None
        steps = walk.steps_made(self._driver.now())
        if outcome is None:
            goal_handle.abort()
            return self._result(Result.REPLACED, "a newer goal took the place of this one", steps)
        self._inputs.motion, self._walk, self._goal = self._guard, None, None
        self._postures = [walk.final.upper.value]
        text = walk.reason or f"the robot made {steps} steps and stands at the goal"
        result = self._result(CODES[outcome], text, steps)
        if outcome is Outcome.SUCCESS:
            goal_handle.succeed()
        elif goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.abort()
        self.get_logger().info(text)
        for what, value in self._inputs.intake.noticed().items():
            self.get_logger().warning(f"noticed in the walk: {what}: {value}")
        return result

    def _result(self, code: int, message: str, steps: int = 0) -> Any:
        soles = self._body.soles()
        place = soles.middle if soles is not None else Pose(math.nan, math.nan, math.nan)
        return Result(success=code == Result.NONE, error_code=code, message=message, steps=steps,
                      pose=stamped(place, self.get_clock().now().to_msg()))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is stopped, and return its exit code."""
    return run_node(Walker, args=args)


if __name__ == "__main__":
    sys.exit(main())
