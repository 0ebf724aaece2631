"""How long each step of a passage lasts: as short as joints and soles allow.

The first steps out of the wide stance after a hit ask much of a knee, and while a hand presses on
the leaf, turning steps ask much of the soles' friction. Only the steps that ask too much are made
longer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.knots import Knots
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.whole_body import shares

from walking.footsteps.footstep import Footstep
from walking.pattern.plan import plan_walk
from walking.pattern.settings import WalkSettings
from walking.pattern.state import WalkState
from walking.pattern.timing import Schedule, schedule
from walking.pattern.walk_plan import WalkPlan

UNLIMITED = 1e3
"""Share of a limit, or coefficient of friction, that no motion uses."""
_ROUNDS = 4  # largest number of walks that are tried
_RESERVE = 0.96  # share of each limit that is used, because the arm moves as well in the end
_NEARLY = 0.005  # lack of friction that somewhat longer steps make up for
_OVER = 1.02  # by how much longer a step becomes than it must, so that few rounds are enough


def timed(
    robot: RobotModel, state: WalkState, footsteps: Sequence[Footstep], settings: WalkSettings,
    durations: tuple[float, float], force: Callable[[Schedule], Callable[[Array], Array]],
    upper: Knots | None = None,
) -> tuple[list[Footstep], WalkPlan]:
    """Choose how long each step lasts: as short as joints and soles allow.

    Args:
        robot: The robot.
        state: State in which the walk begins.
        footsteps: The footsteps, with durations to begin the search with.
        settings: Settings of the walk, with its limits.
        durations: Shortest and longest duration of a step [s]; a step that asks for more is left
            at the longest one.
        force: Function that returns the force on the hand, as of `plan_walk`, during a schedule.
        upper: Course of the upper body, as of `plan_walk`.

    Returns:
        The footsteps with their durations, and the walk, of which speeds and friction were not
        checked.

    Raises:
        WalkInfeasible: The ZMP comes too near to the edge of the soles.
        HumanoidMotionError: A leg does not reach, or a joint leaves its range.
    """
    loose = replace(settings, speed_share=UNLIMITED, torque_share=UNLIMITED, friction=UNLIMITED)
    steps = list(footsteps)
    least = 0.0 if upper is None else 1.0  # the upper body's course shall end before the walk
    for left in reversed(range(_ROUNDS)):
        times = schedule(state.stance, steps, settings, at_rest=state.at_rest)
        walk = plan_walk(robot, state, steps, loose, upper=upper, hand_force=force(times),
                         clearance=False)
        asked = demands(robot, walk, settings).clip(least, None)
        least = 1.0
        asked = np.where(asked > 1.0, _OVER * asked, asked)
        longer = [replace(step, duration=float(np.clip(step.duration * share, *durations)))
                  for step, share in zip(steps, asked.tolist(), strict=True)]
        if not left or longer == steps:
            break
        steps = longer
    return steps, walk


def demands(robot: RobotModel, walk: WalkPlan, settings: WalkSettings) -> Array:
    """Compute how much longer each step must last for joints and soles, (K,).

    Speeds go with 1 / T of the duration, and the forces that the soles' friction bears with
    1 / T^2.

    Args:
        robot: The robot.
        walk: A walk over K footsteps.
        settings: Settings, for the limits.
    """
    speed = shares(walk.motion.joint_speed[:, _legs(robot)], robot.speed_limit[_legs(robot)])
    share = np.maximum(speed.max(axis=1) / (_RESERVE * settings.speed_share),
                       np.sqrt(walk.checks.friction / (_RESERVE * settings.friction)))
    return np.array([share[_rows(walk, step)].max() for step in range(len(walk.footsteps))])


def nearly_holds(walk: WalkPlan, friction: float, durations: tuple[float, float]) -> bool:
    """Return whether a walk needs slightly more friction than it may, in steps not yet longest.

    Args:
        walk: The walk.
        friction: Coefficient of friction that may be used.
        durations: As of `timed`.
    """
    slips = [step.duration for number, step in enumerate(walk.footsteps)
             if (walk.checks.friction[_rows(walk, number)] > friction).any()]
    return (bool(slips) and max(slips) < durations[1]
            and float(walk.checks.friction.max()) <= friction + _NEARLY)


def _rows(walk: WalkPlan, step: int) -> slice:
    phases = [phase for phase in walk.schedule.phases
              if phase.step == step and phase.kind in ("double", "single")]
    return slice(phases[0].first, phases[-1].last + 1)


def _legs(robot: RobotModel) -> list[int]:
    return [column for columns in robot.leg_columns.values() for column in columns]
