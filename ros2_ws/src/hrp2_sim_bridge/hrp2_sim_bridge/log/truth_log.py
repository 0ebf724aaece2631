"""The 1 kHz log of a run: what only the evaluation may know."""

from __future__ import annotations

from typing import Any

import numpy as np
from door_impact_common.arrays import Array
from hrp2_description.robot import SIDES

from hrp2_sim_bridge.log.recorder import Recorder
from hrp2_sim_bridge.log.truth import CenterOfMass
from hrp2_sim_bridge.physics.robot_body import FRAME_VALUES, RobotBody
from hrp2_sim_bridge.sensors.foot_wrench import foot_wrenches
from hrp2_sim_bridge.sensors.readings import TickReadings
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK

_COLUMNS: dict[str, tuple[tuple[int, ...], str]] = {
    "time": ((), "f8"),
    "joints": ((2, 30), "f4"),
    "frames": ((FRAME_VALUES,), "f8"),
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
    "tick_braced": ((), "?"),
    "tick_fine": ((), "?"),
}


class TruthLog:
    """Rows a millisecond, kept as PyBullet gives them, and rows a tick.

    Args:
        length: of motion that is kept [s].
    """

    def __init__(self, length: float) -> None:
        rows = int(length / SAMPLE)
        self._samples = Recorder(_COLUMNS, rows)
        self._ticks = Recorder(_TICK_COLUMNS, rows // SAMPLES_PER_TICK)

    def clear(self) -> None:
        """Forget everything."""
        self._samples.clear()
        self._ticks.clear()

    def add(
        self,
        readings: TickReadings,
        time: float,
        reference: Array,
        *,
        braced: bool,
        fine: bool,
    ) -> None:
        """Add the readings of a tick that ends at a time [s], with the reference (30,) then."""
        count = len(readings.joints)
        joints = np.array(readings.joints)
        self._samples.add(
            count,
            time=time - SAMPLE * np.arange(count - 1, -1, -1),
            joints=joints[:, :2],
            frames=readings.frames[1:],
            reactions=readings.reactions,
            door=readings.door,
            contact_force=[touch.force for touch in readings.touches],
            contact_link=[touch.link for touch in readings.touches],
            contact_point=[touch.point for touch in readings.touches],
        )
        self._ticks.add(
            1, tick_time=time, tick_reference=reference,
            tick_peak_torque=np.abs(joints[:, 2]).max(axis=0), tick_braced=braced, tick_fine=fine,
        )

    def arrays(self, body: RobotBody, *, with_com: bool) -> dict[str, Any]:
        """All of it in the world's and the soles' frames, with the CoM if wanted."""
        kept, robot = self._samples.arrays(), body.robot
        # Nothing is known before the first row: it counts as without acceleration.
        links = body.link_states(np.vstack([kept["frames"][:1], kept["frames"]]))
        base = body.base_states(kept["frames"])
        soles = links.at((slice(None), slice(len(SIDES))))
        wrenches = foot_wrenches(
            kept["reactions"], soles, SAMPLE, body.sole_mass, body.sole_inertia
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
        log["sole_rectangles"] = np.array([robot.soles[side] for side in SIDES])
        log["mass"] = robot.mass
        return log
