"""Reads the simulation's own log, which only the evaluation knows."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from door_impact_evaluation.run.record import Motion

_ROUNDING = 1e-6  # difference below which two times of the log are the same [s]


@dataclass(frozen=True)
class BracedJoint:
    """Angular impulses of a braced joint while robot and door were in contact [N m s].

    Attributes:
        carried: Angular impulse that motor and brace carried together.
        motor: Largest angular impulse that the motor alone could have carried in this time.
        brace: Angular impulse of the torque beyond the motor's limit at each instant.
    """

    carried: float
    motor: float
    brace: float


@dataclass(frozen=True)
class SimulationLog:
    """The contents of the simulation's log.

    Attributes:
        motion: The 1 kHz samples.
        fell: Reason why the robot counts as fallen; empty if it stands.
        max_tracking_error: Largest difference between a joint's angle and its reference [rad].
        max_torque_ratio: Largest torque over its limit; braced joints are left out.
        braced_joints: Angular impulses of each braced joint, by its name.
        door_distance: Distance of the closed leaf's face from the origin of odom [m].
        hinge_x: x of the hinge in odom [m].
        i_a: Moment of inertia of the simulated leaf about its hinge [kg m^2].
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
        """Angular impulse that the braces carried beyond the motors, all joints [N m s]."""
        return sum(joint.brace for joint in self.braced_joints.values())


def load(path: Path, start: float) -> SimulationLog:
    """Reads a log.

    Args:
        path: File that the simulation wrote (.npz).
        start: Time at which the motion begins; earlier samples are left out [s].
    """
    with np.load(path) as data:
        log: dict[str, Any] = {name: data[name] for name in data.files}
    rows = log["time"] >= start - _ROUNDING
    ticks = log["tick_time"] >= start - _ROUNDING
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
    at_ticks = np.clip(np.searchsorted(log["time"], log["tick_time"] - _ROUNDING), 0,
                       len(log["time"]) - 1)
    tracking = np.abs(log["q"][at_ticks] - log["tick_reference"])[ticks]
    names = log["joint_names"].tolist()
    free = [i for i, name in enumerate(names) if name not in log["braced_joints"].tolist()]
    ratio = log["tick_peak_torque"][ticks] / log["effort_limit"]
    impulses = zip(*(log[name].tolist() for name in (
        "braced_joints", "carried_impulse", "motor_impulse", "brace_impulse")), strict=True)
    return SimulationLog(
        motion=motion,
        fell=str(log["fall_reason"]),
        max_tracking_error=float(tracking.max()),
        max_torque_ratio=float(ratio[:, free].max()),
        braced_joints={name: BracedJoint(*numbers) for name, *numbers in impulses},
        door_distance=float(log["door_distance"]),
        hinge_x=float(log["hinge_x"]),
        i_a=float(log["i_a"]),
    )
