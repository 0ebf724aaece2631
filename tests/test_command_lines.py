"""What the commands do with good and with bad input; every refusal is a sentence, no traceback."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from door_model.data import data_path
from processes import parameters

LEAF = ("--mass", "47.62", "--width", "0.896")
SAMPLE = str(data_path("recordings") / "paper_five_swings.csv")
DEMO = ("door_impact_evaluation", "demo", "--out", "OUT")
BRIDGE = ("--ros-args", "--params-file", parameters(), "-p")


@pytest.fixture
def broken_door(tmp_path: Path, paper_door: dict[str, Any]) -> str:
    """The paper's door with a link 3 that does not bridge the pivots."""
    door = {**paper_door, "linkage": {**paper_door["linkage"], "l2": 0.02, "l3": 0.03}}
    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(door))
    return str(path)


def test_plan_takes_the_door_that_identify_has_found(
        ros2: Callable[..., Any], tmp_path: Path, reference_door: Callable[..., Any]) -> None:
    """Eq. (1), integrated elsewhere, takes the true door to 25 deg; the ZMP stays inside."""
    out = tmp_path / "door.yaml"
    done = ros2("run", "door_model", "identify", "--csv", SAMPLE, *LEAF, "--yaml", str(out))
    assert done.status == 0, done.err
    done = ros2("run", "impact_planner", "plan", "--angle-deg", "25", "--door", str(out), "--json")
    assert done.status == 0, done.err
    plan = json.loads(done.out)
    angle, time = reference_door().peak(plan["omega_door"])
    assert math.degrees(angle) == pytest.approx(25.0, abs=0.5)
    assert time == pytest.approx(plan["peak_time"], rel=0.02)
    assert min(plan["planned_margin_mm"].values()) > 0.0


@pytest.mark.parametrize(("command", "words"), [
    (("door_model", "identify", "--csv", SAMPLE), ("weigh", "width")),
    (("door_model", "identify", "--csv", SAMPLE, *LEAF, "--door", "BROKEN"), ("l2 + l3",)),
    (("impact_planner", "plan", "--angle-deg", "25", "--door", "BROKEN"), ("l2 + l3",)),
    (("door_model", "closer_identifier", *BRIDGE, "door:=BROKEN"), ("l2 + l3 = 0.0500 m",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "door:=BROKEN"), ("l2 + l3 = 0.0500 m",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "log_file:=/dev/null/a.npz"), ("log_file",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "hinge_x:=1.0e300"), ("hinge_x",)),
    (("door_impact_bringup", "scene_publisher"), ("door_distance", "--params-file")),
    (("door_impact_bringup", "up", "--door", "papr"), ("up: papr: no such door",)),
    (("door_impact_bringup", "up", "--params", "no.yaml"), ("no.yaml: cannot be read",)),
    (("door_impact_bringup", "up", "--robot", "no.yaml"), ("no.yaml: cannot be read",)),
    ((*DEMO, "--robot", "no.yaml"), ("demo: no.yaml ", "cannot be read",)),
    ((*DEMO, "--target-deg", "nan"), ("-deg", "nan")),
    ((*DEMO, "--target-deg", "200"), ("at most 180",)),
    ((*DEMO, "--target-deg", "100"), ("too fast", "zmp_limited")),
    ((*DEMO, "--ending", "crawl"), ("hold", "pass")),
    ((*DEMO, "--hits", "6"), ("--hits", "6"))])
def test_what_cannot_be_is_refused_before_anything_runs(
        called: Callable[..., Any], tmp_path: Path, broken_door: str, command: tuple[str, ...],
        words: tuple[str, ...]) -> None:
    """Not 0, a sentence on stderr, nothing on stdout, no file, no traceback."""
    out = tmp_path / "out"
    done = called(*(word.replace("BROKEN", broken_door).replace("OUT", str(out))
                    for word in command))
    assert done.status not in (0, None)
    assert done.out == ""
    assert "Traceback" not in done.err
    assert all(word in done.err for word in words), done.err
    assert not out.exists()


def test_without_its_engine_the_bridge_says_what_to_install(python: Callable[..., Any]) -> None:
    """The other engine is not named, and it is not needed."""
    code = ("import sys; sys.modules['pybullet'] = None\n"
            "from hrp2_sim_bridge.ros.hrp2_sim_bridge_node import main\n"
            "sys.exit(main(sys.argv))\n")
    done = python(code, *BRIDGE, "engine:=pybullet")
    assert done.status == 1
    assert "pip install pybullet" in done.err
    assert "mujoco" not in done.err
    assert "Traceback" not in done.err


def test_a_robot_given_to_the_launch_is_that_of_all_nodes_and_none_leaves_their_own() -> None:
    reader = pytest.importorskip("ros2_commands.launch.reader")
    file = Path(parameters()).parents[1] / "launch" / "bringup.launch.yaml"
    for given, nodes in (("my_robot.yaml", 5), ("", 0)):
        started = reader.read_processes(file, {"robot_config": given})
        assert sum(f'robot_config:="{given}"' in node.command for node in started) == nodes
