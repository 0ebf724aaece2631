"""What the kinds of sweep draw, and what they make of measured runs."""

import json
import math

import pytest
from door_impact_evaluation.sweep import hit, passing, report, running, store
from door_impact_evaluation.sweep.sweep import KINDS
from door_impact_evaluation.sweep.walk import arrival
from door_model.door.config import load_door
from walking.footsteps.footstep import Pose

PAPER = load_door("paper")


def rows_of(kind, n, **columns):
    """Make the rows of a sweep's cases; `columns` are the same for all."""
    return [{**case, "run": run, "refused": None, "error": None, "fell": "", **columns}
            for case in KINDS[kind].draw(n, 1) for run in range(case.get("hits", 1))]


@pytest.mark.parametrize(("kind", "number", "drawn"), [
    ("hit", 8, {"tau_scale": 0.9650564090905086, "pad_scale": 1.3680360023332827}),
    ("walk", 1, {"seed": 504722976, "friction": 0.49377890576343497}),
    ("miss", 3, {"seed": 1040511712, "target_deg": 26.834342557803627}),
    ("blocked", 1, {"seed": 665097662, "play_mm": 2.0097408671390506}),
    ("push", 2, {"seed": 883629044, "direction": -2.2358110930610913}),
    ("pass", 1, {"seed": 172992027, "width": 0.8312596352544783}),
])
def test_a_seed_draws_the_same_cases_as_ever(kind, number, drawn):
    """Earlier sweeps of the same seed compare; a longer sweep contains a shorter one."""
    cases = KINDS[kind].draw(2, 1)
    for name, value in drawn.items():
        assert cases[number][name] == pytest.approx(value, rel=1e-12)
    assert all(case in KINDS[kind].draw(3, 1) for case in cases)
    assert len({json.dumps(case) for case in cases}) == len(cases)


def test_a_perturbed_door_is_known_by_its_own_swings():
    """tau'_c0 is known to 2 % and I_A to 1 %, although the door is up to 10 % off the paper's."""
    case = hit.draw(1, 1)[6] | {"c_c_scale": 1.1, "k_c_scale": 0.95, "tau_scale": 0.9}
    config = hit.simulated_door(case)
    door, known = config.door(), hit.known_door(case, config)
    assert door.tau_c0_prime == pytest.approx(0.9 * PAPER.tau_c0_prime)
    assert (door.c_c, door.k_c) == pytest.approx((1.1 * PAPER.c_c, 0.95 * PAPER.k_c))
    assert known.door.tau_c0_prime == pytest.approx(door.tau_c0_prime, rel=0.02)
    assert known.door.i_a == pytest.approx(door.i_a, rel=0.01)


@pytest.mark.nightly("tests/test_hit.py looks closer at such a hit")
def test_hits_on_the_paper_s_door_open_it_to_25_deg():
    """Both are within 0.6 deg, with one contact and 20 mm of margin; the second has learned."""
    case = hit.draw(1, 1)[2] | {"engine": "mujoco"} | store.versions("mujoco")
    rows = running.run_case(case, hit.run)
    assert [row["learned_hits"] for row in rows] == [0, 1]
    for row in rows:
        assert abs(row["error_deg"]) < 0.6
        assert (row["stood"], row["contacts"]) == (True, 1)
        assert row["margin_mm"] > 20.0
        assert row["v_rb"] == pytest.approx(row["planned_v_rb"], rel=0.02)


def test_the_summary_of_hits_keeps_first_and_second_hits_apart():
    """Refused and missed hits are in no statistics; margins are those of each phase."""
    rows = rows_of("hit", 4, stood=True, contacts=1, margin_mm_cam=20.0, margin_mm=20.0)
    for row in rows:
        row["error_deg"] = 0.1 * (row["index"] + 1) * (-1) ** row["run"]
    perturbed = [row for row in rows if row["group"] == "perturbed"]
    perturbed[1] |= {"refused": "no posture", "stood": None, "error_deg": None, "contacts": None}
    perturbed[2] |= {"error_deg": None, "contacts": None, "margin_mm_cam": 11.0}
    perturbed[3] |= {"stood": False, "fell": "tilted", "contacts": 2}
    found = report.summary(KINDS["hit"], rows, 4, 1, "mujoco")
    assert (found["stood"], found["contacts_one"], found["refused"]) == (2, 1, 1)
    assert found["error_deg"] == pytest.approx(
        {"mean": 0.25, "sd": 0.3 / math.sqrt(2.0), "p95": 0.385, "max": 0.4})
    assert (found["before_learning"]["mean"], found["after_learning"]["mean"]) == (0.25, -0.25)
    assert found["min_margin_mm"]["cam"]["min"] == 11.0
    assert found["groups"]["perturbed, hit 1"]["stood"] == 2


