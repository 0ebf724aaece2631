"""Statistics, records and report of a sweep; nothing is simulated here."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from door_impact_evaluation.run.rehearsal import Rehearsal
from door_impact_evaluation.sweep import hit as hit_kind
from door_impact_evaluation.sweep import hit_report, numbers, replays, running, sweep
from door_impact_evaluation.sweep import hit_runs as hits
from door_impact_evaluation.sweep.hit import Hit
from door_impact_evaluation.sweep.hit_cases import hit_cases as cases
from door_impact_evaluation.sweep.kind import REPLAYS
from hrp2_sim_bridge.errors import SimulatorMissingError
from hrp2_sim_bridge.settings import ENGINES
from hypothesis import given
from hypothesis import strategies as st
from impact_planner.errors import AngleUnreachable
from impact_planner.task.experience import Experience
from impact_planner.task.settings import PlannerSettings

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


def test_statistics_of_one_and_of_none():
    """One error has no spread; without errors there are no statistics."""
    assert numbers.statistics([-0.5]) == {"mean": -0.5, "sd": 0.0, "p95": 0.5, "max": 0.5}
    assert numbers.statistics([]) == dict.fromkeys(STATISTICS)


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


def test_a_robot_that_fell_does_not_count_as_standing():
    """Only the first hits on perturbed doors are counted."""
    records = every(5)
    assert summary(records, 5, 1)["stood"] == 5
    for each in records:
        each["stood"] = each["name"] != "perturbed-2" and not each["name"].startswith("rough")
    assert summary(records, 5, 1)["stood"] == 4


class Rehearsed(Rehearsal):
    """A run with a hit that taught something."""

    def __init__(self, learned=None, impact=True):
        object.__setattr__(self, "impact", impact)
        object.__setattr__(self, "learned", lambda: learned)


def test_a_refused_case_keeps_what_came_before(monkeypatch):
    """If the second hit is refused, its reason stands after the first hit's figures."""
    case = cases(1, 1)[0]
    learned, asked = object(), []

    def rehearse(target, path, *, known, **_):
        asked.append(known)
        if len(asked) == 2:
            raise AngleUnreachable("too far")
        return Rehearsed(learned)

    monkeypatch.setattr(hits, "rehearse", rehearse)
    monkeypatch.setattr(hits, "measured", lambda run: {"error_deg": 0.2})
    monkeypatch.setattr(hits, "replace", lambda known, experience: experience)
    first, second = hits.run_case(case)
    assert (first["hit"], first["error_deg"]) == (0, 0.2)
    assert (second["hit"], second["refused"]) == (1, "too far")
    assert asked[1] is learned


@pytest.mark.parametrize("peak", [math.nan, 0.0, 3.0])
def test_a_hit_that_was_not_detected_teaches_nothing_and_ends_no_sweep(peak):
    """The same holds for a hit to an angle that the linkage does not allow."""
    plan = SimpleNamespace(initial_angle=0.0, effective_mass_model=58.0, l_b=0.42, v_rb=0.4,
                           v_com=0.34, braking=0.07, restitution=0.5, settings=PlannerSettings(),
                           hit=SimpleNamespace(transfer=SimpleNamespace(
                               model_restitution=0.44, restitution_slope=0.65)))
    execution = SimpleNamespace(measured=SimpleNamespace(
        peak_angle=peak, v_rb_post=math.nan, contact_delay=0.0, switch_latency=0.012))
    before = Experience(2, 0.9, 0.4, np.diag([1e-3, 1e-3]))
    known = replace(cases(1, 1)[0].known(), experience=before)
    assert Rehearsal(plan, execution, None, None, known).learned() is before
    execution.measured.peak_angle = 0.35
    assert Rehearsal(plan, execution, None, None, known).learned().hits == 3


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


def test_results_of_other_code_are_run_again_and_kept(ran, tmp_path, monkeypatch):
    """When the old code is back, its records are used again."""
    run(cases(1, 1), tmp_path)
    ran.clear()
    monkeypatch.setattr(running, "sources", lambda: "others")
    run(cases(1, 1), tmp_path)
    assert len(ran) == 8
    ran.clear()
    monkeypatch.setattr(running, "sources", lambda: "these")
    assert run(cases(1, 1), tmp_path) == every(1)
    assert ran == []


