"""Describe the run of a demonstration by the simulation's own log, for its replay."""

from typing import Any

import numpy as np
from door_impact_bringup import door_scene
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import Curve, Limit, Plot
from door_impact_view.scene import colors
from door_model.door.config import DoorConfig

from door_impact_evaluation.report.recorded_run import (
    Body,
    RecordedRun,
    Series,
    events_of,
    padded,
    phases_of,
)
from door_impact_evaluation.run.record import DemoRecord
from door_impact_evaluation.run.simulation_log import SimulationLog

_SOURCE = "simulated"


def run_of_log(record: DemoRecord, log: SimulationLog, plan: Any, door: DoorConfig) -> RecordedRun:
    """Describe a run from its first phase to the end of the last one.

    Args:
        record: What was measured of the motion.
        log: The simulation's log as it was.
        plan: Message ImpactPlan with the plan that was executed; its trajectories are not needed.
            None if the door was not hit.
        door: The door, for its leaf.
    """
    motion, support, spans = log.motion, record.support, list(record.phases.values())
    t = motion.t
    before = t <= record.peak_time  # the blow of the elbow would dwarf the hand; nan: no blow
    plots = [Plot(f"Force of the {body} on the door", "N", (
        Curve(_SOURCE, colors.FORCE, t[rows], motion.contact_force[rows]),))
        for body, rows in (("elbow", before), ("hand", ~before)) if rows.any()]
    if plan is not None:
        plots.append(Plot("Speed of B towards the door", "m/s",
                          (Curve(_SOURCE, colors.COM, t, motion.point_b_velocity),),
                          (Limit("planned v_rB", round(float(plan.v_rb), 3)),)))
    return RecordedRun(
        t=t[(t >= spans[0][0]) & (t <= spans[-1][1])], source=_SOURCE,
        robot=Body(
            log.robot.urdf_path.read_text(encoding="utf-8"),
            {name: Series(t, angles[:, None])
             for name, angles in zip(log.robot.joint_names, motion.joints.T, strict=True)},
            Series(t, _poses(motion.base_position, motion.base_orientation))),
        door=Body(
            door_scene.door_urdf(door),
            {door_scene.JOINT: Series(t, motion.door_angle[:, None])},
            Series(t[:1], _poses(*np.split(np.array([door_scene.frame_pose(
                log.door_distance, log.hinge_x)]), [3], axis=1)))),
        points={"ZMP": Series(t, support.zmp), "CoM": Series(t, motion.com)},
        support=Series(t, padded(support.polygons)[support.polygon]),
        margin=Series(t, support.margin),
        phases=phases_of([(begin, name) for name, (begin, _) in record.phases.items()],
                         spans[-1][1]),
        events=events_of(record.contact_time, record.peak_time),
        desired=() if plan is None else (plan.desired_opening_angle,),
        planned={} if plan is None else {each.phase: each.margin for each in plan.zmp_margins},
        plots=tuple(plots))


def _poses(places: Array, turns: Array) -> Array:
    """Return poses with quaternions w, x, y, z (n, 7) of such with x, y, z, w (n, 4)."""
    return np.hstack([places, turns[:, [3, 0, 1, 2]]])
