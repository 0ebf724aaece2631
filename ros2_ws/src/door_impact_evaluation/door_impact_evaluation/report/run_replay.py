"""Makes the replay of a run from the simulation's own log: a demonstration, a rehearsal, a walk."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from door_impact_bringup import door_scene
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import Curve, Event, Limit, Plot, Replay
from door_impact_view.scene import colors
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig

from door_impact_evaluation.report.recorded_run import (
    Body,
    RecordedRun,
    Series,
    events_of,
    padded,
    phases_of,
)
from door_impact_evaluation.report.replay import replay_of
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.record import DemoRecord, Motion, Support
from door_impact_evaluation.run.simulation_log import SimulationLog
from door_impact_evaluation.run.walk_run import Walked

_SOURCE = "simulated"


def replay_of_run(record: DemoRecord, log: SimulationLog, plan: Any, robot: RobotConfig,
                  door: DoorConfig) -> Replay:
    """Make the replay of a demonstration.

    Args:
        record: What was measured of the motion.
        log: The simulation's log.
        plan: Message ImpactPlan with the plan that was executed.
        robot: The robot, for its URDF.
        door: The door, for its leaf.
    """
    return replay_of(run_of_log(
        log, record.support, robot, record.phases,
        events_of(record.contact_time, record.peak_time), plan=plan, door=door))


def replay_of_walk(walked: Walked, robot: RobotConfig) -> Replay:
    """Make the replay of a walk without nodes, with its pushes as events.

    Args:
        walked: The walk.
        robot: The robot, for its URDF.
    """
    pushes = [Event("push", walked.begin + push.at_s) for push in walked.pushes]
    return replay_of(run_of_log(walked.log, walked.support, robot, walked.phases(), pushes))


def run_of_log(
    log: SimulationLog, support: Support, robot: RobotConfig,
    phases: Mapping[str, tuple[float, float]], events: Sequence[Event] = (), *, plan: Any = None,
    door: DoorConfig | None = None,
) -> RecordedRun:
    """Describe a run by the simulation's log, from the first phase to the end of the last one.

    Args:
        log: The simulation's log.
        support: ZMP and support polygon at the log's times.
        robot: The robot, for its URDF.
        phases: Start and end of each phase in the order of time [s].
        events: Named moments, such as those of `events_of`.
        plan: Message ImpactPlan of the hit, its trajectories are not needed; None for a walk.
        door: The door that is hit, for its leaf; None for a walk.
    """
    motion, spans = log.motion, list(phases.values())
    t = motion.t
    return RecordedRun(
        t=t[(t >= spans[0][0]) & (t <= spans[-1][1])], source=_SOURCE,
        robot=Body(
            robot.urdf_path.read_text(encoding="utf-8"),
            [(tuple(log.joint_names), Series(t, motion.joints))],
            Series(t, _poses(motion.base_position, motion.base_orientation))),
        door=None if door is None else Body(
            door_scene.door_urdf(door),
            [((door_scene.JOINT,), Series(t, motion.door_angle[:, None]))],
            Series(t[:1], _poses(*np.split(np.array([door_scene.frame_pose(
                log.door_distance, log.hinge_x)]), [3], axis=1)))),
        points={"ZMP": Series(t, support.zmp), "CoM": Series(t, motion.com)},
        support=Series(t, padded(support.polygons)[support.polygon]),
        margin=Series(t, support.margin),
        phases=phases_of([(begin, name) for name, (begin, _) in phases.items()], spans[-1][1]),
        events=tuple(events),
        desired=() if plan is None else (plan.desired_opening_angle,),
        planned={} if plan is None else {each.phase: each.margin for each in plan.zmp_margins},
        plots=_plots(motion, plan))


def _plots(motion: Motion, plan: Any) -> tuple[Plot, ...]:
    if plan is None:
        tilt = np.degrees(evaluation.tilt(motion.base_orientation))
        return (Plot("Tilt of the base", "deg", (Curve(_SOURCE, colors.COM, motion.t, tilt),)),)
    return (
        Plot("Force of the robot on the door", "N",
             (Curve("elbow or hand", colors.FORCE, motion.t, motion.contact_force),)),
        Plot("Speed of B towards the door", "m/s",
             (Curve(_SOURCE, colors.COM, motion.t, motion.point_b_velocity),),
             (Limit("planned v_rB", round(float(plan.v_rb), 3)),)))


def _poses(places: Array, turns: Array) -> Array:
    """Return poses with quaternions w, x, y, z (n, 7) of such with x, y, z, w (n, 4)."""
    return np.hstack([places, turns[:, [3, 0, 1, 2]]])