@pytest.mark.parametrize("left", [1, 30, -2, -1])
def test_an_incomplete_line_costs_that_case_alone(ran, tmp_path, left):
    """After a kill in the middle of a line, the next line that is written is not lost."""
    run(cases(1, 1), tmp_path)
    path = tmp_path / running.RECORD
    *lines, last = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines) + last[:left])
    lost = left != -1  # with -1 only the line's end is missing
    ran.clear()
    assert run(cases(1, 1), tmp_path) == every(1)
    assert len(ran) == lost
    ran.clear()
    run(cases(2, 1), tmp_path)
    assert ran == ["perturbed-1", "rough-1"]
    ran.clear()
    assert run(cases(2, 1), tmp_path) == every(2)
    assert ran == []


def test_an_engine_that_is_not_installed_is_named_and_nothing_is_recorded(
        ran, tmp_path, monkeypatch, capsys):
    """A refusal of the simulator is no refusal of the planner."""
    def missing(name):
        raise SimulatorMissingError("MuJoCo", "'pip install mujoco'")

    monkeypatch.setattr(sweep, "make_engine", missing)
    assert sweep.main(["-n", "1", "--engine", "mujoco", "--out", str(tmp_path / "out")]) == 1
    assert "needs MuJoCo" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_each_engine_has_its_own_folder_and_summary(ran, tmp_path, monkeypatch):
    """PyBullet's is out/sweep/; a sweep in one engine uses no records of the other."""
    monkeypatch.chdir(tmp_path)
    folders = {"pybullet": Path("out/sweep"), "mujoco": Path("out/sweep_hit_mujoco")}
    for engine, folder in folders.items():
        ran.clear()
        assert sweep.main(["-n", "1", "--engine", engine]) == 0
        assert len(ran) == 8
        assert json.loads((folder / "summary.json").read_text())["engine"] == engine
        assert engine in (folder / "report.txt").read_text()
        assert sweep.main(["-n", "1", "--engine", engine]) == 0
        assert len(ran) == 8
    ran.clear()
    assert sweep.main(["-n", "1", "--engine", "mujoco", "--out", str(folders["pybullet"])]) == 0
    assert len(ran) == 8


def test_a_case_is_run_in_the_engine_of_the_sweep(monkeypatch):
    """The engine reaches every hit of the case, besides the case's own settings."""
    asked = []

    def rehearse(target, path, **settings):
        asked.append(settings["engine"])
        return Rehearsed(impact=None)

    monkeypatch.setattr(hits, "rehearse", rehearse)
    monkeypatch.setattr(hits, "measured", lambda run: {})
    for engine in ENGINES:
        Hit().run(cases(1, 1)[0], engine)
    assert asked == [*ENGINES]


def test_an_interrupt_keeps_what_was_done(ran, tmp_path, monkeypatch, capsys):
    """The status is 130, and the next sweep runs only the cases that are missing."""
    keep = hit_kind.run_case

    def interrupted(case, engine):
        if len(ran) == 3:
            raise KeyboardInterrupt
        return keep(case, engine)

    monkeypatch.setattr(hit_kind, "run_case", interrupted)
    assert sweep.main(["-n", "1", "--out", str(tmp_path)]) == 130
    assert str(tmp_path) in capsys.readouterr().err
    monkeypatch.setattr(hit_kind, "run_case", keep)
    assert sweep.main(["-n", "1", "--out", str(tmp_path)]) == 0
    assert len(ran) == len(set(ran)) == 8


def test_the_digest_is_that_of_code_robot_and_doors(tmp_path, monkeypatch):
    """It is the same again, and another one if a robot's or door's file or a package differs."""
    before = running.sources()
    assert running.sources() == before
    other = tmp_path / "robot.yaml"
    other.write_text("mass: 1")
    monkeypatch.setattr(running, "robot_data", lambda name: other)
    assert running.sources() != before
    monkeypatch.undo()
    monkeypatch.setattr(running, "door_data", lambda name: tmp_path)
    assert running.sources() != before
    monkeypatch.undo()
    monkeypatch.setattr(running, "PACKAGES", running.PACKAGES[:-1])
    assert running.sources() != before


