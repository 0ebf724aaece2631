"""Turns a motion of the robot alone into a replay: a walk, or a run-up without a door."""

from collections.abc import Mapping, Sequence

import numpy as np
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import Curve, Event, Mark, Plot, Replay, Tree
from door_impact_view.replay.resampling import choose_stamps
from door_impact_view.scene import colors
from door_impact_view.scene.floor import on_floor
from door_impact_view.scene.urdf import read_urdf
from hrp2_description.robot import RobotConfig
from numpy.typing import NDArray

from door_impact_evaluation.report import replay_parts as parts
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.record import Motion, Support
from door_impact_evaluation.run.simulation_log import SimulationLog

PLOTTED = 200.0
"""Samples a second of the plots' curves far from every event [1/s]."""


def replay_of_motion(
    log: SimulationLog, support: Support, robot: RobotConfig,
    phases: Mapping[str, tuple[float, float]], *, planned: Mapping[str, float] | None = None,
    events: Sequence[Event] = (),
) -> Replay:
    """Makes the replay of a motion without the door.

    Args:
        log: The simulation's log.
        support: ZMP and support polygon at the log's times.
        robot: The robot, for its URDF.
        phases: Start and end of each phase in the order of time [s].
        planned: Smallest ZMP margin that the plan has for a phase, by the phase's name [m].
        events: Moments that are marked, with more samples around them.
    """
    motion = log.motion
    moments = [event.time for event in events]
    kept, shown = (
        np.flatnonzero(np.isin(motion.t, choose_stamps(motion.t, moments, *rate)))
        for rate in ((), (PLOTTED,)))
    t = motion.t[shown]
    spans = parts.phases_of([(begin, name) for name, (begin, _) in phases.items()],
                            float(motion.t[-1]))
    tilt = np.degrees(evaluation.tilt(motion.base_orientation[shown]))
    return Replay(
        stamps=motion.t[kept], trees=(body_of(robot, log, kept),),
        marks=marks_of(motion, support, kept), phases=spans, events=tuple(events),
        plots=(parts.margin_plot(t, support.margin[shown], planned or {}, spans),
               Plot("Tilt of the base", "deg", (Curve("simulated", colors.COM, t, tilt),))))


def body_of(robot: RobotConfig, log: SimulationLog, kept: NDArray[np.intp]) -> Tree:
    """Returns the robot's motion at some samples of the log."""
    motion = log.motion
    return Tree(
        read_urdf(robot.urdf_path.read_text(encoding="utf-8")), tuple(log.joint_names),
        motion.joints[kept], poses(motion.base_position[kept], motion.base_orientation[kept]))


def marks_of(motion: Motion, support: Support, kept: NDArray[np.intp]) -> tuple[Mark, ...]:
    """Returns support polygon, ZMP and CoM at some samples of the log."""
    com = motion.com[kept]
    return (
        Mark("support polygon", colors.SUPPORT,
             parts.padded(support.polygons)[support.polygon[kept]]),
        Mark("ZMP", colors.ZMP, on_floor(support.zmp[kept])),
        Mark("CoM", colors.COM, com),
        Mark("CoM on the floor", colors.COM, on_floor(com[:, :2])),
    )


def poses(places: Array, turns: Array) -> Array:
    """Returns poses with quaternions w, x, y, z (n, 7) of such with x, y, z, w (n, 4)."""
    return np.hstack([places, turns[:, [3, 0, 1, 2]]])
