"""Parameters of the node ``hrp2_sim_bridge``."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from door_impact_common.parameters import Parameters
from rclpy.node import Node

from hrp2_sim_bridge.settings import SensorSettings, WorldSettings

# Parameters of other names than their settings in `WorldSettings`, and those of `SensorSettings`.
_NAMES = {"start": "robot_start", "iterations": "solver_iterations"}
_SENSORS = ("sensor_noise", "force_sensor_calibrated")
_DOORS_OWN = -1.0  # restitution that stands for the door's own

_WORLD = {each.name: each for each in fields(WorldSettings) if "text" in each.metadata}
_DEFAULTS: dict[str, Any] = {name: each.default for name, each in _WORLD.items()} | {
    "restitution": _DOORS_OWN, "start": list(WorldSettings.start)}
PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of that of hrp2_description"),
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    # The place of the door has no default: params.yaml of the bringup sets it for every node.
    "door_distance": (
        math.nan, "distance of the closed leaf's face from the origin of odom, towards -y [m]"),
    "hinge_x": (math.nan, "x of the hinge in odom [m]"),
    "paced": (True, "hold the simulation to real time"),
    "max_real_time_factor": (0.0, "largest speed of a simulation that is not paced; 0: no limit"),
    "push_duration": (0.25, "duration of a push by hand whose request has a negative one [s]"),
    "log_file": (
        "", "npz file to which the 1 kHz log is written at the end and by ~/save_log; empty: none"),
    **{_NAMES.get(name, name): (_DEFAULTS[name], each.metadata["text"])
       for name, each in _WORLD.items()},
    **{each.name: (each.default, each.metadata["text"])
       for each in fields(SensorSettings) if each.name in _SENSORS}}


class BridgeParameters(Parameters):
    """Declares the node's parameters and reads those that need more than one value.

    Args:
        node: Node on which the parameters are declared.
    """

    def __init__(self, node: Node) -> None:
        super().__init__(node, PARAMETERS)

    def speed(self) -> float:
        """Return the largest real-time factor; 0 means no limit.

        Raises:
            SettingError: A parameter is out of its range.
        """
        return 1.0 if self.switch("paced") else self.number("max_real_time_factor", low=0.0)

    def world_settings(self) -> dict[str, Any]:
        """Return the fields of `WorldSettings`.

        Raises:
            SettingError: A parameter is of a wrong type.
        """
        settings = {name: self._typed(_NAMES.get(name, name), _DEFAULTS[name]) for name in _WORLD}
        if settings["restitution"] < 0.0:
            settings["restitution"] = None
        sensors = SensorSettings(**{name: self.switch(name) for name in _SENSORS})
        return settings | {"log": bool(self.text("log_file")), "sensors": sensors}

    def _typed(self, name: str, default: Any) -> Any:
        """Return a parameter of the same type as its default."""
        if isinstance(default, bool):
            return self.switch(name)
        if isinstance(default, int):
            return self.whole(name)
        if isinstance(default, float):
            return self.number(name)
        return self.text(name) if isinstance(default, str) else self.numbers(name, len(default))
