"""The 1 kHz log of a run: true states, which only the evaluation may use, and its file."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.files import make_folder
from hrp2_description.robot import SIDES
from numpy.typing import ArrayLike, NDArray

from hrp2_sim_bridge.control.drives import Actuation
from hrp2_sim_bridge.physics.engine import DoorState, Engine, SimulatedRobot, Touch
from hrp2_sim_bridge.physics.kinematics import Kinematics, sensed_bodies
from hrp2_sim_bridge.sensors.sensors import outer_wrenches
from hrp2_sim_bridge.settings import SAMPLE, TICK


class TruthLog:
    """One row for each millisecond, as the engine reports it, and one for each tick.

    Args:
        length: Duration of the motion that is kept [s]; what is older is lost.
        joints: Number J of the robot's joints.
    """

    def __init__(self, length: float, joints: int) -> None:
        self._sample = np.dtype([
            ("time", "f8"), ("joints", "f4", (2, joints)), ("base", "f8", (13,)),
            ("reactions", "f8", (len(SIDES), 6)), ("door", "f8", (2,)), ("contact_force", "f8"),
            ("contact_link", "i2"), ("contact_point", "f4", (3,)), ("frame_force", "f8")])
        self._tick = np.dtype([
            ("tick_time", "f8"), ("tick_reference", "f8", (joints,)),
            *((f"tick_{what}", "f4", (joints,)) for what in (
                "peak_torque", "gear_torque", "pad_impulse")),
            ("tick_pad_force", "f4"), ("tick_locked", "?"), ("tick_fine", "?")])
        ticks = max(1, round(length / TICK))
        self._samples: deque[NDArray] = deque(maxlen=ticks)
        self._ticks: deque[NDArray] = deque(maxlen=ticks)

    def clear(self) -> None:
        """Delete all rows."""
        self._samples.clear()
        self._ticks.clear()

    def add_samples(
        self, time: float, joints: Sequence[Array], base: Sequence[Sequence[float]],
        reactions: Array, door: Sequence[DoorState], touches: Sequence[Touch],
        frame_force: Sequence[float],
    ) -> None:
        """Add the readings of a tick that ends at a time [s], one for each of its milliseconds.

        They are joint positions and velocities (2, J), rows of `Engine.read_base`, mean forces and
        torques at the force sensors (T, B, 6), states of the leaf, its contacts with the robot,
        and mean forces of frame and wall on the robot [N].
        """
        rows = np.zeros(len(joints), self._sample)
        rows["time"] = time - SAMPLE * np.arange(len(joints) - 1, -1, -1)
        rows["joints"], rows["base"], rows["door"] = joints, base, door
        rows["reactions"] = reactions[:, : len(SIDES)]
        rows["contact_force"], rows["contact_link"], rows["contact_point"] = zip(
            *touches, strict=True)
        rows["frame_force"] = frame_force
        self._samples.append(rows)

    def add_tick(
        self, time: float, reference: Array, torque: Array, actuation: Actuation, *, locked: bool,
        fine: bool,
    ) -> None:
        """Add what is kept once for a tick that ends at a time [s].

        It is the commanded posture at its end (J,) [rad], the motors' largest torques (J,) [N m],
        the loads of drives and brace, whether the braced joints were locked, and whether the
        physics steps were fine.
        """
        row, pads = np.zeros(1, self._tick), actuation.pads
        row["tick_time"], row["tick_reference"], row["tick_peak_torque"] = time, reference, torque
        row["tick_gear_torque"] = actuation.drives.peak
        if pads is not None:
            row["tick_pad_force"], row["tick_pad_impulse"] = pads.peak, pads.impulse
        row["tick_locked"], row["tick_fine"] = locked, fine
        self._ticks.append(row)

    def arrays(self, engine: Engine, robot: SimulatedRobot) -> dict[str, Any]:
        """Return all columns in the world's and the soles' frames."""
        kept, ticks = (np.concatenate([np.zeros(0, kind), *rows]) for kind, rows in (
            (self._sample, self._samples), (self._tick, self._ticks)))
        base = engine.base_states(kept["base"])
        soles = [robot.feet[side].sole for side in SIDES]
        links, com = Kinematics(robot, [*soles, robot.contact_link]).states(base, kept["joints"])
        feet = slice(len(SIDES))
        # The state before the first row is not known; the first row has no acceleration.
        before = np.maximum(np.arange(-1, len(base) - 1), 0)
        wrenches = outer_wrenches(
            kept["reactions"], links.at((before, feet)), links.at((slice(None), feet)), SAMPLE,
            sensed_bodies(robot))
        log: dict[str, Any] = {
            "time": kept["time"],
            "base_position": base[:, :3],
            "base_quaternion": base[:, 3:7],
            "base_linear_velocity": base[:, 7:10],
            "base_angular_velocity": base[:, 10:],
            "q": kept["joints"][:, 0],
            "dq": kept["joints"][:, 1],
            "door_angle": kept["door"][:, 0],
            "door_velocity": kept["door"][:, 1],
            "b_position": links.position[:, len(SIDES)],
            "b_velocity": links.linear[:, len(SIDES)],
            "com_position": com[:, 0],
            "com_velocity": com[:, 1],
            **{name: kept[name] for name in (
                "contact_force", "contact_link", "contact_point", "frame_force")},
            **{name: ticks[name] for name in self._tick.names or ()}}
        for index, side in enumerate(SIDES):
            log[f"{side}_wrench"] = wrenches[:, index]
            log[f"{side}_sole_position"] = links.position[:, index]
            log[f"{side}_sole_quaternion"] = links.at((slice(None), index)).quaternion
        return log | {
            "robot_config": str(robot.file or ""),
            "joint_names": np.array(robot.joint_names),
            "effort_limit": np.array(robot.effort_limit),
            "braced_joints": np.array(robot.braced_joints),
            "gear_peak_torque": np.array(robot.drives.peak_torque),
            "sole_rectangles": np.array([robot.soles[side] for side in SIDES]),
            "mass": robot.mass}


def check_writable(path: str | Path) -> None:
    """Check before a run that `save_npz` can write its log afterwards.

    Raises:
        SettingError: The path is no file's name, or the file cannot be written.
    """
    target = Path(path)
    try:
        partial = target.with_name(target.name + ".part")
        partial.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(b"")
        partial.unlink()
    except (OSError, ValueError) as error:
        raise SettingError("log_file", path, f"a file that can be written ({error})") from error


def save_npz(path: str | Path, arrays: Mapping[str, ArrayLike]) -> Path:
    """Write arrays to an npz file that appears completely or not at all; return its path.

    The suffix is replaced by npz, and missing folders are made. The file is not compressed, because
    a node that ends has little time.

    Raises:
        OutputError: The file cannot be written; an older file is left as it was.
    """
    target = Path(path).with_suffix(".npz")
    make_folder(target.parent)
    partial = target.with_name(target.name + ".part")
    columns: dict[str, Any] = {name: np.asarray(data) for name, data in arrays.items()}
    try:
        with partial.open("wb") as stream:
            np.savez(stream, **columns)
        partial.replace(target)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(
            f"{target} cannot be written: {error.strerror}", value=str(target)) from error
    return target
