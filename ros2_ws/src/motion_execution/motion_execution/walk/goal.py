"""Goals of walks, and the plans for them."""

from __future__ import annotations

from dataclasses import dataclass

from hrp2_description.robot import SIDES
from humanoid_motion.errors import PostureUnreachable
from humanoid_motion.robot_model import RobotModel
from walking.errors import WalkInfeasible
from walking.footsteps.footstep import Footstep, Pose
from walking.footsteps.planner import plan_footsteps
from walking.passing.surroundings import Surroundings
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.walk_plan import WalkPlan


@dataclass(frozen=True)
class WalkGoal:
    """Where to walk.

    Attributes:
        pose: Pose of the middle between the soles in odom; not used if there are footsteps.
        footsteps: The footsteps; empty if they are to be planned.
        keep_heading: Whether the robot does not turn along the way.
        step_duration: Duration of each planned footstep [s].
        whole_turns: Whether a heading of more than half a turn from the present one means that the
            robot turns so far.
    """

    pose: Pose
    footsteps: tuple[Footstep, ...] = ()
    keep_heading: bool = False
    step_duration: float = 0.8
    whole_turns: bool = False


def plan_goal(
    robot: RobotModel, state: WalkState, goal: WalkGoal, settings: WalkSettings, last: str = "",
    around: Surroundings | None = None,
) -> WalkPlan:
    """Plan the walk to a goal.

    Args:
        state: State in which it begins.
        last: Foot that lands where the walk begins; empty for a walk from rest.
        around: The door; None: nothing is known of one.

    Raises:
        InvalidFootsteps: Goal or footsteps are bad.
        WalkInfeasible: Something is in the way, ZMP or friction would not be as required, or a leg
            does not reach.
        HumanoidMotionError: A joint exceeds a limit, or bodies come too near to each other.
    """
    footsteps = list(goal.footsteps) or plan_footsteps(
        robot.config, state.stance, goal.pose, goal.step_duration,
        first=SIDES[1 - SIDES.index(last)] if last else None, keep_heading=goal.keep_heading,
        whole_turns=goal.whole_turns, room=around)
    if around is not None:
        around.require_free(robot.config, state.stance, footsteps)
    try:
        return plan_walk(robot, state, footsteps, settings)
    except PostureUnreachable as error:  # as after a hit that was stopped in its step
        raise WalkInfeasible(
            "the robot does not stand so that it can walk: bring it back to its initial posture "
            f"(in the simulation: sim/reset); {error}", quantity=error.quantity,
            value=error.value, limit=error.limit) from error
