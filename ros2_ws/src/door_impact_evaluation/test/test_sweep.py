"""Statistics, records and report of a sweep; nothing is simulated here."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from door_impact_evaluation.sweep import hit as hit_kind
from door_impact_evaluation.sweep import numbers, replays, running, sweep
from door_impact_evaluation.sweep.hit import Hit
from door_impact_evaluation.sweep.hit_cases import hit_cases as cases
from hypothesis import given
from hypothesis import strategies as st

PHASES = ("prepare", "cam", "post", "hold")
STATISTICS = {"mean", "sd", "p95", "max"}
CONTRACT = {"n", "seed", "engine", "stood", "error_deg", "after_learning", "min_margin_mm",
            "contacts_one", "runs"}
REFUSED, MISSED = "refused", "missed"


def record(case, hit, error):
    """Makes the record of a hit from its error [deg], `REFUSED` or `MISSED`."""
    found = {"name": case.name, "hit": hit, "case": json.loads(json.dumps(case.as_json()))}
    if error == REFUSED:
        return found | {"refused": "no such posture"}
    planned = {"v_rb": 0.4, "omega_door": 0.63, "effective_mass": 58.0, "restitution": 0.5,
               "impulse": 19.0, "learned_hits": hit}
    found |= {"outcome": "NO_CONTACT" if error == MISSED else "SUCCESS", "stood": True,
              "planned": planned}
    if error == MISSED:
        return found
    return found | {
        "peak_deg": 25.0 + error, "error_deg": error, "held_deg": 24.0, "contacts": 1,
        "margin_mm": {name: 20.0 + number + error for number, name in enumerate(PHASES)},
        "v_rb": 0.41, "omega_door": 0.63, "momentum_ratio": 1.01, "slip_mm": 1.0,
        "hand_force_n": 30.0, "switch_latency_ms": 12.0}


def made_up(case, errors=None):
    """Makes the records of a case; without `errors`, each case has its own."""
    errors = errors or [0.1 * (case.index + 1) * (-1) ** hit for hit in range(case.hits)]
    return [record(case, hit, error) for hit, error in enumerate(errors)]


def summary(records, n, seed, engine="pybullet"):
    """Makes the contents of summary.json."""
    return sweep.summary(Hit(), records, n, seed, engine, Hit().worst(records))


def run(wanted, out):
    """Runs cases in PyBullet."""
    return running.run(Hit(), wanted, out, "pybullet", running.sources())


def every(n, **special):
    """Makes the records of a sweep; `special` has the errors of some cases by `group_index`."""
    return [each for case in cases(n, 1)
            for each in made_up(case, special.get(case.name.replace("-", "_")))]


@given(st.lists(st.floats(-30.0, 30.0), min_size=2, max_size=40))
def test_statistics_are_those_of_a_textbook(errors):
    """They are the mean, the sample standard deviation, and 95 % and maximum of the sizes."""
    found = numbers.statistics(iter(errors))
    n = len(errors)
    mean = sum(errors) / n
    sizes = sorted(abs(each) for each in errors)
    place = 0.95 * (n - 1)
    low = min(int(place), n - 2)
    assert set(found) == STATISTICS
    assert found["mean"] == pytest.approx(mean, abs=1e-9)
    assert found["sd"] == pytest.approx(
        math.sqrt(sum((each - mean) ** 2 for each in errors) / (n - 1)), abs=1e-9)
    assert found["p95"] == pytest.approx(
        sizes[low] + (place - low) * (sizes[low + 1] - sizes[low]), abs=1e-9)
    assert found["max"] == sizes[-1]


def test_the_summary_has_the_contracts_keys_and_figures():
    """First and second hits are apart; refused and missed hits are in no statistics."""
    records = every(4, perturbed_1=[REFUSED], perturbed_2=[MISSED], rough_0=[0.7, REFUSED],
                    rough_3=[MISSED])
    for each in records:
        if each["name"] == "perturbed-3":
            each |= {"contacts": 2, "stood": False}
    found = summary(records, 4, 9)
    assert set(found) >= CONTRACT
    assert (found["n"], found["seed"], found["contacts_one"]) == (4, 9, 1)
    assert found["error_deg"] == pytest.approx(numbers.statistics([0.1, 0.4]))
    assert found["before_learning"] == pytest.approx(numbers.statistics([0.7, 0.2, 0.3]))
    assert found["after_learning"] == pytest.approx(numbers.statistics([-0.2, -0.3]))
    assert set(found["min_margin_mm"]) == set(PHASES)
    every_margin = [each["margin_mm"]["cam"] for each in records if "margin_mm" in each]
    assert found["min_margin_mm"]["cam"] == pytest.approx(
        {"p5": np.percentile(every_margin, 5), "min": min(every_margin)})
    assert found["refused"] == 2
    assert found["runs"] == records
    assert json.loads(json.dumps(found, allow_nan=False)) == found


class Pool:
    """A pool of processes that runs its tasks at once in this process."""

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def imap_unordered(self, task, arguments):
        """Returns the results of the tasks in their order."""
        return map(task, arguments)


@pytest.fixture
def ran(monkeypatch):
    """Returns the names of the cases that were run, in order."""
    names = []

    def run_case(case, engine):
        names.append(case.name)
        return made_up(case)

    monkeypatch.setattr(hit_kind, "run_case", run_case)
    monkeypatch.setattr(running, "get_context", lambda _: SimpleNamespace(Pool=Pool))
    monkeypatch.setattr(running, "sources", lambda: "these")
    monkeypatch.setattr(
        replays, "make", lambda order: order.path.write_text(
            f"{replays._MARK}{order.key} -->", encoding="utf-8"))
    return names


def test_what_was_run_before_is_not_run_again(ran, tmp_path):
    """A longer sweep runs only the new cases; its records are in the order of its cases."""
    run(cases(2, 1), tmp_path)
    assert len(ran) == 10
    ran.clear()
    found = run(cases(3, 1), tmp_path)
    assert ran == ["perturbed-2", "rough-2"]
    assert found == every(3)
    ran.clear()
    run(cases(3, 2), tmp_path)
    assert len(ran) == 6  # the cases of another seed; the nominal ones are the same


def test_the_command_writes_summary_report_and_figure(ran, tmp_path, capsys):
    """They are summary.json, report.txt and sweep.png; the table is printed, too."""
    assert sweep.main(["-n", "2", "--seed", "1", "--out", str(tmp_path / "deep")]) == 0
    found = json.loads((tmp_path / "deep" / "summary.json").read_text())
    assert found == summary(every(2), 2, 1)
    assert (tmp_path / "deep" / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "deep" / "report.txt").read_text() in capsys.readouterr().out
