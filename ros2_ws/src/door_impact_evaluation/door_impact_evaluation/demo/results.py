"""Turns what a demonstration received and logged into its results: summary, pictures, report."""


import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.files import write_whole
from door_model.door.config import DoorConfig, load_door
from door_model.door.door import Door
from door_model.motion.dynamics import simulate
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore
from door_model.recording.swings import FreeSwing, find_swings
from door_model.ros.messages import to_batch
from hrp2_description.robot import RobotConfig, load_robot_config
from impact_planner.ros.messages import door_from_message
from scipy.optimize import least_squares

from door_impact_evaluation.demo.received import Received
from door_impact_evaluation.demo.summary import summarize
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import animation, figures, report, table
from door_impact_evaluation.report.run_replay import replay_of_run
from door_impact_evaluation.run import evaluation, simulation_log
from door_impact_evaluation.run.record import DemoRecord, Support, SwingFit
from door_impact_evaluation.run.simulation_log import SimulationLog


def write(received: Received, out: Path) -> None:
    """Writes the pictures, the report and at last summary.json, and prints the table.

    Args:
        received: What the demonstration received from the nodes.
        out: Folder of the results, in which the simulation has written simulation.npz.

    Raises:
        DemoError: The motion never began, or the robot never touched the door.
    """
    if not received.phases:
        raise DemoError(f"the motion never began: {received.outcome.message}")
    log = simulation_log.load(out / "simulation.npz", received.phases[0][0])
    hit = evaluation.impact(log.motion, received.plan.l_b)
    robot, door = load_robot_config(), load_door(received.door)
    measured = evaluation.support(log.motion, robot, window=evaluation.WINDOW)
    record = _record(received, log, hit, measured)
    draw_door(received.parameters, received.samples, door, out)
    draw_motion(record, received.target_deg, out)
    draw_animation(log, robot, door, record.contact_time, out / "impact.gif")
    raw = evaluation.support(log.motion, robot, window=0.0)
    summary = summarize(received, log, hit, record, raw)
    caught_deg = float(np.degrees(log.motion.door_angle[hit.peak:].min()))
    rows = table.rows(summary, caught_deg)
    heading = _heading(summary, received.outcome)
    notes = [*received.plan.warnings, *received.parameters.warnings]
    notes += [log.fell] if log.fell else []
    replay = replay_of_run(record, log, received.plan, robot, door)
    report.write(rows, heading, notes, replay, out / "report.html")
    write_whole(out / "summary.json", json.dumps(summary, indent=2) + "\n")
    print(table.text(rows), flush=True)
    print(heading, flush=True)


def _heading(summary: dict[str, Any], outcome: Any) -> str:
    """One sentence that says how far the door opened and what became of the robot."""
    door, robot = summary["door"], summary["robot"]
    opened = (f"HRP-2 opened the door to {door['peak_deg']:.1f} deg "
              f"({door['error_deg']:+.1f} deg from the desired {door['target_deg']:g} deg) and ")
    if robot["fell"]:
        return opened + "fell."
    if not outcome.success:
        return opened + f"stands, but {outcome.message}."
    if door["held_deg"] is None:
        return opened + "stands, back from the door."
    return opened + f"stands, holding it at {door['held_deg']:.1f} deg."


def _record(received: Received, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            support: Support) -> DemoRecord:
    t = log.motion.t
    return DemoRecord(
        motion=log.motion,
        phases=_phases(received, log, hit),
        contact_time=float(t[hit.contact.start]),
        peak_time=float(t[hit.peak]),
        support=support,
        zmp_topic_t=received.zmp[:, 0],
        zmp_topic=received.zmp[:, 1:],
        door_topic_t=received.door_angle[:, 0],
        door_topic=received.door_angle[:, 1],
    )