def test_the_command_writes_summary_report_and_figure(ran, tmp_path, capsys):
    """They are summary.json, report.txt and sweep.png; the table is printed, too."""
    assert sweep.main(["-n", "2", "--seed", "1", "--out", str(tmp_path / "deep")]) == 0
    found = json.loads((tmp_path / "deep" / "summary.json").read_text())
    assert found == summary(every(2), 2, 1)
    assert (tmp_path / "deep" / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "deep" / "report.txt").read_text() in capsys.readouterr().out


@given(errors=st.lists(st.floats(-9.0, 9.0) | st.just(REFUSED) | st.just(MISSED), min_size=12,
                       max_size=12), fallen=st.sets(st.integers(0, 11)))
def test_the_worst_runs_are_those_that_fell_missed_erred_or_nearly_tilted(errors, fallen):
    """Each is named once, with a reason, and nothing that was refused is among them."""
    records = [record(cases(12, 1)[6 + index], 0, error) for index, error in enumerate(errors)]
    for index in fallen:
        if errors[index] != REFUSED:
            records[index]["stood"] = False
    bad = Hit().worst(records)
    assert len({(run.name, run.number) for run in bad}) == len(bad) <= 7
    by_name = {each["name"]: each for each in records}
    assert not [run for run in bad if "refused" in by_name[run.name]]
    hit = [each for each in records if "error_deg" in each]
    largest = max((abs(each["error_deg"]) for each in hit), default=None)
    assert largest is None or largest in [
        abs(by_name[run.name].get("error_deg", 0.0)) for run in bad]
    lost = [each for each in records if "refused" not in each
            and not (each["stood"] and "error_deg" in each)]
    assert sum(by_name[run.name] in lost for run in bad) >= min(len(lost), hit_kind.FALLEN)


def test_replays_are_made_once_and_those_of_other_runs_are_removed(ran, tmp_path, monkeypatch):
    """A replay is made again if the code, the engine or the run is another."""
    assert sweep.main(["-n", "2", "--out", str(tmp_path)]) == 0
    listed = json.loads((tmp_path / "summary.json").read_text())["replays"]
    folder = tmp_path / REPLAYS
    assert {path.name for path in folder.iterdir()} == {run["file"] for run in listed} != set()
    made = []
    monkeypatch.setattr(replays, "make", made.append)
    (folder / "old-hit1.html").write_text(replays._MARK)
    (folder / "notes.html").write_bytes(b"\xff\xfe mine")
    assert sweep.main(["-n", "2", "--out", str(tmp_path)]) == 0
    assert made == []
    assert not (folder / "old-hit1.html").exists()
    assert (folder / "notes.html").exists()
    monkeypatch.setattr(running, "sources", lambda: "others")
    assert sweep.main(["-n", "2", "--out", str(tmp_path)]) == 0
    assert len(made) == len(listed)


@pytest.mark.parametrize(("arguments", "word"), [
    (["-n", "0"], "1 or more"), (["-n", "-3"], "1 or more"), (["--seed", "-1"], "0 or more"),
    (["-n", "many"], "many"), (["-n", "1.5"], "1.5"), (["--engine", "bullet"], "mujoco")])
