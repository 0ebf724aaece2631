"""The bridge's parameters, as its node reads them."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import rclpy
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.ros.parameters import BridgeParameters


@contextmanager
def parameters(*assignments: str) -> Iterator[BridgeParameters]:
    """The parameters of a node that is given NAME:=VALUE."""
    flags = [word for each in assignments for word in ("-p", each)]
    rclpy.init(args=["--ros-args", *flags] if flags else None)
    node = rclpy.create_node("parameters_of_the_bridge")
    try:
        yield BridgeParameters(node)
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_the_robots_start_is_a_list_of_three_numbers() -> None:
    """Whole numbers too, as one types them; the origin by default."""
    with parameters() as without:
        assert without.world_settings()["start"] == (0.0, 0.0, 0.0)
    with parameters("robot_start:=[2, -1, 1]") as whole:
        assert whole.world_settings()["start"] == (2.0, -1.0, 1.0)
    for wrong in ("[2.0, 1.0]", "[2.0, 1.0, .nan]"):
        with parameters(f"robot_start:={wrong}") as refused, pytest.raises(
                SettingError, match="robot_start"):
            refused.world_settings()
