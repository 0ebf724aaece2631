"""The kinds walk, push and miss: cases, figures of made-up records, and short real sweeps."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from door_impact_evaluation.run.walk_run import PUSH_DURATION, plan_between
from door_impact_evaluation.sweep import miss, push, running, sweep, walk
from door_impact_evaluation.sweep.kind import REPLAYS
from door_impact_evaluation.sweep.numbers import plain
from hrp2_sim_bridge.errors import SimBridgeError
from hrp2_sim_bridge.settings import ENGINES
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from walking.errors import InvalidFootsteps
from walking.footsteps.footstep import Pose

NEW = ("walk", "push", "miss")
CONTRACT = {"n", "seed", "engine", "stood", "min_margin_mm", "runs"}
seeds = st.integers(0, 2**32)


def made_up(kind, case, number, *, stood=True, margin=30.0):
    """Makes a record as `kind` would."""
    found = {"name": case.name, "case": case.as_json(), "stood": stood,
             "fell": "" if stood else "tilted", "margin_mm": margin if stood else -40.0,
             "tilt_deg": 1.0 if stood else 31.0}
    if kind == "miss":
        reserve = 30.0 if stood else -5.0
        return found | {"miss": 0, "outcome": "NO_CONTACT", "missed_margin_mm": reserve,
                        "announced": reserve < 0.0, "v_rb": 0.4}
    end = {"ahead_mm": 3.0, "left_mm": 4.0, "yaw_deg": -1.0}
    found |= {"end": end if stood else None, "off_mm": 5.0 if stood else None,
              "speed_share": 0.6, "steps": 8, "planned_margin_mm": 58.0, "changed_steps": 0}
    if kind == "walk":
        return found | {"walk": 0}
    blow = push.BLOWS[number]
    return found | {"blow": number, "kind": blow.name, "impulse": blow.impulse, "at_s": 2.0,
                    "step_change": blow.step_change, "swing": "left", "outward": 0.3}


def every(kind, n, change=None):
    """Makes the records of a sweep; `change` maps names of cases to options of `made_up`."""
    runs = range(len(push.BLOWS) if kind == "push" else 1)
    return [made_up(kind, case, number, **(change or {}).get(case.name, {}))
            for case in sweep.KINDS[kind].cases(n, 1) for number in runs]


def summary(kind, records, n):
    """Makes the contents of summary.json."""
    of = sweep.KINDS[kind]
    return sweep.summary(of, records, n, 1, "mujoco", of.worst(records))


@pytest.mark.parametrize("kind", NEW)
@given(n=st.integers(1, 9), more=st.integers(0, 9), seed=seeds)
@settings(phases=[Phase.generate], max_examples=20)  # a seed has nothing to shrink
def test_a_longer_sweep_contains_the_shorter_ones_cases(kind, n, more, seed):
    """The same seed draws the same cases, with a name and noise of their own."""
    draw = sweep.KINDS[kind].cases
    short, long = draw(n, seed), draw(n + more, seed)
    assert draw(n, seed) == short
    assert set(short) <= set(long)
    assert len({case.name for case in long}) == len(long)
    assert len({case.seed for case in long}) == len(long)
    assert not {case.seed for case in long} & {case.seed for case in draw(n, seed + 1)}


@given(seeds)
@settings(phases=[Phase.generate], max_examples=20)
def test_walks_are_drawn_from_the_whole_of_their_ranges(seed):
    """Every goal, both sides, every heading, starts up to 10 m away, slippery floors."""
    cases = walk.walk_cases(200, seed)
    for values, low, high in (
            ([case.friction for case in cases], 0.4, 1.0),
            ([case.rubber_scale for case in cases], 0.7, 1.3),
            ([case.start[2] for case in cases], -math.pi, math.pi)):
        edge = 0.2 * (high - low)
        assert low <= min(values) < low + edge < high - edge < max(values) <= high
    away = [math.hypot(*case.start[:2]) for case in cases]
    assert max(away) <= 10.0
    assert max(away) > 8.0
    assert {case.goal for case in cases} == {
        (5.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, -2.0, 0.0),
        (0.0, 0.0, 2.0 * math.pi), (0.0, 0.0, -2.0 * math.pi)} | {(5.0, -0.0, -0.0)}


@given(seeds)
@settings(phases=[Phase.generate], max_examples=20)
def test_misses_are_drawn_up_to_30_deg_for_every_door(seed):
    """The paper's door by the paper's run-up, others by the fastest one."""
    cases = miss.miss_cases(200, seed)
    assert all(10.0 <= case.target_deg <= 30.0 for case in cases)
    assert max(case.target_deg for case in cases if case.group == "paper") > 26.0
    assert {(case.door, case.run_up) for case in cases} == {
        ("paper", "mcv50"), ("size2", "zmp_limited"), ("size3", "zmp_limited")}


def test_blows_are_in_the_middle_of_a_single_support_of_a_random_step():
    """Their size and direction are the stated ones, as the walking robot sees them."""
    robot, steps, turned = walk.walker(), set(), 0.7
    plans = {}
    for case in push.push_cases(24, 3):
        start = Pose(1.0, 2.0, turned)
        if case.goal not in plans:
            plans[case.goal] = plan_between(
                robot, start, start.moved(*case.goal), keep_heading=True)
        plan = plans[case.goal]
        for number, blow in enumerate(push.BLOWS):
            found, swing = push.push_of(case, plan, number)
            middle = found.at_s + 0.5 * PUSH_DURATION
            phase = next(phase for phase in plan.schedule.phases
                         if phase.last * plan.schedule.period > middle)
            assert (phase.kind, phase.swing) == ("single", swing)
            assert middle == pytest.approx(
                0.5 * (phase.first + phase.last) * plan.schedule.period)
            assert math.hypot(*found.impulse) == pytest.approx(blow.impulse)
            seen = np.array(Pose(*found.impulse[:2], 0.0).seen_from(Pose(0.0, 0.0, turned)))[:2]
            assert seen == pytest.approx(blow.impulse * np.array(
                [math.cos(case.directions[number]), math.sin(case.directions[number])]))
            if number < 2:  # fore and aft, sideways
                assert abs(seen[1 - number]) < 1e-9
            steps.add((case.group, phase.step))
    assert len(steps) > 8


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", NEW)
@pytest.mark.parametrize("ended", ["stood", "fell", "refused", "unknown"])
def test_summary_table_and_figure_however_a_sweep_of_two_ended(kind, ended, tmp_path):
    """The contract's keys are there, nothing is NaN, and what fell or is unknown has a replay."""
    records = every(kind, 2, {} if ended == "stood" else {
        case.name: {"stood": ended != "fell"} for case in sweep.KINDS[kind].cases(2, 1)})
    if ended == "refused" and kind != "push":
        records = [{key: r[key] for key in ("name", kind, "case")}
                   | {"stood": False, "refused": "too far"} for r in records]
    if ended == "unknown":
        records[0] |= {"margin_mm": math.nan}
    records = plain(records)
    found = summary(kind, records, 2)
    assert set(found) >= CONTRACT
    assert set(found["min_margin_mm"]) == {"p5", "min"}
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    sweep.write(sweep.KINDS[kind], found, tmp_path)
    assert (tmp_path / "sweep.png").stat().st_size > 5000
    text = (tmp_path / "report.txt").read_text()
    if ended == "fell":
        assert found["stood"] == 0
        assert text.count("fell: tilted") >= len(records)
        assert all("fell: tilted" in bad["why"] for bad in found["replays"])
        assert found["min_margin_mm"]["min"] == -40.0
    elif ended == "refused" and kind != "push":
        assert found["stood"] == 0
        assert found["replays"] == []
        assert text.count("refused: too far") == len(records)
    else:
        assert found["stood"] == 2
        assert found["min_margin_mm"] == {"p5": 30.0, "min": 30.0}
    if ended == "unknown":
        assert found["replays"][0]["name"] == records[0]["name"]
        assert "ZMP margin - mm" in found["replays"][0]["why"]


