"""Options of the demonstration as a command and as a node."""

import signal

import numpy as np
import pytest
import rclpy
from door_impact_evaluation.demo import demo, demo_runner_node
from door_impact_evaluation.demo.demo_client import DemoClient
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


def test_the_command_restores_what_signals_do(tmp_path, monkeypatch):
    """It ignores them at last, so that nothing keeps it from stopping its nodes."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    monkeypatch.setattr(demo, "_demonstrate", lambda *_: [
        signal.signal(number, signal.SIG_IGN) for number in numbers])
    before = [*map(signal.getsignal, numbers)]
    assert demo.main(["--out", str(tmp_path)]) == 0
    assert [*map(signal.getsignal, numbers)] == before


def test_a_push_is_measured_although_its_answer_comes_after_the_peak(monkeypatch):
    rclpy.init(args=[])
    client = DemoClient()
    monkeypatch.setattr(client, "until", lambda *_: None)
    monkeypatch.setattr(client, "_demand", lambda _, push, *__: client.door.extend(
        [(0.0, 0.012 * push.impulse**2), (1.0, 0.0)]))
    assert np.degrees(client.push_by_hand()[1:]) == pytest.approx([16.0, 20.0, 25.0, 30.0])
    rclpy.shutdown()
