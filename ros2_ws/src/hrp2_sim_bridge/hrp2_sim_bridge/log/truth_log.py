"""The 1 kHz log of a run: true states, which only the evaluation may use."""

from __future__ import annotations

from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES, RobotConfig, needed

from hrp2_sim_bridge.control.actuation import Actuation
from hrp2_sim_bridge.log.recorder import Recorder
from hrp2_sim_bridge.log.truth import CenterOfMass
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.sensors.readings import TickReadings
from hrp2_sim_bridge.sensors.wrench import outer_wrenches
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK

_COLUMNS: dict[str, tuple[tuple[int, ...], str]] = {
    "time": ((), "f8"),
    "joints": ((2, 30), "f4"),
    "reactions": ((len(SIDES), 6), "f8"),
    "door": ((2,), "f8"),
    "contact_force": ((), "f8"),
    "contact_link": ((), "i2"),
    "contact_point": ((3,), "f4"),
}
_TICK_COLUMNS: dict[str, tuple[tuple[int, ...], str]] = {
    "tick_time": ((), "f8"),
    "tick_reference": ((30,), "f8"),
    "tick_peak_torque": ((30,), "f4"),
    "tick_gear_torque": ((30,), "f4"),
    "tick_pad_force": ((), "f4"),
    "tick_pad_impulse": ((30,), "f4"),
    "tick_locked": ((), "?"),
    "tick_fine": ((), "?"),
}


class TruthLog:
    """One row for each millisecond, as the engine reports it, and one for each tick.

    Args:
        length: Duration of the motion that is kept [s].
        frame_values: Length of a row of `Engine.read_frames`.
    """

    def __init__(self, length: float, frame_values: int) -> None:
        rows = int(length / SAMPLE)
        self._samples = Recorder(_COLUMNS | {"frames": ((frame_values,), "f8")}, rows)
        self._ticks = Recorder(_TICK_COLUMNS, rows // SAMPLES_PER_TICK)

    def clear(self) -> None:
        """Delete all rows."""
        self._samples.clear()
        self._ticks.clear()

    def add(
        self,
        readings: TickReadings,
        actuation: Actuation,
        time: float,
        reference: Array,
        *,
        locked: bool,
        fine: bool,
    ) -> None:
        """Add the readings of a tick.

        Args:
            readings: Readings of the tick.
            actuation: Drives and brace, with their largest loads in the tick.
            time: Time at the end of the tick [s].
            reference: Commanded joint positions at the end of the tick, (30,) [rad].
            locked: Whether the braced joints were locked.
            fine: Whether the physics steps were fine.
        """
        count = len(readings.joints)
        joints = np.array(readings.joints)
        self._samples.add(
            count,
            time=time - SAMPLE * np.arange(count - 1, -1, -1),
            joints=joints[:, :2],
            frames=readings.frames[1:],
            reactions=readings.mean_reactions[:, : len(SIDES)],
            door=readings.door,
            contact_force=[touch.force for touch in readings.touches],
            contact_link=[touch.link for touch in readings.touches],
            contact_point=[touch.point for touch in readings.touches],
        )
        pads = actuation.pads
        self._ticks.add(
            1, tick_time=time, tick_reference=reference,
            tick_peak_torque=np.abs(joints[:, 2]).max(axis=0),
            tick_gear_torque=actuation.drives.peak,
            tick_pad_force=0.0 if pads is None else pads.peak,
            tick_pad_impulse=0.0 if pads is None else pads.impulse,
            tick_locked=locked, tick_fine=fine,
        )

    def arrays(self, engine: Engine, robot: RobotConfig, *, with_com: bool) -> dict[str, Any]:
        """Return all columns in the world's and the soles' frames.

        Args:
            engine: Engine of the readings.
            robot: Configuration of the robot.
            with_com: Whether to add position and velocity of the CoM.
        """
        kept = self._samples.arrays()
        # The state before the first row is not known; the first row has no acceleration.
        links = engine.link_states(np.vstack([kept["frames"][:1], kept["frames"]]))
        base = engine.base_states(kept["frames"])
        soles = links.at((slice(None), slice(len(SIDES))))
        feet = slice(len(SIDES))
        wrenches = outer_wrenches(
            kept["reactions"], soles, SAMPLE, engine.sensed_mass[feet], engine.sensed_inertia[feet]
        )
        log: dict[str, Any] = {
            "time": kept["time"],
            "base_position": base.position,
            "base_quaternion": base.quaternion,
            "base_linear_velocity": base.linear,
            "base_angular_velocity": base.angular,
            "q": kept["joints"][:, 0],
            "dq": kept["joints"][:, 1],
            "door_angle": kept["door"][:, 0],
            "door_velocity": kept["door"][:, 1],
            "b_position": links.position[1:, len(SIDES)],
            "b_velocity": links.linear[1:, len(SIDES)],
            **{name: kept[name] for name in ("contact_force", "contact_link", "contact_point")},
            **self._ticks.arrays(),
        }
        for index, side in enumerate(SIDES):
            log[f"{side}_wrench"] = wrenches[:, index]
            log[f"{side}_sole_position"] = soles.position[1:, index]
            log[f"{side}_sole_quaternion"] = soles.quaternion[1:, index]
        if with_com:
            log["com_position"], log["com_velocity"] = CenterOfMass(robot).series(
                log["base_position"],
                log["base_quaternion"],
                log["base_linear_velocity"],
                log["base_angular_velocity"],
                log["q"],
                log["dq"],
            )
        log["joint_names"] = np.array(robot.joint_names)
        log["effort_limit"] = np.array(robot.effort_limit)
        log["braced_joints"] = np.array(robot.braced_joints)
        log["gear_peak_torque"] = np.array(needed(robot.drives, "drives").peak_torque)
        log["sole_rectangles"] = np.array([robot.soles[side] for side in SIDES])
        log["mass"] = robot.mass
        return log
