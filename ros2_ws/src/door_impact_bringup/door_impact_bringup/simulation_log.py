"""Reading the simulation's log, which only the evaluation sees."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .record import Motion


@dataclass(frozen=True)
class SimulationLog:
    """What the simulation wrote.

    Attributes:
        motion: Its 1 kHz log.
        fell: Whether the robot fell, and why; empty where it stands.
        max_tracking_error: Of any joint [rad].
        max_torque_ratio: Largest torque over its limit, braced joints left out by name.
        brace_impulse: Angular impulse that the brace carried beyond the motors [N m s].
        brace_impulses: The same by joint.
        door_distance: Of the closed leaf's face from the origin of odom [m].
        hinge_x: x of the hinge [m].
        i_a: Moment of inertia of the simulated leaf [kg m^2].
    """

    motion: Motion
    fell: str
    max_tracking_error: float
    max_torque_ratio: float
    brace_impulse: float
    brace_impulses: dict[str, float]
    door_distance: float
    hinge_x: float
    i_a: float


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
    impulses = dict(zip(log["braced_joints"].tolist(), log["brace_impulse"].tolist(), strict=True))
    return SimulationLog(
        motion=motion,
        fell=str(log["fall_reason"]),
        max_tracking_error=float(tracking.max()),
        max_torque_ratio=float(ratio[:, free].max()),
        brace_impulse=float(sum(impulses.values())),
        brace_impulses=impulses,
        door_distance=float(log["door_distance"]),
        hinge_x=float(log["hinge_x"]),
        i_a=float(log["i_a"]),
    )
