"""Options of the demonstration as a node."""

import pytest
import rclpy
from door_impact_evaluation.demo import demo_runner_node
from rclpy.node import Node
from rclpy.parameter import Parameter


@pytest.mark.parametrize("target", [15, 15.5])
def test_the_target_may_be_an_integer(target):
    """`target_deg:=15` of the launch file is an integer."""
    rclpy.init(args=[])
    node = Node("demo_runner", parameter_overrides=[Parameter("target_deg", value=target)])
    assert demo_runner_node.settings_of(node).target_deg == target
    rclpy.shutdown()


def test_the_node_reports_a_wrong_parameter_in_one_line(tmp_path, capfd):
    """Its status is 1, and nothing is written."""
    out = tmp_path / "out"
    assert demo_runner_node.main(
        ["--ros-args", "-p", "ending:=run", "-p", f"out_dir:={out}"]) == 1
    error = capfd.readouterr().err
    assert error.startswith("demo: ending is run")
    assert error.count("\n") == 1
    assert not out.exists()
