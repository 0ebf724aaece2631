"""The 1 kHz log of a run: what only the evaluation may know."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.door_world import DoorState
from hrp2_sim_bridge.frames import BodyState
from hrp2_sim_bridge.hit_meter import Touch
from hrp2_sim_bridge.recorder import Recorder
from hrp2_sim_bridge.settings import SAMPLE, SAMPLES_PER_TICK
from hrp2_sim_bridge.spline import Array
from hrp2_sim_bridge.truth import CenterOfMass

_COLUMNS: dict[str, tuple[tuple[int, ...], str]] = {
    "time": ((), "f8"),
    "base_position": ((3,), "f8"),
    "base_quaternion": ((4,), "f8"),
    "base_linear_velocity": ((3,), "f8"),
    "base_angular_velocity": ((3,), "f8"),
    "q": ((30,), "f4"),
    "dq": ((30,), "f4"),
    "left_wrench": ((6,), "f8"),
    "right_wrench": ((6,), "f8"),
    "left_sole_position": ((3,), "f8"),
    "right_sole_position": ((3,), "f8"),
    "left_sole_quaternion": ((4,), "f4"),
    "right_sole_quaternion": ((4,), "f4"),
    "door_angle": ((), "f8"),
    "door_velocity": ((), "f8"),
    "contact_force": ((), "f8"),
    "contact_link": ((), "i2"),
    "contact_point": ((3,), "f4"),
    "b_position": ((3,), "f8"),
    "b_velocity": ((3,), "f8"),
}
_TICK_COLUMNS: dict[str, tuple[tuple[int, ...], str]] = {
    "tick_time": ((), "f8"),
    "tick_reference": ((30,), "f8"),
    "tick_peak_torque": ((30,), "f4"),
    "tick_braced": ((), "?"),
    "tick_fine": ((), "?"),
}


class TruthLog:
    """Rows a millisecond and rows a tick.

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

    def add_samples(
        self,
        time: Array,
        links: BodyState,
        base: BodyState,
        joints: tuple[Array, Array],
        wrenches: Array,
        touches: Sequence[Touch],
        door: Sequence[DoorState],
    ) -> None:
        """Add T milliseconds.

        Args:
            time: (T,) their ends [s].
            links: states (T, 3 or more) of left sole, right sole and contact link then.
            base: states (T,) of base_link then.
            joints: positions and velocities (T, 30) then.
            wrenches: (T, 2, 6) left and right, mean over the millisecond.
            touches: contact, mean force over the millisecond.
            door: state of the leaf at the end.
        """
        left, right, sphere = (links.at((slice(None), index)) for index in range(3))
        self._samples.add(
            len(time), time=time,
            base_position=base.position, base_quaternion=base.quaternion,
            base_linear_velocity=base.linear, base_angular_velocity=base.angular,
            q=joints[0], dq=joints[1],
            left_wrench=wrenches[:, 0], right_wrench=wrenches[:, 1],
            left_sole_position=left.position, right_sole_position=right.position,
            left_sole_quaternion=left.quaternion, right_sole_quaternion=right.quaternion,
            door_angle=[state.angle for state in door],
            door_velocity=[state.velocity for state in door],
            contact_force=[touch.force for touch in touches],
            contact_link=[touch.link for touch in touches],
            contact_point=[touch.point for touch in touches],
            b_position=sphere.position, b_velocity=sphere.linear,
        )

    def add_tick(
        self, time: float, reference: Array, peak_torque: Array, braced: bool, fine: bool
    ) -> None:
        """Add a tick that ends at a time [s]: reference (30,) then, largest torques within it."""
        self._ticks.add(
            1, tick_time=time, tick_reference=reference, tick_peak_torque=peak_torque,
            tick_braced=braced, tick_fine=fine,
        )

    def arrays(self, robot: RobotConfig, *, with_com: bool) -> dict[str, Any]:
        """Copies of all columns, with the CoM's position and velocity if wanted."""
        log: dict[str, Any] = {**self._samples.arrays(), **self._ticks.arrays()}
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
        log["sole_rectangles"] = np.array([robot.soles["left"], robot.soles["right"]])
        log["mass"] = robot.mass
        return log