def test_a_walk_arrives_within_2_percent_and_3_deg():
    """A turn is within 50 mm; a fall arrives nowhere."""
    records = every("walk", 6, {"turn-2": {"stood": False}})
    records[0] |= {"off_mm": 100.1}
    records[1] |= {"off_mm": 39.0}
    records[3] |= {"end": {**records[3]["end"], "yaw_deg": -3.1}}
    records[5] |= {"off_mm": 49.0}
    found = summary("walk", records, 6)
    assert (found["stood"], found["arrived"]) == (5, 3)
    assert {group: row["arrived"] for group, row in found["walks"].items()} == {
        "ahead": 0, "sideways": 2, "turn": 1}
    assert found["walks"]["ahead"]["off_mm"]["max"] == 100.1


def test_a_case_of_pushes_stands_only_after_every_blow():
    """Each blow has its own count."""
    records = every("push", 3)
    records[1] |= {"stood": False, "fell": "tilted"}
    found = summary("push", records, 3)
    assert found["stood"] == 2
    assert [row["stood"] for row in found["blows"].values()] == [3, 2, 3]
    assert sum(row["n"] for row in found["blows"].values()) == len(records)


def test_falls_that_no_plan_announced_are_named_first():
    """A fall by a fast run-up is no failure if the plan said so."""
    records = every("miss", 5, {f"fast-{k}": {"stood": False} for k in range(4)})
    records[9] |= {"stood": False, "fell": "tilted", "announced": False, "missed_margin_mm": 4.0}
    found = summary("miss", records, 5)
    assert found["stood"] == 5
    fast = found["fast"]
    assert (fast["stood"], fast["fell"], fast["announced"]) == (0, 5, 4)
    assert fast["unannounced"] == ["fast-4"]
    assert found["replays"][0]["name"] == "fast-4"
    assert "not announce" in found["replays"][0]["why"]


