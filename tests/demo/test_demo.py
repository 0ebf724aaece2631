"""`make demo`: what it returns and writes, and whether its figures are physics."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.run import evaluation, simulation_log
from hrp2_description.robot import load_robot_config
from PIL import Image

PHASES = {"prepare", "shift", "step", "back", "cam", "post", "hold"}
PARAMETERS = {"i_a", "c_c", "k_c", "tau_c0_prime"}
PICTURES = ("door_angle.png", "zmp.png", "identification.png", "restoring_torque.png",
            "closer_angle.png", "cam_curve.png")


def read(folder: Path) -> dict[str, Any]:
    """summary.json, in which every number is finite: NaN is no JSON, and no measurement."""
    def refuse(text: str) -> None:
        raise AssertionError(f"{text} in summary.json")

    return json.loads((folder / "summary.json").read_text(), parse_constant=refuse)


@pytest.fixture(scope="module")
def summary(demo: Any) -> dict[str, Any]:
    """summary.json of a demonstration that ended well and left no process."""
    assert demo.status == 0, demo.text
    assert "Traceback" not in demo.text
    assert demo.left_over == []
    return read(demo.out)


@pytest.fixture(scope="module")
def log(demo: Any) -> dict[str, Any]:
    """The simulation's 1 kHz log, which only the evaluation knows."""
    with np.load(demo.out / "simulation.npz") as data:
        return {name: data[name] for name in data.files}


@pytest.fixture(scope="module")
def first(log: dict[str, Any]) -> slice:
    """Samples of the first contact."""
    begin = int(np.argmax(log["contact_force"] > 5.0))
    return slice(begin, begin + int(np.argmax(log["contact_force"][begin:] <= 5.0)))


def test_one_contact_opens_the_door_to_25_deg_where_it_is_held(
        demo: Any, summary: dict[str, Any], log: dict[str, Any], first: slice) -> None:
    """By the right elbow; the legs slow down after it and not before, and the planner counts it.

    On a loaded machine the legs may have switched too late for it to be learned from.
    """
    door, hit = summary["door"], summary["impact"]
    assert door["target_deg"] == 25.0
    assert door["peak_deg"] == pytest.approx(25.0, abs=1.0)
    assert door["error_deg"] == pytest.approx(door["peak_deg"] - 25.0, abs=1e-9)
    assert door["held_deg"] == pytest.approx(25.0, abs=2.0)
    assert hit["contacts_before_peak"] == 1
    assert str(log["link_names"][log["contact_link"][first.start]]) == "RARM_LINK3"
    assert 5.0 < hit["switch_latency_ms"] < 60.0
    robot = summary["robot"]
    assert robot["fell"] is False
    assert robot["max_tilt_deg"] < 2.0
    assert robot["foot_slip_mm"] < 2.0
    assert robot["max_torque_ratio"] < 1.0 + 1e-3
    nodes = (demo.out / "nodes.log").read_text()
    assert len(re.findall("hit 1 opened the door|switch_latency was", nodes)) == 1, nodes
    assert "was seen running" not in nodes


@pytest.mark.parametrize("name", sorted(PARAMETERS))
def test_identified_parameters_are_the_doors(summary: dict[str, Any], paper_door: dict[str, Any],
                                             name: str) -> None:
    """Within 5 % of the door's file; the noise of an encoder leaves some error, and a deviation."""
    found = summary["identified"][name]
    true = {"i_a": paper_door["i_a"], **paper_door["closer"]}[name]
    assert found["true"] == true
    assert found["value"] == pytest.approx(true, rel=0.05)
    assert found["value"] != true
    assert 0.0 < found["std"] < 0.1 * true
    assert found["relative_error"] == pytest.approx(found["value"] / true - 1.0, abs=1e-9)


def test_the_zmp_stays_inside_in_every_phase(demo: Any, summary: dict[str, Any]) -> None:
    """By 15 mm before the hit and by 20 mm after it; it is on an edge for less than 0.1 s.

    Rocking lasts a few hundredths of a second; tipping over would begin with more.
    """
    measured = summary["zmp"]["measured_min_margin_mm"]
    after = {"post", "hold"}
    assert set(measured) == PHASES
    assert min(measured[phase] for phase in PHASES - after) > 15.0, measured
    assert min(measured[phase] for phase in after) > 20.0, measured
    motion = simulation_log.load(demo.out / "simulation.npz", 0.0).motion
    margin = evaluation.support(motion, load_robot_config(), window=evaluation.WINDOW).margin
    assert np.sum(margin < 0.005) * 0.001 < 0.1