def test_a_sweep_of_nothing_is_refused(ran, tmp_path, capsys, arguments, word):
    """The command ends with status 2 before anything is run or written."""
    with pytest.raises(SystemExit) as ended:
        sweep.main([*arguments, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert word in capsys.readouterr().err
    assert ran == []
    assert not list(tmp_path.iterdir())


def test_the_table_names_the_worst_runs_first(tmp_path):
    """They are sorted by error; refused and fallen ones follow, each once and with its causes."""
    records = every(9, perturbed_3=[-7.25], rough_2=[0.1, 6.5], perturbed_5=[REFUSED])
    for each in records:
        each["stood"] = each.get("stood", True) and each["name"] != "perturbed-3"
    table = hit_report.table(summary(records, 9, 1))
    worst = table.split("worst runs\n")[1].split("\n\nreplays")[0].splitlines()
    assert worst[0].startswith("  perturbed-3 hit 1: -7.25 deg, did not stand; door ")
    assert worst[1].startswith("  rough-2 hit 2: +6.50 deg")
    assert len(worst) == hit_report.WORST + 1
    assert worst[-1].startswith("  perturbed-5 hit 1: refused: no such posture")


EVERY = [f"{group}_{index}" for group in ("nominal", "perturbed", "rough") for index in range(6)]
ENDS = {
    "all went well": {},
    "all were refused": {name: [REFUSED] for name in EVERY},
    "all missed": {name: [MISSED] for name in EVERY},
    "the second hit on a nominal door was refused": {"nominal_0": [0.1, REFUSED]},
    "the second hit on a nominal door missed": {"nominal_0": [0.1, MISSED]},
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
def test_a_report_is_written_however_a_sweep_of_one_ended(tmp_path, ends):
    """Table, figure and summary.json are written, without a warning."""
    records = every(1, **ends)
    sweep.write(Hit(), summary(records, 1, 1), tmp_path)
    text = (tmp_path / "report.txt").read_text()
    assert "paper, 15 deg, mcv50" in text
    assert text.count("no such posture") >= sum("refused" in each for each in records)
    assert (tmp_path / "sweep.png").stat().st_size > 5000
    assert json.loads((tmp_path / "summary.json").read_text())["n"] == 1
    assert not list(tmp_path.glob("*.part"))


def test_a_contact_that_was_never_detected_does_not_cost_the_report(tmp_path):
    """The latency of such a hit is not known."""
    records = every(1)
    for each in records:
        each["switch_latency_ms"] = None
    sweep.write(Hit(), summary(records, 1, 1), tmp_path)
    assert (tmp_path / "sweep.png").exists()


def test_what_is_not_known_is_null_and_hides_no_worse_run(ran, tmp_path, monkeypatch):
    """A NaN in a record is written as null, sorted as the worst, and left out of statistics."""
    def with_nan(case, engine):
        records = made_up(case)
        if case.name == "perturbed-1":
            records[0] |= {"error_deg": math.nan, "switch_latency_ms": math.inf}
            records[0]["margin_mm"]["cam"] = math.nan
        return records

    monkeypatch.setattr(hit_kind, "run_case", with_nan)
    assert sweep.main(["-n", "3", "--out", str(tmp_path)]) == 0
    for file in ("summary.json", running.RECORD):
        assert "NaN" not in (tmp_path / file).read_text()
    found = json.loads((tmp_path / "summary.json").read_text())
    assert found["replays"][0]["name"] == "perturbed-1"
    assert "ZMP margin - mm in cam" in found["replays"][0]["why"]
    assert found["error_deg"] == pytest.approx(numbers.statistics([0.1, 0.3]))
    assert found["min_margin_mm"]["cam"]["min"] == pytest.approx(20.4)
    ran.clear()
    assert sweep.main(["-n", "3", "--out", str(tmp_path)]) == 0
    assert json.loads((tmp_path / "summary.json").read_text()) == found


def test_lines_that_are_no_records_are_left_out(tmp_path):
    """JSON of another form does not end the sweep."""
    path = tmp_path / running.RECORD
    path.write_text('null\n{"x": 1}\n[1]\n"digest"\n{"digest": "these"}\n')
    assert running.load_records(path, "these", "hit", "pybullet") == {}


def test_a_folder_that_cannot_be_made_is_reported_in_one_line(ran, tmp_path, capsys):
    """The file in its place stays, and no case is run."""
    out = tmp_path / "file"
    out.write_text("kept")
    assert sweep.main(["-n", "1", "--out", str(out)]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert out.read_text() == "kept"
    assert ran == []


def test_a_report_that_cannot_be_written_is_an_error_in_one_line(
        ran, tmp_path, monkeypatch, capsys):
    """The cases that were run until the disk was full are kept for the next sweep."""
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sweep, "write", full)
    assert sweep.main(["-n", "1", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().err.endswith("sweep: [Errno 28] No space left on device\n")
    assert len(ran) == len((tmp_path / running.RECORD).read_text().splitlines()) == 8
