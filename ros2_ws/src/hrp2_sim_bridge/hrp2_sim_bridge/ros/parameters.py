"""Parameters of the node ``hrp2_sim_bridge``, checked."""

from __future__ import annotations

import math
from typing import Any

from door_impact_common.errors import SettingError
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from hrp2_sim_bridge.settings import SensorSettings, WorldSettings

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of hrp2_description's"),
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    # Where the door stands must be given: bringup's params.yaml says it once for every node.
    "door_distance": (math.nan, "of the closed leaf's face from the origin of odom, to -y [m]"),
    "hinge_x": (math.nan, "x of the hinge in odom [m]"),
    "gui": (False, "open PyBullet's window"),
    "paced": (True, "hold the simulation to real time"),
    "max_real_time_factor": (0.0, "limit of an unpaced simulation, 0 for none"),
    "brace": (WorldSettings.brace, "let the braced joints carry more than their motors"),
    "restitution": (-1.0, "of a hit on the leaf; negative: the door's own"),
    "rotor_scale": (WorldSettings.rotor_scale, "multiple of the rotors' inertia, 0 for none"),
    "servo_time_constant": (-1.0, "of the joints' servos [s]; negative: the robot's own"),
    "contact_duration": (
        WorldSettings.contact_duration, "of the impact the leaf's surface is designed for [s]",
    ),
    "friction": (WorldSettings.friction, "between soles and floor"),
    "push_duration": (0.25, "of a push by hand whose request leaves it open [s]"),
    "time_step_coarse": (WorldSettings.time_step_coarse, "physics step [s]"),
    "time_step_fine": (WorldSettings.time_step_fine, "physics step near the leaf [s]"),
    "sole": (WorldSettings.sole, "rigid, or rubber as in robot.yaml"),
    "stabilizer": (WorldSettings.stabilizer, "keep the robot up on rubber"),
    "solver_iterations": (WorldSettings.iterations, "of PyBullet's solver, each step"),
    "encoder_bits": (WorldSettings.encoder_bits, "width of the door's counter, 16 or 32"),
    "seed": (WorldSettings.seed, "chooses the encoder's arbitrary zero and the sensors' noise"),
    "sensor_noise": (SensorSettings.sensor_noise, "false: joints, feet and IMU read exactly"),
    "force_sensor_calibrated": (
        SensorSettings.force_sensor_calibrated, "false: the foot sensors keep their offsets",
    ),
    "log_seconds": (WorldSettings.log_seconds, "length of motion that the log keeps [s]"),
    "log_file": ("", "npz that the 1 kHz log is written to at the end and by ~/save_log"),
}


class BridgeParameters:
    """Declares the parameters and reads them.

    Args:
        node: to declare them on.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        for name, (default, text) in PARAMETERS.items():
            # Numbers may come as integers and switches as 0 or 1: types are checked below.
            node.declare_parameter(
                name, default,
                ParameterDescriptor(description=text, read_only=True, dynamic_typing=True),
            )

    def text(self, name: str) -> str:
        """A parameter as text, empty where it is not set."""
        value = self._node.get_parameter(name).value
        return "" if value is None else str(value)

    def number(self, name: str) -> float:
        """A parameter that must be a finite number.

        Raises:
            SettingError: It is none.
        """
        value = self._node.get_parameter(name).value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SettingError(name, value, "a finite number")
        if not math.isfinite(value):
            raise SettingError(name, value, "a finite number")
        return float(value)

    def whole(self, name: str) -> int:
        """A parameter that must be a whole number, 0 or more.

        Raises:
            SettingError: It is none.
        """
        value = self.number(name)
        if value != round(value) or value < 0:
            raise SettingError(name, value, "a whole number, 0 or more")
        return int(value)

    def switch(self, name: str) -> bool:
        """A parameter that must be true or false.

        Raises:
            SettingError: It is neither.
        """
        value = self._node.get_parameter(name).value
        if value not in (True, False, "true", "false", "0", "1"):
            raise SettingError(name, value, "true or false")
        return value in (True, "true", "1")

    def speed(self) -> float:
        """Largest real-time factor, 0 for none.

        Raises:
            SettingError: A parameter out of its range.
        """
        if self.switch("paced"):
            return 1.0
        most = self.number("max_real_time_factor")
        if most < 0.0:
            raise SettingError("max_real_time_factor", most, "0 or more")
        return most

    def world_settings(self) -> dict[str, Any]:
        """Fields of `WorldSettings`.

        Raises:
            SettingError: A parameter out of its range.
        """
        own = {name: self.number(name) for name in ("restitution", "servo_time_constant")}
        numbers = ("rotor_scale", "contact_duration", "friction", "time_step_coarse",
                   "time_step_fine", "log_seconds")
        return {
            **{name: self.number(name) for name in numbers},
            "gui": self.switch("gui"),
            "sole": self.text("sole"),
            "stabilizer": self.switch("stabilizer"),
            "brace": self.switch("brace"),
            **{name: None if value < 0.0 else value for name, value in own.items()},
            "iterations": self.whole("solver_iterations"),
            "encoder_bits": self.whole("encoder_bits"),
            "seed": self.whole("seed"),
            "sensors": SensorSettings(
                sensor_noise=self.switch("sensor_noise"),
                force_sensor_calibrated=self.switch("force_sensor_calibrated"),
            ),
        }
