"""A run of the nodes, had again from the orders that its log keeps."""

import json
from typing import Any

import numpy as np
from door_model.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.command_log import replay
from hrp2_sim_bridge.sensor_settings import SensorSettings
from hrp2_sim_bridge.world import World


def test_the_demonstration_is_had_again_from_its_command_log_bit_for_bit(demo: Any) -> None:
    """Pushes, motion, hit and hold, without a node."""
    assert demo.status == 0, demo.text
    with np.load(demo.out / "simulation.npz") as data:
        log = dict(data)
    settings = json.loads(str(log["settings"]))
    settings["sensors"] = SensorSettings(**settings["sensors"])
    world = World(load_robot_config(), load_door(str(log["door"])), float(log["door_distance"]),
                  float(log["hinge_x"]), **settings)
    try:
        replay(world, str(log["commands"]), len(log["tick_time"]))
        again = world.log(with_com=False)
    finally:
        world.close()
    kinds = {order["kind"] for order in json.loads(str(log["commands"]))["orders"]}
    assert {"push", "trajectory"} <= kinds
    assert np.degrees(again["door_angle"].max()) > 20.0
    for name, column in again.items():
        np.testing.assert_array_equal(log[name], column, err_msg=name)
