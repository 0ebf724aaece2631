"""Parameters of the node ``hrp2_sim_bridge``."""

from __future__ import annotations

import math
from typing import Any

from door_impact_common.parameters import Parameters
from rclpy.node import Node

from hrp2_sim_bridge.settings import SensorSettings, WorldSettings

PARAMETERS: dict[str, tuple[Any, str]] = {
    "robot_config": ("", "robot.yaml to use instead of that of hrp2_description"),
    "door": ("paper", "name of a door in door_model/doors, or a YAML file"),
    # The place of the door has no default: params.yaml of the bringup sets it for every node.
    "door_distance": (
        math.nan, "distance of the closed leaf's face from the origin of odom, towards -y [m]",
    ),
    "hinge_x": (math.nan, "x of the hinge in odom [m]"),
    "engine": (WorldSettings.engine, "physics engine: pybullet or mujoco"),
    "gui": (False, "open the physics engine's window"),
    "paced": (True, "hold the simulation to real time"),
    "max_real_time_factor": (0.0, "largest speed of a simulation that is not paced; 0: no limit"),
    "brace": (
        WorldSettings.brace,
        "what the hitting arm leans on: contact (its pads), rigid (its joints are locked), none",
    ),
    "restitution": (-1.0, "coefficient of restitution of the leaf; negative: the door's own"),
    "rotor_scale": (WorldSettings.rotor_scale, "multiple of the rotors' inertia"),
    "robot_start": (
        list(WorldSettings.start),
        "where the robot stands at first, and after a reset: x [m], y [m] and heading [rad] of the "
        "middle between the soles in odom",
    ),
    "gear_scale": (WorldSettings.gear_scale, "multiple of the gears' stiffness and damping"),
    "servo_scale": (WorldSettings.servo_scale, "multiple of the servos' gains"),
    "pad_scale": (WorldSettings.pad_scale, "multiple of the pads' stiffness and damping"),
    "rubber_scale": (
        WorldSettings.rubber_scale, "multiple of the stiffness of the soles' rubber",
    ),
    "contact_duration": (
        WorldSettings.contact_duration,
        "duration of the impact for which the leaf's surface is designed [s]",
    ),
    "friction": (WorldSettings.friction, "coefficient of friction between soles and floor"),
    "leaf_friction": (
        WorldSettings.leaf_friction, "coefficient of friction between robot and leaf",
    ),
    "push_duration": (0.25, "duration of a push by hand whose request has a negative one [s]"),
    "time_step_coarse": (WorldSettings.time_step_coarse, "physics step far from the leaf [s]"),
    "time_step_fine": (WorldSettings.time_step_fine, "physics step near the leaf [s]"),
    "sole": (WorldSettings.sole, "rigid, or rubber as in robot.yaml"),
    "stabilizer": (WorldSettings.stabilizer, "keep the robot upright on rubber soles"),
    "solver_iterations": (
        WorldSettings.iterations, "number of iterations of the engine's solver in each step",
    ),
    "encoder_bits": (WorldSettings.encoder_bits, "width of the door's counter, 16 or 32"),
    "seed": (WorldSettings.seed, "seed of the encoder's arbitrary zero and the sensors' noise"),
    "sensor_noise": (SensorSettings.sensor_noise, "false: joints, feet and IMU are exact"),
    "force_sensor_calibrated": (
        SensorSettings.force_sensor_calibrated, "false: the foot sensors keep their offsets",
    ),
    "log_seconds": (WorldSettings.log_seconds, "duration of the motion that the log keeps [s]"),
    "log_file": (
        "", "npz file to which the 1 kHz log is written at the end and by ~/save_log; empty: none",
    ),
}


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
            SettingError: A parameter is out of its range.
        """
        restitution = self.number("restitution")
        numbers = ("rotor_scale", "gear_scale", "servo_scale", "pad_scale", "rubber_scale",
                   "contact_duration", "friction", "leaf_friction", "time_step_coarse",
                   "time_step_fine", "log_seconds")
        return {
            **{name: self.number(name) for name in numbers},
            "engine": self.text("engine"),
            "gui": self.switch("gui"),
            "start": self.numbers("robot_start", 3),
            "log": bool(self.text("log_file")),
            "sole": self.text("sole"),
            "stabilizer": self.switch("stabilizer"),
            "brace": self.text("brace"),
            "restitution": None if restitution < 0.0 else restitution,
            "iterations": self.whole("solver_iterations"),
            "encoder_bits": self.whole("encoder_bits"),
            "seed": self.whole("seed"),
            "sensors": SensorSettings(
                sensor_noise=self.switch("sensor_noise"),
                force_sensor_calibrated=self.switch("force_sensor_calibrated"),
            ),
        }
