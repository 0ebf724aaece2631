"""driver:=ros2_control, with the rules of ros2_control's controller in place of ROS 2's own."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from door_impact_msgs.action import ExecuteDoorImpact, Walk
from door_impact_msgs.srv import PlanDoorImpact
from processes import find_ros2, parameters
from rclpy.action import ActionClient
from running_graph import Graph, launch
from std_srvs.srv import Trigger

MANAGER = Path(__file__).parent / "controller_manager.py"
PACKAGE = "controller_manager"


def test_without_ros2_control_the_launch_says_so_before_anything_starts() -> None:
    done = subprocess.run(
        [find_ros2(), "launch", "door_impact_bringup", "bringup.launch.yaml",
         "driver:=ros2_control"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert f"Package '{PACKAGE}' not found" in done.stdout + done.stderr
    assert "process started" not in done.stdout + done.stderr


@pytest.fixture
def graph(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Graph]:
    """Every node, with a package controller_manager on the path."""
    index = tmp_path / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / PACKAGE).touch()
    library = tmp_path / "lib" / PACKAGE
    library.mkdir(parents=True)
    for name, text in (("ros2_control_node", f'exec {sys.executable} {MANAGER} "$@"'),
                       ("spawner", "exit 0")):
        (library / name).write_text(f"#!/bin/sh\n{text}\n")
        (library / name).chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}:{os.environ['AMENT_PREFIX_PATH']}")
    known = yaml.safe_load(Path(parameters()).read_text())
    known["/**/impact_planner"]["ros__parameters"]["door"] = "paper"
    own = tmp_path / "params.yaml"
    own.write_text(yaml.safe_dump(known))
    with launch(tmp_path, "driver:=ros2_control", "engine:=mujoco", "interface:=action",
                "paced:=false", f"params:={own}") as running:
        yield running


def test_a_stock_controller_hits_walks_and_is_stopped(graph: Graph) -> None:
    """By its action; the broadcasters' stamps differ by 40 us; the robot is stopped in a step."""
    answer = graph.call(PlanDoorImpact, "plan_door_impact", desired_opening_angle=0.436)
    assert answer.success, answer.message
    hit = ActionClient(graph.node, ExecuteDoorImpact, "execute_door_impact")
    walk = ActionClient(graph.node, Walk, "walk")
    graph.spin_until(lambda: hit.server_is_ready() and walk.server_is_ready(), "the actions")
    goal = graph.result(hit.send_goal_async(ExecuteDoorImpact.Goal()))
    result = graph.result(goal.get_result_async()).result
    assert result.success, result
    assert result.held_angle == pytest.approx(0.436, abs=0.035)
    wanted = Walk.Goal()
    wanted.goal.header.frame_id, wanted.goal.pose.position.x = "odom", 0.6
    steps: list[int] = []
    goal = graph.result(walk.send_goal_async(
        wanted, feedback_callback=lambda message: steps.append(message.feedback.step)))
    graph.spin_until(lambda: steps and steps[-1] >= 1, "a step")
    assert "stands on two feet" in graph.call(Trigger, "stop").message
    result = graph.result(goal.get_result_async()).result
    assert result.error_code == Walk.Result.STOPPED, result.message
