"""Options of the demonstration, as a command and as a node."""

import pytest
import rclpy
from door_impact_common.errors import SettingError
from door_impact_evaluation.demo import demo, demo_runner_node
from door_impact_evaluation.demo.demo_runner_node import settings_of
from rclpy.node import Node
from rclpy.parameter import Parameter


def test_a_number_of_hits_outside_1_to_5_is_refused(tmp_path, capsys):
    """The command ends with status 2 before anything is started or written."""
    with pytest.raises(SystemExit) as ended:
        demo.main(["--hits", "6", "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "--hits" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.fixture
def runner():
    """Makes the demonstration's node with the given parameters."""
    rclpy.init(args=[])
    yield lambda **given: Node("demo_runner", parameter_overrides=[
        Parameter(name, value=value) for name, value in given.items()])
    rclpy.shutdown()


def test_the_target_may_be_an_integer(runner):
    """`target_deg:=15` of the launch file is an integer."""
    found = settings_of(runner(target_deg=15)), settings_of(runner(target_deg=15.5))
    assert [settings.target_deg for settings in found] == [15.0, 15.5]


def test_a_target_that_is_no_number_is_refused(runner):
    """The error has the parameter's name and value."""
    with pytest.raises(SettingError, match="target_deg") as found:
        settings_of(runner(target_deg="far"))
    assert found.value.value == "far"


def test_the_node_reports_a_wrong_parameter_in_one_line(tmp_path, capfd):
    """Its status is 1, and nothing is written."""
    out = tmp_path / "out"
    assert demo_runner_node.main(
        ["--ros-args", "-p", "ending:=run", "-p", f"out_dir:={out}"]) == 1
    error = capfd.readouterr().err
    assert error.startswith("demo: ending is run")
    assert error.count("\n") == 1
    assert not out.exists()