@pytest.mark.parametrize("kind", ["walk", "miss"])
def test_a_refused_plan_is_recorded_and_a_failed_simulation_is_not(kind, monkeypatch):
    """The sweep goes on after the one, and ends with the other."""
    def fails(error):
        def run(*_):
            raise error
        return run

    module, of = {"walk": (walk, "_walked"), "miss": (miss, "_missed")}[kind]
    case = sweep.KINDS[kind].cases(1, 1)[0]
    monkeypatch.setattr(module, of, fails(InvalidFootsteps("no way")))
    record, = sweep.KINDS[kind].run(case, "mujoco")
    assert (record["refused"], record["stood"]) == ("no way", False)
    monkeypatch.setattr(module, of, fails(SimBridgeError("diverged")))
    with pytest.raises(SimBridgeError):
        sweep.KINDS[kind].run(case, "mujoco")


@pytest.fixture
def short(monkeypatch):
    """Short walks, and a pool of processes that runs its tasks in this process."""
    class Pool:
        def __init__(self, *_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def imap_unordered(self, task, arguments):
            return map(task, arguments)

    monkeypatch.setattr(running, "get_context", lambda _: SimpleNamespace(Pool=Pool))
    monkeypatch.setattr(walk, "GOALS", {"ahead": (0.2, 0.0, 0.0), "sideways": (0.0, 0.15, 0.0)})
    monkeypatch.setattr(push, "GOALS", {"ahead": (0.2, 0.0)})


def swept(kind, engine, folder):
    """Runs a sweep of one case; returns its summary."""
    assert sweep.main(["--kind", kind, "-n", "1", "--seed", "2", "--engine", engine,
                       "--out", str(folder)]) == 0
    return json.loads((folder / "summary.json").read_text())


@pytest.mark.parametrize("engine", ENGINES)
def test_a_sweep_of_a_short_walk(short, tmp_path, engine, monkeypatch):
    """It stands, it arrives, its worst run has a replay, and it is not run again."""
    found = swept("walk", engine, tmp_path)
    assert (found["stood"], found["n"], found["engine"]) == (1, 1, engine)
    assert found["min_margin_mm"]["min"] > 15.0
    run = found["runs"][0]
    assert run["off_mm"] < 10.0
    assert abs(run["end"]["yaw_deg"]) < 1.0
    assert run["tilt_deg"] < 2.0
    pages = {path.name for path in (tmp_path / REPLAYS).iterdir()}
    assert pages == {bad["file"] for bad in found["replays"]} == {"ahead-0-walk1.html"}
    monkeypatch.setattr(walk, "_walked", None)
    assert swept("walk", engine, tmp_path) == found


@pytest.mark.nightly("three walks")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_sweep_of_blows_at_a_short_walk(short, tmp_path, engine):
    """Each blow has a run of its own, and tilts the robot more than the walk alone does."""
    found = swept("push", engine, tmp_path)
    assert [run["kind"] for run in found["runs"]] == [blow.name for blow in push.BLOWS]
    assert [row["n"] for row in found["blows"].values()] == [1, 1, 1]
    assert min(run["tilt_deg"] for run in found["runs"]) > 0.5
    assert not any(run["changed_steps"] for run in found["runs"] if not run["step_change"])
    assert found["runs"][-1]["changed_steps"] > 0


@pytest.mark.nightly("two hits")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_sweep_of_missed_hits(short, tmp_path, engine):
    """The robot meets nothing; a fall of the paper's run-up, if any, was announced."""
    found = swept("miss", engine, tmp_path)
    assert [run["name"] for run in found["runs"]] == ["paper-0", "fast-0"]
    for group in miss.GROUPS:
        row = found[group]
        assert row["stood"] + row["fell"] + row["refused"] == row["n"] == 1
        assert row["unannounced"] == []


def test_every_kind_has_a_folder_of_its_own():
    """The hit's in PyBullet is out/sweep, as the contract has it."""
    folders = {(kind, engine): str(sweep.folder_of(kind, engine))
               for kind in sweep.KINDS for engine in ENGINES}
    assert len(set(folders.values())) == len(folders) == 8
    assert folders["hit", "pybullet"] == "out/sweep"
    assert folders["hit", "mujoco"] == "out/sweep_hit_mujoco"
    assert folders["walk", "pybullet"] == "out/sweep_walk_pybullet"
