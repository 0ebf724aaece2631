"""What the commands do with good and with bad input; every refusal is a sentence, no traceback."""

import json
import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from door_model.data import data_path
from processes import parameters

LEAF = ("--mass", "47.62", "--width", "0.896")
SAMPLE = str(data_path("recordings") / "paper_five_swings.csv")
BRIDGE = ("--ros-args", "--params-file", parameters(), "-p")


@pytest.fixture
def broken_door(tmp_path: Path, paper_door: dict[str, Any]) -> str:
    """The paper's door with a link 3 that does not bridge the pivots."""
    door = {**paper_door, "linkage": {**paper_door["linkage"], "l2": 0.02, "l3": 0.03}}
    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(door))
    return str(path)


def test_plan_takes_the_paper_s_door_to_25_deg(
        ros2: Callable[..., Any], reference_door: Callable[..., Any]) -> None:
    """By eq. (1) integrated elsewhere, with the ZMP inside in every phase."""
    done = ros2("run", "impact_planner", "plan", "--angle-deg", "25", "--json")
    assert done.status == 0, done.err
    plan = json.loads(done.out)
    angle, time = reference_door().peak(plan["omega_door"])
    assert math.degrees(angle) == pytest.approx(25.0, abs=0.1)
    assert time == pytest.approx(plan["peak_time"], rel=0.02)
    assert min(plan["planned_margin_mm"].values()) > 0.0


def test_identify_finds_the_paper_door_and_plan_takes_its_file(
        ros2: Callable[..., Any], tmp_path: Path, paper_door: dict[str, Any]) -> None:
    """Within 5 %; the written door is one that the planner plans with."""
    out = tmp_path / "door.yaml"
    done = ros2("run", "door_model", "identify", "--csv", SAMPLE, *LEAF, "--json",
                "--yaml", str(out))
    assert done.status == 0, done.err
    found = json.loads(done.out)
    for name, true in {"i_a": paper_door["i_a"], **paper_door["closer"]}.items():
        assert found[name]["value"] == pytest.approx(true, rel=0.05)
    planned = ros2("run", "impact_planner", "plan", "--angle-deg", "25", "--door", str(out),
                   "--json")
    assert json.loads(planned.out)["omega_door"] == pytest.approx(0.635, rel=0.02)


@pytest.mark.parametrize(("command", "words"), [
    (("door_model", "identify", "--csv", SAMPLE), ("weigh", "width")),
    (("door_model", "identify", "--csv", SAMPLE, *LEAF, "--door", "BROKEN"), ("l2 + l3",)),
    (("impact_planner", "plan", "--angle-deg", "25", "--door", "BROKEN"), ("l2 + l3",)),
    (("door_model", "closer_identifier", *BRIDGE, "door:=BROKEN"), ("l2 + l3 = 0.0500 m",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "door:=BROKEN"), ("l2 + l3 = 0.0500 m",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "log_file:=/dev/null/a.npz"), ("log_file",)),
    (("hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "hinge_x:=1.0e300"), ("hinge_x",)),
    (("door_impact_evaluation", "demo", "--out", "OUT", "--target-deg", "nan"), ("-deg", "nan")),
    (("door_impact_evaluation", "demo", "--out", "OUT", "--ending", "crawl"), ("hold", "pass")),
    (("door_impact_evaluation", "demo", "--out", "OUT", "--hits", "6"), ("--hits", "6"))])
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


def test_a_second_driver_is_refused_and_the_first_goes_on(
        start: Callable[..., Any], ros2: Callable[..., Any]) -> None:
    """Two drivers of one robot would fight: exit status 1, and the clock still runs."""
    bridge = ("run", "hrp2_sim_bridge", "hrp2_sim_bridge", *BRIDGE, "engine:=mujoco")
    first = start(*bridge)

    def clock() -> float:
        done = ros2("topic", "echo", "--once", "/clock", "rosgraph_msgs/msg/Clock")
        assert done.status == 0, done.err
        stamp = yaml.safe_load(done.out.split("---")[0])["clock"]
        return float(stamp["sec"] + 1e-9 * stamp["nanosec"])

    clock()
    second = start(*bridge)
    assert second.wait() == 1
    assert "/hrp2_sim_bridge" in second.text()
    assert "Traceback" not in second.text()
    times = [clock(), clock()]
    assert 0.0 < times[0] < times[1]
    assert first.process.poll() is None
    first.signal_group(signal.SIGINT)  # ROS 2's `run` leaves its child alone
    first.wait()
    assert first.family() == []
