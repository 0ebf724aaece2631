"""Turns a demonstration's run into a replay: from the simulation's own log, 1 kHz at the hit."""

from typing import Any

import numpy as np
from door_impact_bringup import door_scene
from door_impact_view.replay.recording import Curve, Limit, Plot, Replay, Tree
from door_impact_view.replay.resampling import choose_stamps
from door_impact_view.scene import colors
from door_impact_view.scene.urdf import read_urdf
from door_impact_view.scene.wall import with_wall
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig
from numpy.typing import NDArray

from door_impact_evaluation.report import replay_parts as parts
from door_impact_evaluation.report.motion_replay import PLOTTED, body_of, marks_of, poses
from door_impact_evaluation.run.record import DemoRecord
from door_impact_evaluation.run.simulation_log import SimulationLog


def replay_of_run(record: DemoRecord, log: SimulationLog, plan: Any, robot: RobotConfig,
                  door: DoorConfig) -> Replay:
    """Makes the replay of a run.

    Args:
        record: What was measured of the motion.
        log: The simulation's log.
        plan: Message ImpactPlan with the plan that was executed.
        robot: The robot, for its URDF.
        door: The door, for its leaf.
    """
    motion = record.motion
    contact, peak = (None if np.isnan(moment) else moment
                     for moment in (record.contact_time, record.peak_time))
    fine = [] if contact is None else [contact]
    spans = list(record.phases.values())
    start, end = spans[0][0], spans[-1][1]
    moving = np.flatnonzero((motion.t >= start) & (motion.t <= end))
    times = motion.t[moving]
    kept = moving[np.isin(times, choose_stamps(times, fine))]
    shown = moving[np.isin(times, choose_stamps(times, fine, PLOTTED))]
    body = body_of(robot, log, kept)
    place = np.array(door_scene.frame_pose(log.door_distance, log.hinge_x))
    leaf = Tree(with_wall(read_urdf(door_scene.door_urdf(door))), (door_scene.JOINT,),
                motion.door_angle[kept, None], poses(place[None, :3], place[None, 3:]))
    point = plan.contact_point
    phases = parts.phases_of([(begin, name) for name, (begin, _) in record.phases.items()], end)
    return Replay(
        stamps=motion.t[kept],
        trees=(body, leaf),
        marks=marks_of(motion, record.support, kept),
        phases=phases,
        events=parts.events_of(contact, peak),
        plots=_plots(record, shown, plan, phases),
        cameras=parts.cameras(body, leaf, np.array([point.x, point.y, point.z])),
    )


def _plots(record: DemoRecord, shown: NDArray[np.intp], plan: Any,
           phases: tuple[parts.Phase, ...]) -> tuple[Plot, ...]:
    motion, t = record.motion, record.motion.t[shown]
    inside = (record.door_topic_t >= t[0]) & (record.door_topic_t <= t[-1])
    angle = Curve("encoder", colors.DOOR, record.door_topic_t[inside],
                  np.degrees(record.door_topic[inside]))
    planned = {each.phase: each.margin for each in plan.zmp_margins}
    return (
        parts.door_plot(angle, [plan.desired_opening_angle]),
        parts.margin_plot(t, record.support.margin[shown], planned, phases),
        Plot("Force of the robot on the door", "N",
             (Curve("elbow or hand", colors.FORCE, t, motion.contact_force[shown]),)),
        Plot("Speed of B towards the door", "m/s",
             (Curve("simulated", colors.COM, t, motion.point_b_velocity[shown]),),
             (Limit("planned v_rB", round(float(plan.v_rb), 3)),)),
    )
