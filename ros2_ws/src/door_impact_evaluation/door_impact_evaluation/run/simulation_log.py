"""Reading the simulation's log, which only the evaluation sees."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from door_impact_evaluation.run.record import Motion


@dataclass(frozen=True)
class BracedJoint:
    """Angular impulses of a braced joint in the hit [N m s].

    Attributes:
        carried: By motor and brace together.
        motor: The most that the motor could have given in that time.
        brace: What was beyond the motor's limit at each instant.
    """

    carried: float
    motor: float
    brace: float


@dataclass(frozen=True)
class SimulationLog:
    """What the simulation wrote.

    Attributes:
        motion: Its 1 kHz log.
        fell: Whether the robot fell, and why; empty where it stands.
        max_tracking_error: Of any joint [rad].
        max_torque_ratio: Largest torque over its limit, braced joints left out by name.
        braced_joints: What each braced joint carried while robot and door touched.
        door_distance: Of the closed leaf's face from the origin of odom [m].
        hinge_x: x of the hinge [m].
        i_a: Moment of inertia of the simulated leaf [kg m^2].
    """

    motion: Motion
    fell: str
    max_tracking_error: float
    max_torque_ratio: float
    braced_joints: dict[str, BracedJoint]
    door_distance: float
    hinge_x: float
    i_a: float

    @property
    def brace_impulse(self) -> float:
        """Angular impulse that the brace carried beyond the motors, all joints [N m s]."""
        return sum(joint.brace for joint in self.braced_joints.values())


def load(path: Path, start: float) -> SimulationLog:
    """Reads a log.

    Args:
        path: The file.
        start: Time from which on the motion counts [s].
    """
    with np.load(path) as data:
        log: dict[str, Any] = {name: data[name] for name in data.files}
    rows = log["time"] >= start - 1e-6
    ticks = log["tick_time"] >= start - 1e-6
    motion = Motion(
        t=log["time"][rows],
        left_wrench=log["left_wrench"][rows],
        right_wrench=log["right_wrench"][rows],
        left_sole=log["left_sole_position"][rows],
        right_sole=log["right_sole_position"][rows],
        base_orientation=log["base_quaternion"][rows],
        door_angle=log["door_angle"][rows],
        door_velocity=log["door_velocity"][rows],
        contact_force=log["contact_force"][rows],
        point_b_velocity=-log["b_velocity"][rows, 1],
        joints=log["q"][rows].astype(float),
        base_position=log["base_position"][rows],
    )
    at_ticks = np.clip(np.searchsorted(log["time"], log["tick_time"] - 1e-6), 0,
                       len(log["time"]) - 1)
    tracking = np.abs(log["q"][at_ticks] - log["tick_reference"])[ticks]
    names = log["joint_names"].tolist()
    free = [i for i, name in enumerate(names) if name not in log["braced_joints"].tolist()]
    ratio = log["tick_peak_torque"][ticks] / log["effort_limit"]
    carried = zip(*(log[name].tolist() for name in (
        "braced_joints", "carried_impulse", "motor_impulse", "brace_impulse")), strict=True)
    return SimulationLog(
        motion=motion,
        fell=str(log["fall_reason"]),
        max_tracking_error=float(tracking.max()),
        max_torque_ratio=float(ratio[:, free].max()),
        braced_joints={name: BracedJoint(*impulses) for name, *impulses in carried},
        door_distance=float(log["door_distance"]),
        hinge_x=float(log["hinge_x"]),
        i_a=float(log["i_a"]),
    )
