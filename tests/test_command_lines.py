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

PLAN_KEYS = {"omega_door", "v_rb", "v_rb_post", "effective_mass", "effective_mass_planar", "a_r",
             "b_r", "i_rob", "l_b", "planning_ms"}
LEAF = ("--mass", "47.62", "--width", "0.896")


def refused(done: Any, *words: str) -> None:
    """Not 0, one of the words' sentences on stderr, nothing on stdout, no traceback."""
    assert done.status not in (0, None)
    assert "Traceback" not in done.err
    assert not [line for line in done.out.splitlines() if not line.startswith("[ros2run]")]
    for word in words:
        assert word in done.err


def sample() -> str:
    """The recording that comes with door_model."""
    return str(data_path("recordings") / "paper_five_swings.csv")


@pytest.fixture
def broken_door(tmp_path: Path, paper_door: dict[str, Any]) -> str:
    """The paper's door with a link 3 that does not bridge the pivots."""
    door = {**paper_door, "linkage": {**paper_door["linkage"], "l2": 0.02, "l3": 0.03}}
    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(door))
    return str(path)


# -- plan ---------------------------------------------------------------------------------------


def test_plan_prints_the_contracts_keys(ros2: Callable[..., Any],
                                        reference_door: Callable[..., Any]) -> None:
    """And its w' takes the paper door to 25 deg, by eq. (1) integrated elsewhere."""
    done = ros2("run", "impact_planner", "plan", "--angle-deg", "25", "--json")
    assert done.status == 0, done.err
    plan = json.loads(done.out)
    assert set(plan) >= PLAN_KEYS
    angle, time = reference_door().peak(plan["omega_door"])
    assert math.degrees(angle) == pytest.approx(25.0, abs=0.1)
    assert time == pytest.approx(plan["peak_time"], rel=0.02)
    assert min(plan["planned_margin_mm"].values()) > 0.0


# -- identify -------------------------------------------------------------------------------------


def test_identify_finds_the_paper_door_and_plan_takes_its_file(
        ros2: Callable[..., Any], tmp_path: Path, paper_door: dict[str, Any]) -> None:
    """Within 5 %; the written door is one that the planner plans with."""
    out = tmp_path / "door.yaml"
    done = ros2("run", "door_model", "identify", "--csv", sample(), *LEAF, "--json",
                "--yaml", str(out))
    assert done.status == 0, done.err
    found = json.loads(done.out)
    for name, true in {"i_a": paper_door["i_a"], **paper_door["closer"]}.items():
        assert found[name]["value"] == pytest.approx(true, rel=0.05)
    planned = ros2("run", "impact_planner", "plan", "--angle-deg", "25", "--door", str(out),
                   "--json")
    assert json.loads(planned.out)["omega_door"] == pytest.approx(0.635, rel=0.02)


def test_identify_refuses_with_a_sentence(called: Callable[..., Any], tmp_path: Path,
                                          broken_door: str) -> None:
    """No mass and width, no CSV, no such door."""
    malformed = tmp_path / "malformed.csv"
    malformed.write_text("time_s,count\n0.0,1\n0.001,two\n")
    identify = ("door_model", "identify", "--csv")
    refused(called(*identify, sample()), "weigh", "width")
    refused(called(*identify, str(malformed), *LEAF), "malformed.csv:3", "two")
    refused(called(*identify, sample(), *LEAF, "--door", broken_door), "l2 + l3")


# -- demo -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("--target-deg", "nan"), ("--target-deg", "nan")),
     (("--engine", "bullet"), ("--engine", "bullet", "mujoco")),
     (("--ending", "pass"), ("--ending", "pass is not available yet", "hold or retreat"))])
def test_demo_refuses_before_it_starts_anything(
        called: Callable[..., Any], tmp_path: Path, arguments: tuple[str, ...],
        words: tuple[str, ...]) -> None:
    out = tmp_path / "out"
    refused(called("door_impact_evaluation", "demo", "--out", str(out), *arguments), *words)
    assert not out.exists()


# -- nodes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "node", [("hrp2_sim_bridge", "hrp2_sim_bridge"), ("door_model", "closer_identifier"),
             ("impact_planner", "plan")])
def test_a_linkage_that_does_not_close_is_refused_by_name(
        called: Callable[..., Any], broken_door: str, node: tuple[str, str]) -> None:
    if node[1] == "plan":
        arguments: tuple[str, ...] = ("--angle-deg", "25", "--door", broken_door)
    else:
        arguments = ("--ros-args", "--params-file", parameters(), "-p", f"door:={broken_door}")
    done = called(*node, *arguments)
    assert done.status == 1
    assert "l2 + l3 = 0.0500 m does not bridge" in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(("engine", "other"), [("pybullet", "mujoco")])
def test_without_its_engine_the_bridge_says_what_to_install(
        python: Callable[..., Any], engine: str, other: str) -> None:
    """The other engine is not named, and it is not needed."""
    code = (f"import sys; sys.modules['{engine}'] = None\n"
            "from hrp2_sim_bridge.ros.hrp2_sim_bridge_node import main\n"
            "sys.exit(main(sys.argv))\n")
    done = python(code, "--ros-args", "--params-file", parameters(), "-p", f"engine:={engine}")
    assert done.status == 1
    assert f"pip install {engine}" in done.err
    assert other not in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("parameter", "word"),
    [("log_file:=/dev/null/run.npz", "log_file"), ("hinge_x:=1.0e300", "hinge_x"),
     ("sole:=soft", "sole is soft")])
def test_a_setting_that_cannot_be_is_refused_before_anything_runs(
        called: Callable[..., Any], parameter: str, word: str) -> None:
    done = called("hrp2_sim_bridge", "hrp2_sim_bridge", "--ros-args", "--params-file",
                parameters(), "-p", parameter)
    assert done.status == 1
    assert word in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize("engine", ["mujoco"])
def test_a_second_driver_is_refused_and_the_first_goes_on(
        start: Callable[..., Any], ros2: Callable[..., Any], engine: str) -> None:
    """Two drivers of one robot would fight: exit status 1, and the clock still runs."""
    pytest.importorskip(engine)
    bridge = ("run", "hrp2_sim_bridge", "hrp2_sim_bridge", "--ros-args", "--params-file",
              parameters())
    first = start(*bridge, "-p", f"engine:={engine}")

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
