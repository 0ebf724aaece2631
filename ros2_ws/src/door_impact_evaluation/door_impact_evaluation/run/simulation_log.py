"""Read the simulation's own log, which only the evaluation knows.

Of a run at a door hinged at the left, the motion is read as that of the robot's mirror image at a
door hinged at the right, for which everything is defined.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import RobotConfig, load_robot_config
from humanoid_motion.mirror import Mirror

from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.run.evaluation import Impact, heading, tilt
from door_impact_evaluation.run.record import Motion

_RINGING = 0.03  # time after the contact in which gears bear loads of the hit [s]
_UPRIGHT = np.radians(5.0)  # tilt at the end below which the robot counts as standing [rad]
_ROUNDING = 1e-6  # difference below which two times of the log are the same [s]


@dataclass(frozen=True)
class HitLoads:
    """Loads of gears and pads in the hit.

    Attributes:
        gears: Largest torque of each joint's gear by its name [N m].
        shares: The same as shares of the gears' momentary peak torques.
        pad_force: Largest normal force of the pads [N].
        brace_impulse: Sum over the braced joints of the absolute angular impulses that the pads
            carried [N m s].
    """

    gears: dict[str, float]
    shares: dict[str, float]
    pad_force: float
    brace_impulse: float

    @property
    def heaviest(self) -> str:
        """Name of the joint whose gear bears the largest share of its momentary peak torque."""
        return max(self.shares, key=self.shares.__getitem__)


@dataclass(frozen=True)
class SimulationLog:
    """The contents of the simulation's log.

    Attributes:
        robot: The robot that was simulated.
        motion: The 1 kHz samples.
        fell: Reason why the robot counts as fallen; empty if it stands.
        frame_force: Normal forces of frame and wall on the robot at the samples, (n,) [N].
        max_tracking_error: Largest difference between a joint's angle and its reference [rad].
        max_torque_ratio: Largest torque of a motor over its limit; braced joints are left out.
        braced: Indices of the braced joints.
        tick_time: Times of the ends of the ticks, (T,) [s].
        gear_torque: Largest torques of the gears in each tick, (T, J) [N m].
        gear_peak_torque: Momentary peak torques of the gears, (J,) [N m].
        pad_force: Largest normal force of the pads in each tick, (T,) [N].
        pad_impulse: Angular impulses of the pads on the joints in each tick, (T, J) [N m s].
        door_distance: Distance of the closed leaf's face from the origin of odom [m].
        hinge_x: x of the hinge in odom, of a hinge at the left -x [m].
        i_a: Moment of inertia of the simulated leaf about its hinge [kg m^2].
        engine: Name of the physics engine.
    """

    robot: RobotConfig
    motion: Motion
    fell: str
    frame_force: Array
    max_tracking_error: float
    max_torque_ratio: float
    braced: list[int]
    tick_time: Array
    gear_torque: Array
    gear_peak_torque: Array
    pad_force: Array
    pad_impulse: Array
    door_distance: float
    hinge_x: float
    i_a: float
    engine: str

    @property
    def stood(self) -> bool:
        """Whether the robot stood upright in the end."""
        return not self.fell and bool(tilt(self.motion.base_orientation[-1:])[0] < _UPRIGHT)

    def reflected(self) -> "SimulationLog":
        """Return the log of the robot's mirror image."""
        mirror = Mirror(self.robot)
        return replace(self, motion=self.motion.reflected(mirror), hinge_x=-self.hinge_x)

    def hit_loads(self, impact: Impact) -> HitLoads:
        """Return the loads from the first contact until `_RINGING` after its end."""
        t, contact = self.motion.t, impact.contact
        first, last = np.searchsorted(
            self.tick_time, (t[contact.start], t[contact.end - 1] + _RINGING))
        ticks = slice(int(first), int(last) + 1)
        gears = self.gear_torque[ticks].max(axis=0)
        shares = gears / self.gear_peak_torque
        carried = np.abs(self.pad_impulse[ticks].sum(axis=0))[self.braced]
        names = self.robot.joint_names
        return HitLoads(
            dict(zip(names, gears.tolist(), strict=True)),
            dict(zip(names, shares.tolist(), strict=True)),
            float(self.pad_force[ticks].max()), float(carried.sum()))


def _robot(path: Path, log: dict[str, Any]) -> RobotConfig:
    """Load the robot that a log names; HRP-2 for a log without the name."""
    file = str(log.get("robot_config", ""))
    try:
        robot = load_robot_config(file or None)
    except RobotConfigError as error:
        raise DemoError(f"{path}: the robot of the log is gone: {error}") from error
    if robot.joint_names != (names := tuple(log["joint_names"].tolist())):
        raise DemoError(f"{path}: the log was made with another robot than that of {file} now, "
                        f"it has {len(names)} joints by other names or in another order")
    return robot


def load(path: Path, start: float) -> SimulationLog:
    """Read a log.

    Args:
        path: File that the simulation wrote (.npz).
        start: Time at which the motion begins; earlier samples are left out [s].

    Raises:
        DemoError: The file of the robot is gone, or has changed.
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
        left_heading=heading(log["left_sole_quaternion"][rows]),
        right_heading=heading(log["right_sole_quaternion"][rows]),
        base_orientation=log["base_quaternion"][rows],
        door_angle=log["door_angle"][rows],
        door_velocity=log["door_velocity"][rows],
        contact_force=log["contact_force"][rows],
        point_b_velocity=-log["b_velocity"][rows, 1],
        joints=log["q"][rows].astype(float),
        base_position=log["base_position"][rows],
        com=log["com_position"][rows],
    )
    at_ticks = np.clip(np.searchsorted(log["time"], log["tick_time"] - _ROUNDING), 0,
                       len(log["time"]) - 1)
    tracking = np.abs(log["q"][at_ticks] - log["tick_reference"])[ticks]
    robot = _robot(path, log)
    names = robot.joint_names
    braced = [names.index(name) for name in log["braced_joints"].tolist()]
    free = [i for i in range(len(names)) if i not in braced]
    ratio = log["tick_peak_torque"][ticks] / log["effort_limit"]
    found = SimulationLog(
        robot=robot,
        motion=motion,
        fell=str(log["fall_reason"]),
        frame_force=log["frame_force"][rows],
        max_tracking_error=float(tracking.max()),
        max_torque_ratio=float(ratio[:, free].max()),
        braced=braced,
        tick_time=log["tick_time"][ticks],
        gear_torque=log["tick_gear_torque"][ticks].astype(float),
        gear_peak_torque=log["gear_peak_torque"],
        pad_force=log["tick_pad_force"][ticks].astype(float),
        pad_impulse=log["tick_pad_impulse"][ticks].astype(float),
        door_distance=float(log["door_distance"]),
        hinge_x=float(log["hinge_x"]),
        i_a=float(log["i_a"]),
        engine=json.loads(str(log["settings"]))["engine"],
    )
    return found.reflected() if str(log["hinge"]) == "left" else found
