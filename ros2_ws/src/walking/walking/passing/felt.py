"""Where the door stands, as the hand that holds the leaf feels it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from door_impact_common.arrays import Array
from humanoid_motion.leaf import LeafFrame
from humanoid_motion.robot_model import RobotModel
from scipy.spatial.transform import Rotation

from walking.passing.passage_task import PassageTask

FARTHEST = 0.05
"""Largest distance of the hand from the surveyed leaf that counts as an error of the survey [m]."""


def felt(robot: RobotModel, task: PassageTask) -> PassageTask:
    """Move the door across the closed leaf to where the hand that holds the leaf shows its face.

    A survey errs by up to some 20 mm, what joints, IMU and soles show of the hand's place by a few.
    A hand farther than `FARTHEST` from the surveyed face does not hold it, and the door is left
    where it was.

    Args:
        task: The passage; without measured joints it is returned as it is.
    """
    if task.measured is None:
        return task
    door, place = task.doorway, hand_place(robot, task.measured, task)
    away = float(LeafFrame(door.hinge, task.angle).gap(place)) - robot.hand_radius
    if not abs(away) <= FARTHEST:
        return task
    across = np.array([0.0, away / math.cos(task.angle)])
    return replace(task, doorway=replace(door, hinge=np.asarray(door.hinge + across)))


def hand_place(robot: RobotModel, joints: Array, task: PassageTask) -> Array:
    """Compute where the hand of a robot is whose left sole stands as the task says, (3,) [m]."""
    config = robot.config
    frames = [robot.feet["left"].frame, config.hand_link, config.imu_frame or config.hand_link]
    foot, hand, imu = robot.poses_in_base(joints, frames)
    heading = task.stance.middle.yaw  # better known from the soles than from the IMU
    turn = Rotation.from_euler("z", heading)
    if task.attitude is not None and config.imu_frame is not None:
        base = Rotation.from_quat(task.attitude) * Rotation.from_matrix(imu[:3, :3]).inv()
        _, pitch, roll = base.as_euler("ZYX")
        turn = Rotation.from_euler("ZYX", [heading, pitch, roll])
    left = task.stance.left
    return np.array([left.x, left.y, 0.0]) + turn.apply(hand[:3, 3] - foot[:3, 3])