def test_the_zmp_of_the_1_khz_wrenches_stays_over_the_soles(log: dict[str, Any]) -> None:
    """Moments and forces of the log, averaged over 21 ms, taken together by other code."""
    forces = moments_x = moments_y = 0.0
    kernel = np.ones(21) / 21.0
    for side in ("left", "right"):
        w = np.stack([np.convolve(c, kernel, "same") for c in log[f"{side}_wrench"].T], axis=1)
        x, y, _ = log[f"{side}_sole_position"].T
        forces = forces + w[:, 2]
        moments_x = moments_x + w[:, 3] + y * w[:, 2]
        moments_y = moments_y + w[:, 4] - x * w[:, 2]
    bears = (log["time"] > 0.1) & (log["time"] < log["time"][-1] - 0.1)
    zmp_x, zmp_y = (-moments_y / forces)[bears], (moments_x / forces)[bears]
    (x_min, x_max, *_), _ = log["sole_rectangles"]
    soles = np.stack([log["left_sole_position"], log["right_sole_position"]])[:, bears]
    y_out = np.abs(log["sole_rectangles"][:, 2:]).max()
    assert (zmp_x > soles[:, :, 0].min(axis=0) + x_min).all()
    assert (zmp_x < soles[:, :, 0].max(axis=0) + x_max).all()
    assert (zmp_y > soles[:, :, 1].min(axis=0) - y_out).all()
    assert (zmp_y < soles[:, :, 1].max(axis=0) + y_out).all()
    assert forces[bears].mean() == pytest.approx(58.0 * GRAVITY, rel=0.005)


def test_eq_1_takes_the_planned_speed_to_the_target(
        summary: dict[str, Any], reference_door: Callable[..., Any]) -> None:
    """The identified door, integrated by other code, stops at 25 deg."""
    found = {name: summary["identified"][name]["value"] for name in PARAMETERS}
    angle, _ = reference_door(**found).peak(summary["plan"]["omega_door"])
    assert np.degrees(angle) == pytest.approx(25.0, abs=0.1)


def test_the_simulated_door_obeys_eq_1(summary: dict[str, Any], log: dict[str, Any],
                                       reference_door: Callable[..., Any], first: slice) -> None:
    """From the state after the hit the true door, integrated by other code, peaks as measured."""
    hit, after = first.start, first.stop
    angle, time = reference_door().peak(log["door_velocity"][after], log["door_angle"][after])
    assert np.degrees(angle) == pytest.approx(summary["door"]["peak_deg"], abs=0.3)
    assert log["time"][after] - log["time"][hit] + time == pytest.approx(
        summary["door"]["peak_time_s"], abs=0.03)
    assert log["door_velocity"][after] == pytest.approx(
        summary["impact"]["omega_door_measured"], rel=0.01)


def test_the_plan_obeys_eqs_2_3_and_5(
        summary: dict[str, Any], reference_door: Callable[..., Any]) -> None:
    """Momentum about the hinge, effective mass and percussion, to rounding.

    The closer takes half of its torque times the contact's 15 ms besides. The leaf's surface has a
    restitution of 0.5, and the robot gives.
    """
    plan, found = summary["plan"], summary["identified"]
    door = reference_door(**{name: found[name]["value"] for name in PARAMETERS})
    i_a = found["i_a"]["value"]
    braking = 0.5 * 0.015 * i_a * -door.acceleration(0.0, 0.0)
    momentum = plan["effective_mass"] * (plan["v_rb"] - plan["v_rb_post"]) * plan["l_b"]
    assert momentum == pytest.approx(i_a * plan["omega_door"] + braking, rel=1e-3)
    separation = plan["omega_door"] * plan["l_b"] - plan["v_rb_post"]
    assert 0.4 < separation / plan["v_rb"] < 0.5
    assert 1.0 / plan["effective_mass_planar"] == pytest.approx(
        1.0 / 58.0 + plan["a_r"] ** 2 / plan["i_rob"], rel=1e-3)
    assert plan["b_r"] == pytest.approx(plan["i_rob"] / (58.0 * plan["a_r"]), rel=0.01)


def test_b_hits_at_the_planned_speed(
        summary: dict[str, Any], log: dict[str, Any], first: slice) -> None:
    """Within 1.5 % by the summary, and by differences of B's place in the log."""
    v_rb, hit = summary["impact"]["v_rb_measured"], first.start
    assert v_rb == pytest.approx(summary["plan"]["v_rb"], rel=0.015)
    way = log["b_position"][hit - 5, 1] - log["b_position"][hit - 1, 1]
    assert way / (log["time"][hit - 1] - log["time"][hit - 5]) == pytest.approx(v_rb, rel=0.05)


def test_the_door_gets_the_momentum_that_b_loses(
        summary: dict[str, Any], log: dict[str, Any], first: slice) -> None:
    """As planned and by the integral of the force, each within 4 %; the closer takes some."""
    hit, plan = summary["impact"], summary["plan"]
    taken = summary["identified"]["i_a"]["true"] * hit["omega_door_measured"]
    lost = plan["effective_mass"] * (plan["v_rb"] - plan["v_rb_post"])
    assert lost * plan["l_b"] == pytest.approx(taken, rel=0.04)
    assert 0.001 * log["contact_force"][first].sum() * plan["l_b"] == pytest.approx(taken, rel=0.04)


def test_pictures_and_animation_show_something(demo: Any) -> None:
    """They open, are large enough to read and not of one colour; the animation moves."""
    for name in PICTURES:
        with Image.open(demo.out / name) as picture:
            pixels = np.asarray(picture.convert("L"), dtype=float)
        assert min(pixels.shape) > 200, name
        assert pixels.std() > 5.0, name
    with Image.open(demo.out / "impact.gif") as film:
        assert film.n_frames > 50
        first = np.asarray(film.convert("L"), dtype=float)
        film.seek(film.n_frames - 1)
        assert np.abs(np.asarray(film.convert("L"), dtype=float) - first).max() > 50.0
