"""Parameters of the node ``hrp2_sim_bridge``."""

from __future__ import annotations

import math
from typing import Any

from door_impact_common.documents import descriptions
from door_impact_common.parameters import FRAME_PREFIX, Parameters
from rclpy.node import Node

from hrp2_sim_bridge.settings import SensorSettings, WorldSettings

# Parameters of other names than their settings in `WorldSettings`.
_NAMES = {"start": "robot_start", "iterations": "solver_iterations"}
_OPTIONAL = ("restitution", "opens_to")  # a parameter has no None: a negative one stands for it
_WORLD = {name: (-1.0 if name in _OPTIONAL else [*default] if name == "start" else default, text)
          for name, (default, text) in descriptions(WorldSettings).items()}
_SENSORS = descriptions(SensorSettings)
PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of that of hrp2_description"),
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    # The place of the door has no default: params.yaml of the bringup sets it for every node.
    "door_distance": (
        math.nan, "distance of the closed leaf's face from the origin of odom, towards -y [m]"),
    "hinge_x": (math.nan, "x of a hinge at the right in odom, -x of one at the left [m]"),
    "frame_prefix": FRAME_PREFIX,
    "paced": (True, "hold the simulation to real time"),
    "max_real_time_factor": (0.0, "largest speed of a simulation that is not paced; 0: no limit"),
    "push_duration": (0.25, "duration of a push by hand whose request has a negative one [s]"),
    "log_file": (
        "", "npz file to which the 1 kHz log is written at the end and by ~/save_log; empty: none"),
    **{_NAMES.get(name, name): entry for name, entry in _WORLD.items()},
    **_SENSORS}


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
        settings = {name: self._typed(_NAMES.get(name, name), default)
                    for name, (default, _) in _WORLD.items()}
        settings |= {name: None for name in _OPTIONAL if settings[name] < 0.0}
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