def _phases(received: Received, log: simulation_log.SimulationLog, hit: evaluation.Impact,
            ) -> dict[str, tuple[float, float]]:
    """Start and end of each phase [s].

    The action's feedback gives the starts. Only the contact and the peak of the door are taken
    from the simulation's log, which has them to the millisecond.
    """
    t = log.motion.t
    contact, peak = float(t[hit.contact.start]), float(t[hit.peak])
    after = ("post", received.plan.ending)
    starts = [(time, name) for time, name in received.phases if name not in after]
    starts += [(contact, after[0]), (peak, after[1])]
    ends = [time for time, _ in starts[1:]] + [min(received.end, float(t[-1]))]
    return {name: (time, end) for (time, name), end in zip(starts, ends, strict=True)}


def draw_door(parameters: Any, samples: Sequence[Any], simulated: DoorConfig, out: Path) -> None:
    """Draws the identified door: its closer's angle, its restoring torque and its swings.

    Args:
        parameters: Message CloserParameters with the identified door.
        samples: Messages EncoderSamples of the pushes by hand.
        simulated: The door that the simulation moves, for comparison.
        out: Folder of the pictures.

    Raises:
        NoDoor: The message describes no door.
    """
    identified = door_from_message(parameters).door
    swings = [_swing_fit(identified, swing.opening()) for swing in find_swings(_recording(samples))]
    swung_to = max(float(swing.measured.max()) for swing in swings)
    figures.closer_angle(identified.closer, out / "closer_angle.png")
    figures.restoring_torque(identified, simulated.door(), swung_to, out / "restoring_torque.png")
    figures.identification_fit(swings, float(np.degrees(parameters.fit_rmse)),
                               out / "identification.png")


def draw_motion(record: DemoRecord, target_deg: float, out: Path) -> None:
    """Draws the cam curve, the ZMP and the angle of the door.

    Args:
        record: What was measured of the motion.
        target_deg: Desired opening angle [deg].
        out: Folder of the pictures.
    """
    figures.cam(out / "cam_curve.png")
    figures.zmp(record, out / "zmp.png")
    figures.door_angle(record, target_deg, out / "door_angle.png")


def draw_animation(log: SimulationLog, robot: RobotConfig, door: DoorConfig, contact_time: float,
                   path: Path) -> None:
    """Renders the hit from the simulation's log.

    Args:
        log: The simulation's log.
        robot: The robot, for its URDF and the names of its joints.
        door: The door, for the size of its leaf.
        contact_time: Time of the first contact of robot and door [s].
        path: GIF file to write.
    """
    motion = log.motion
    scene = animation.Scene(
        urdf=str(robot.urdf_path), joint_names=robot.joint_names,
        leaf=(door.leaf.width, door.leaf.height, door.leaf.thickness),
        hinge_x=log.hinge_x, door_distance=log.door_distance)
    poses = animation.Poses(t=motion.t, joints=motion.joints, base_position=motion.base_position,
                            base_orientation=motion.base_orientation, door_angle=motion.door_angle)
    animation.hit(scene, poses, contact_time, path)


def _recording(samples: Sequence[Any]) -> Recording:
    """Return the encoder's samples as one recording, whose times begin at 0."""
    store = SampleStore()
    for message in samples:
        store.add(to_batch(message))
    return store.recording()


def _swing_fit(door: Door, swing: FreeSwing) -> SwingFit:
    """An opening swing as the encoder measured it, and eq. (1) with the parameters of `door`.

    Initial angle and angular velocity are no parameters of the door: they are fitted anew to each
    swing.
    """
    t = swing.t - swing.t[0]

    def theta(start: Array) -> Array:
        motion = simulate(door, start[0], start[1], float(t[-1]) + 1e-3)
        return np.interp(t, motion.t, motion.theta)

    best = least_squares(lambda start: theta(start) - swing.theta,
                         [swing.theta[0], swing.start_speed], x_scale=[0.1, 1.0]).x
    return SwingFit(t=swing.t, measured=swing.theta, fitted=theta(best))
