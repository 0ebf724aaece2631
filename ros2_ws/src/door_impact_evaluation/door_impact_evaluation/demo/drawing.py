"""Draws the pictures of a demonstration from the nodes' messages and the simulation's log."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_model.door.config import DoorConfig
from door_model.door.door import Door
from door_model.motion.dynamics import simulate
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore
from door_model.recording.swings import FreeSwing, find_swings
from door_model.ros.messages import to_batch
from hrp2_description.robot import RobotConfig
from impact_planner.ros.messages import door_from_message
from scipy.optimize import least_squares

from door_impact_evaluation.report import animation, figures
from door_impact_evaluation.run.record import DemoRecord, SwingFit
from door_impact_evaluation.run.simulation_log import SimulationLog


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
