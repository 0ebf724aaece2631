"""The kinds walk, push and miss: cases, figures of made-up records, and short real sweeps."""

import json
import math
from types import SimpleNamespace

import pytest
from door_impact_evaluation.sweep import push, running, sweep, walk
from door_impact_evaluation.sweep.kind import REPLAYS
from door_impact_evaluation.sweep.numbers import plain
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

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
@settings(phases=[Phase.generate], max_examples=5)  # a seed has nothing to shrink
def test_a_longer_sweep_contains_the_shorter_ones_cases(kind, n, more, seed):
    """The same seed draws the same cases, with a name and noise of their own."""
    draw = sweep.KINDS[kind].cases
    short, long = draw(n, seed), draw(n + more, seed)
    assert draw(n, seed) == short
    assert set(short) <= set(long)
    assert len({case.name for case in long}) == len(long)
    assert len({case.seed for case in long}) == len(long)
    assert not {case.seed for case in long} & {case.seed for case in draw(n, seed + 1)}


def test_walks_are_drawn_from_the_whole_of_their_ranges():
    """Every goal, both sides, every heading, starts up to 10 m away, slippery floors."""
    cases = walk.walk_cases(200, 1)
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


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", NEW)
def test_summary_table_and_figure_of_a_sweep_in_which_all_fell(kind, tmp_path):
    """The contract's keys are there, nothing is NaN, and what fell has a replay."""
    records = plain(every(kind, 2, {
        case.name: {"stood": False} for case in sweep.KINDS[kind].cases(2, 1)}))
    found = summary(kind, records, 2)
    assert set(found) >= CONTRACT
    assert set(found["min_margin_mm"]) == {"p5", "min"}
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    sweep.write(sweep.KINDS[kind], found, tmp_path)
    assert (tmp_path / "sweep.png").stat().st_size > 5000
    assert found["stood"] == 0
    assert (tmp_path / "report.txt").read_text().count("fell: tilted") >= len(records)
    assert all("fell: tilted" in bad["why"] for bad in found["replays"])
    assert found["min_margin_mm"]["min"] == -40.0


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


def swept(kind, folder):
    """Runs a sweep of one case; returns its summary."""
    assert sweep.main(["--kind", kind, "-n", "1", "--seed", "2", "--engine", "mujoco",
                       "--out", str(folder)]) == 0
    return json.loads((folder / "summary.json").read_text())


@pytest.mark.nightly("a walk and its replay")
def test_a_sweep_of_a_short_walk(short, tmp_path):
    """It stands, it arrives, and its worst run has a replay."""
    found = swept("walk", tmp_path)
    assert (found["stood"], found["n"], found["engine"]) == (1, 1, "mujoco")
    assert found["min_margin_mm"]["min"] > 15.0
    run = found["runs"][0]
    assert run["off_mm"] < 10.0
    assert abs(run["end"]["yaw_deg"]) < 1.0
    assert run["tilt_deg"] < 2.0
    pages = {path.name for path in (tmp_path / REPLAYS).iterdir()}
    assert pages == {bad["file"] for bad in found["replays"]} == {"ahead-0-walk1.html"}
