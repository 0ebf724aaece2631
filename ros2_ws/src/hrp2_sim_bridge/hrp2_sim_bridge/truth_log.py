"""The 1 kHz log of a run: what only the evaluation may know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hrp2_description.robot import RobotConfig

from hrp2_sim_bridge.door_world import DoorState
from hrp2_sim_bridge.recorder import Recorder
from hrp2_sim_bridge.robot_world import BodyState, RobotBody
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


@dataclass(frozen=True)
class Touch:
    """Contact of robot and leaf.

    Attributes:
        force: sum of the normal forces [N].
        link: index of the link that presses most, -1 for none.
        point: (3,) where it does, in the world [m].
    """

    force: float
    link: int
    point: Array


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

    def add_sample(
        self,
        time: float,
        robot: RobotBody,
        door: DoorState,
        soles: dict[str, BodyState],
        joints: tuple[Array, Array],
        wrenches: Array,
        touch: Touch,
    ) -> None:
        """Add a millisecond that ends at a time [s].

        Args:
            time: [s].
            robot: to ask for its base and point B.
            door: state of the leaf.
            soles: states of the soles by side.
            joints: positions and velocities (30,).
            wrenches: (2, 6) left and right, mean over the millisecond.
            touch: contact, mean force over the millisecond.
        """
        base, sphere = robot.base(), robot.contact_sphere()
        self._samples.add(
            time=time,
            base_position=base.position, base_quaternion=base.quaternion,
            base_linear_velocity=base.linear, base_angular_velocity=base.angular,
            q=joints[0], dq=joints[1],
            left_wrench=wrenches[0], right_wrench=wrenches[1],
            left_sole_position=soles["left"].position,
            right_sole_position=soles["right"].position,
            left_sole_quaternion=soles["left"].quaternion,
            right_sole_quaternion=soles["right"].quaternion,
            door_angle=door.angle, door_velocity=door.velocity,
            contact_force=touch.force, contact_link=touch.link, contact_point=touch.point,
            b_position=sphere.position, b_velocity=sphere.linear,
        )

    def add_tick(
        self, time: float, reference: Array, peak_torque: Array, braced: bool, fine: bool
    ) -> None:
        """Add a tick that ends at a time [s]: reference (30,) then, largest torques within it."""
        self._ticks.add(
            tick_time=time, tick_reference=reference, tick_peak_torque=peak_torque,
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
