"""Turns a demonstration's run into a replay: from the simulation's own log, 1 kHz at the hit."""

from typing import Any

import numpy as np
from door_impact_bringup import door_scene
from door_impact_common.arrays import Array
from door_impact_view.replay.recording import Curve, Limit, Mark, Plot, Replay, Tree
from door_impact_view.replay.resampling import choose_stamps
from door_impact_view.scene import colors
from door_impact_view.scene.floor import on_floor
from door_impact_view.scene.urdf import read_urdf
from door_impact_view.scene.wall import with_wall
from door_model.door.config import DoorConfig
from hrp2_description.robot import RobotConfig
from numpy.typing import NDArray

from door_impact_evaluation.report import replay_parts as parts
from door_impact_evaluation.run.record import DemoRecord
from door_impact_evaluation.run.simulation_log import SimulationLog

_PLOTTED = 200.0  # samples a second of the plots' curves far from the contact [1/s]


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
    shown = moving[np.isin(times, choose_stamps(times, fine, _PLOTTED))]
    body = Tree(
        read_urdf(robot.urdf_path.read_text(encoding="utf-8")), tuple(log.joint_names),
        motion.joints[kept],
        _poses(motion.base_position[kept], motion.base_orientation[kept]))
    place = np.array(door_scene.frame_pose(log.door_distance, log.hinge_x))
    leaf = Tree(with_wall(read_urdf(door_scene.door_urdf(door))), (door_scene.JOINT,),
                motion.door_angle[kept, None], _poses(place[None, :3], place[None, 3:]))
    point = plan.contact_point
    phases = parts.phases_of([(begin, name) for name, (begin, _) in record.phases.items()], end)
    return Replay(
        stamps=motion.t[kept],
        trees=(body, leaf),
        marks=_marks(record, kept),
        phases=phases,
        events=parts.events_of(contact, peak),
        plots=_plots(record, shown, plan, phases),
        cameras=parts.cameras(body, leaf, np.array([point.x, point.y, point.z])),
    )


def _poses(places: Array, turns: Array) -> Array:
    """Returns poses with quaternions w, x, y, z (n, 7) of such with x, y, z, w (n, 4)."""
    return np.hstack([places, turns[:, [3, 0, 1, 2]]])


def _marks(record: DemoRecord, kept: NDArray[np.intp]) -> tuple[Mark, ...]:
    support, com = record.support, record.motion.com[kept]
    corners = parts.padded(support.polygons)[support.polygon[kept]]
    return (
        Mark("support polygon", colors.SUPPORT, corners),
        Mark("ZMP", colors.ZMP, on_floor(support.zmp[kept])),
        Mark("CoM", colors.COM, com),
        Mark("CoM on the floor", colors.COM, on_floor(com[:, :2])),
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