def test_a_walk_arrives_within_2_percent_and_3_deg():
    """A turn is within 50 mm; a fall arrives nowhere."""
    ahead, turn = [5.0, 0.0, 0.0], [0.0, 0.0, 2.0 * math.pi]
    for off, yaw_deg, goal, stood, arrived in (
            (0.099, 2.9, ahead, True, True), (0.101, 0.0, ahead, True, False),
            (0.0, -3.1, ahead, True, False), (0.0, 0.0, ahead, False, False),
            (0.049, 0.0, turn, True, True), (0.051, 0.0, turn, True, False)):
        end = Pose(off, 0.0, math.radians(yaw_deg))
        assert arrival(end, goal, stood)["arrived"] is arrived


def test_a_pushed_walk_stands_only_after_every_blow_and_a_miss_only_of_the_paper_s_door():
    """Each blow, and the fast run-ups, have their own counts; a standing robot does not walk."""
    pushes, misses = (rows_of(kind, 3, stood=True, margin_mm=30.0) for kind in ("push", "miss"))
    for row in (pushes[1], pushes[-1], misses[7]):
        row |= {"stood": False, "margin_mm": -5.0, "announced": True}
    found = report.summary(KINDS["push"], pushes, 3, 1, "mujoco")
    assert (found["stood"], found["min_margin_mm"]["min"]) == (2, -5.0)
    assert [group["stood"] for group in found["groups"].values()] == [3, 2, 3, 3, 3, 3, 2]
    found = report.summary(KINDS["miss"], misses, 3, 1, "mujoco")
    assert (found["stood"], found["min_margin_mm"]["min"]) == (3, 30.0)
    assert (found["groups"]["fast"]["stood"], found["groups"]["fast"]["announced"]) == (2, 1)


def test_hits_and_probes_of_locked_doors_are_counted_apart():
    """A fall after a hit is none of the probe; half of the bolts have up to 3 mm of play."""
    rows = [row | {"run": way, "found": way == 1} for way in (0, 1)
            for row in rows_of("blocked", 4, stood=True) if row["group"] == "paper"]
    rows[0] |= {"stood": False, "fell": "tilted"}
    found = report.summary(KINDS["blocked"], rows, 4, 1, "mujoco")
    assert (found["stood"], found["found"]) == ({"hit": 3, "probe": 4}, 4)
    assert [group["stood"] for group in found["groups"].values()] == [3, 4]
    assert sum(0.0 < row["play_mm"] < 3.0 for row in rows) == len(rows) // 2


def test_a_door_that_is_passed_has_its_own_leaf_in_a_frame_that_fits():
    """Mass, inertia and frame grow with the leaf's width, and the planner knows them."""
    plain, case = load_door("size2"), next(
        case for case in passing.draw(4, 1) if case["door"] == "size2") | {"width": 1.0}
    door = passing.simulated_door(case)
    known = hit.known_door(case, door)
    assert door.leaf.mass / plain.leaf.mass == pytest.approx(1.0 / plain.leaf.width)
    assert door.i_a / plain.i_a == pytest.approx(plain.leaf.width**-3.0, rel=0.01)
    assert door.frame.width - 1.0 == pytest.approx(plain.frame.width - plain.leaf.width)
    assert (known.width, known.frame) == (1.0, (door.leaf, door.frame))
    hinges = [passing.simulated_door(case).hinge for case in passing.draw(8, 1)]
    assert hinges == 4 * ["right"] + 4 * ["left"]


def test_a_refused_passage_did_not_pass_but_a_robot_before_the_door_stands():
    """A refusal has no figures; a fall counts neither as passed nor as standing."""
    rows = rows_of("pass", 4, stood=True, passed=True, margin_mm=20.0)
    rows[0] |= {"refused": "no posture", "stood": None, "passed": None, "margin_mm": None}
    rows[1] |= {"stood": False, "passed": False, "fell": "tilted", "margin_mm": -3.0}
    rows[2] |= {"passed": False}
    found = report.summary(KINDS["pass"], rows, 4, 1, "mujoco")
    assert (found["stood"], found["passed"], found["refused"]) == (2, 1, 1)
    assert found["min_margin_mm"] == pytest.approx({"p5": -0.7, "min": -3.0})


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", KINDS)
def test_a_sweep_in_which_all_fell_or_failed_has_a_report(kind, tmp_path):
    """Summary, table and figure name every run; nothing is NaN."""
    rows = rows_of(kind, 1, stood=False, fell="tilted", tilt_deg=31.0)
    rows[0] |= {"error": "DivergedError: at 1 s", "stood": None, "fell": None, "tilt_deg": None}
    found = report.summary(KINDS[kind], rows, 1, 1, "mujoco")
    json.dumps(found, allow_nan=False)
    text = report.table(KINDS[kind], found)
    assert (text.count("fell: tilted"), text.count("error: Diverged")) == (len(rows) - 1, 1)
    report.draw(KINDS[kind], found["runs"], tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").stat().st_size > 5000
