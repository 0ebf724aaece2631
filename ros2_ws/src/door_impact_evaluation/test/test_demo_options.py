"""Options of the demonstration, as a command and as a node."""

import json
from pathlib import Path

import pytest
import rclpy
from door_impact_common.errors import SettingError
from door_impact_common.parameters import default_folders
from door_impact_evaluation.demo import demo, demo_runner_node
from door_impact_evaluation.demo.demo_runner_node import settings_of
from door_impact_evaluation.demo.settings import DemoSettings
from door_model.data import data_path
from door_model.errors import ConfigError
from rclpy.node import Node
from rclpy.parameter import Parameter


@pytest.mark.parametrize("hits", ["0", "6", "-1", "1.5", "two", ""])
def test_a_number_of_hits_outside_1_to_5_is_refused(tmp_path, capsys, hits):
    """The command ends with status 2 before anything is started or written."""
    with pytest.raises(SystemExit) as ended:
        demo.main(["--hits", hits, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "--hits" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "hits"), [([], 1), (["--hits", "1"], 1), (["--hits=5"], 5)])
def test_the_demonstration_hits_as_often_as_requested(tmp_path, monkeypatch, arguments, hits):
    """Without the option it hits once."""
    received = []
    monkeypatch.setattr(demo, "_demonstrate", lambda settings, _: received.append(settings.hits))
    monkeypatch.setattr(demo.signal, "signal", lambda *_: None)
    assert demo.main([*arguments, "--out", str(tmp_path)]) == 0
    assert received == [hits]


@pytest.mark.parametrize(("arguments", "engine", "gui"), [
    ([], "pybullet", "0"), (["--engine", "mujoco", "--gui", "1"], "mujoco", "1")])
def test_the_simulation_gets_its_engine(tmp_path, monkeypatch, arguments, engine, gui):
    """PyBullet without a window is the default."""
    received = []
    monkeypatch.setattr(
        demo, "_demonstrate", lambda settings, simulation: received.append(simulation))
    monkeypatch.setattr(demo.signal, "signal", lambda *_: None)
    assert demo.main([*arguments, "--out", str(tmp_path)]) == 0
    assert received == [{"engine": engine, "gui": gui}]


def test_the_nodes_may_read_the_file_of_the_door_that_a_person_named(tmp_path):
    """Besides the usual folders, just this file; the name of a door adds nothing."""
    usual = [str(folder) for folder in default_folders()]
    door = tmp_path / "my door.yaml"
    assert json.loads(demo._allowed("paper")) == usual
    assert json.loads(demo._allowed(str(door))) == [*usual, str(door.resolve())]


@pytest.fixture
def runner():
    """Makes the demonstration's node with the given parameters."""
    rclpy.init(args=[])
    yield lambda **given: Node("demo_runner", parameter_overrides=[
        Parameter(name, value=value) for name, value in given.items()])
    rclpy.shutdown()


def test_the_nodes_parameters_have_the_commands_defaults(runner):
    """The paper's door is hit once for 25 deg and held."""
    assert settings_of(runner()) == DemoSettings(
        "paper", 25.0, "hold", "mcv50", 1, Path("out/demo"))


def test_the_target_may_be_an_integer(runner):
    """`target_deg:=15` of the launch file is an integer."""
    found = settings_of(runner(target_deg=15)), settings_of(runner(target_deg=15.5))
    assert [settings.target_deg for settings in found] == [15.0, 15.5]


@pytest.mark.parametrize("value", ["far", True, [15.0]])
def test_a_target_that_is_no_number_is_refused(runner, value):
    """The error has the parameter's name and value."""
    with pytest.raises(SettingError, match=r"^target_deg is .*, must be a finite number$") as found:
        settings_of(runner(target_deg=value))
    assert found.value.value == value


def test_the_node_reads_a_door_s_file_only_from_allowed_folders(runner, tmp_path):
    """The folder of the file may be added."""
    door = tmp_path / "door.yaml"
    door.write_text(data_path("doors").joinpath("paper.yaml").read_text())
    with pytest.raises(ConfigError, match="allowed_folders"):
        settings_of(runner(door=str(door), allowed_folders=["/nowhere"]))
    found = settings_of(runner(door=str(door), allowed_folders=[str(tmp_path)]))
    assert found.door == str(door)


@pytest.mark.parametrize(("name", "value"), [
    ("hits", 0), ("hits", 1.5), ("ending", "run"), ("run_up", "fast"), ("target_deg", "far")])
def test_the_node_reports_a_wrong_parameter_in_one_line(tmp_path, capfd, name, value):
    """Its status is 1, and nothing is written."""
    out = tmp_path / "out"
    assert demo_runner_node.main(
        ["--ros-args", "-p", f"{name}:={value}", "-p", f"out_dir:={out}"]) == 1
    error = capfd.readouterr().err
    assert error.startswith(f"demo: {name} is {value}, must be ")
    assert error.count("\n") == 1
    assert not out.exists()
