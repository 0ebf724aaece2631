"""The bridge's parameters, as its node reads them."""

import os
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
    rclpy.init(args=["--ros-args", *flags] if flags else None, domain_id=50 + os.getpid() % 50)
    node = rclpy.create_node("parameters_of_the_bridge")
    try:
        yield BridgeParameters(node)
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_a_log_is_kept_only_where_its_file_is_named() -> None:
    """Nothing else can write a log, and it needs 1.1 MB for each second."""
    with parameters() as without:
        assert not without.world_settings()["log"]
    with parameters("log_file:=run.npz") as named:
        assert named.world_settings()["log"]


def test_the_physics_engine_is_a_parameter() -> None:
    """PyBullet is the default."""
    with parameters() as without:
        assert without.world_settings()["engine"] == "pybullet"
    with parameters("engine:=mujoco") as named:
        assert named.world_settings()["engine"] == "mujoco"


def test_the_robots_start_is_a_list_of_three_numbers() -> None:
    """Whole numbers too, as one types them; the origin by default."""
    with parameters() as without:
        assert without.world_settings()["start"] == (0.0, 0.0, 0.0)
    with parameters("robot_start:=[2, -1, 1]") as whole:
        assert whole.world_settings()["start"] == (2.0, -1.0, 1.0)
    for wrong in ("[2.0, 1.0]", "[2.0, 1.0, .nan]", "2.0", "abc"):
        with parameters(f"robot_start:={wrong}") as refused, pytest.raises(
                SettingError, match="robot_start"):
            refused.world_settings()


def test_the_soles_rubber_may_be_stiffer_than_in_the_robots_configuration() -> None:
    """By a factor, 1 by default."""
    with parameters("rubber_scale:=1.3") as named:
        assert named.world_settings()["rubber_scale"] == 1.3
