"""Whether a closed leaf is pushed open or hit, and why.

A light door is pushed: one that asks the hand for at most the 5 lbf (22 N) to which the ADA and
ICC A117.1 limit the opening force of interior doors. The planned force counts twice: it follows
from a closer that was identified mostly while it closed the door, and EN 1154 allows small closers
an efficiency of 50 % (recalled, not checked against the standard).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from door_model.door.door import Door
from humanoid_motion.robot_model import RobotModel

from walking.errors import PLANNING_ERRORS, InvalidGoal, PassageInfeasible
from walking.footsteps.footstep import Stance
from walking.passing.doorway import Doorway
from walking.passing.held import Hold
from walking.passing.passage import PassagePlan, plan_passage
from walking.passing.reach import Reach, plan_reach
from walking.passing.settings import PassageSettings

HIT, PUSH = "hit", "push"
LIGHT = 22.2
"""Largest force on the hand of a door that is light, 5 lbf [N]."""
STRONGEST = 100.0
"""Largest force on the hand of a door that is pushed because somebody wants it [N]."""
RESERVE = 2.0
"""Factor on the planned force before it is compared with these limits."""


@dataclass(frozen=True)
class Push:
    """A push of the closed leaf.

    Attributes:
        reach: The hand's motion to the leaf.
        hold: How that is planned to end.
        passage: The passage from there.
    """

    reach: Reach
    hold: Hold
    passage: PassagePlan


@dataclass(frozen=True)
class Opening:
    """How a door is opened.

    Attributes:
        way: `HIT` or `PUSH`.
        reason: Sentence that says why.
        push: The push; None for a hit.
    """

    way: str
    reason: str
    push: Push | None = None


def choose_opening(
    robot: RobotModel, door: Door, doorway: Doorway, stance: Stance, wanted: str = "",
    settings: PassageSettings | None = None,
) -> Opening:
    """Choose a push if the door is light and arm and balance allow it, otherwise a hit.

    Args:
        robot: The robot.
        door: Dynamics of the door, which is closed.
        doorway: Leaf and wall.
        stance: The soles of the robot, which stands in half-sitting.
        wanted: `HIT` or `PUSH`, to which `STRONGEST` applies; empty leaves it open.
        settings: Settings of the passage; None means the defaults.

    Raises:
        InvalidGoal: There is no such way to open a door.
        PLANNING_ERRORS: A push is wanted, and cannot be made.
    """
    if wanted not in ("", HIT, PUSH):
        raise InvalidGoal(quantity="opening", value=wanted, limit=f"{HIT}, {PUSH} or empty")
    if wanted == HIT:
        return Opening(HIT, "hit: it was asked for")
    try:
        return _pushed(robot, door, doorway, stance, STRONGEST if wanted else LIGHT,
                       settings or PassageSettings.of(robot))
    except PLANNING_ERRORS as error:
        if wanted:
            raise
        return Opening(HIT, f"hit: it is chosen over a push, because {error}")


def _pushed(
    robot: RobotModel, door: Door, doorway: Doorway, stance: Stance, limit: float,
    settings: PassageSettings,
) -> Opening:
    """Plan a push with a limit of the force [N]; errors are those of a push that cannot be made."""
    reach = plan_reach(robot, doorway, stance, settings)
    # The closer alone already tells most heavy doors, for which no passage need be planned.
    _require_light(float(door.restoring_torque(0.0)) / reach.radius, limit)
    hold = Hold(door, doorway, 0.0, stance, reach.walk.knots.position[-1])
    passage = plan_passage(robot, hold.task(), settings)
    force = float(np.linalg.norm(passage.hand_force, axis=1).max())
    _require_light(force, limit)
    margin = min(float(each.checks.margin.min()) for each in (reach.walk, passage.walk))
    torque = float(passage.walk.checks.torque_ratio[robot.arm_columns].max())
    return Opening(
        PUSH, f"push: the hand has to give at most {force:.0f} N, {RESERVE * force:.0f} N with the "
        f"reserve of {RESERVE:g}, {limit:.0f} N are allowed; the arm needs {100 * torque:.0f} % of "
        f"its torques, and the smallest ZMP margin is {1e3 * margin:.0f} mm",
        Push(reach, hold, passage))


def _require_light(force: float, limit: float) -> None:
    """Check a force of the hand against its limit [N].

    Raises:
        PassageInfeasible: It is too large.
    """
    if not RESERVE * force <= limit:
        raise PassageInfeasible(
            f"to push the leaf from closed the hand would have to give {force:.0f} N, "
            f"{RESERVE * force:.0f} N with the reserve of {RESERVE:g}, {limit:.0f} N are allowed",
            quantity="hand force [N]", value=RESERVE * force, limit=limit)
