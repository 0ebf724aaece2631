"""How a sweep is run, stored and resumed; but for one, its runs here take no time."""

import json
import os
import signal
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from door_impact_evaluation.errors import EvaluationError
from door_impact_evaluation.sweep import running, store, sweep
from door_impact_evaluation.sweep.walk import WALK, draw

ENGINE = "mujoco"


@pytest.fixture(scope="module")
def address():
    """Address of a cluster of one worker, which is started again when it dies."""
    with LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", memory_limit=None,
        dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False},
    ) as cluster:
        yield cluster.scheduler_address


def walks(folder, *, killed=None, failing=None):
    """Return a kind whose runs simulate nothing; each has a token of its own.

    The case `killed` ends its worker when it runs for the first time, as soon as there are rows;
    `failing` raises then.
    """
    def run(case, folder=str(folder)):
        mark = Path(folder, f"ran-{case['index']}")
        first = not mark.exists()
        mark.touch()
        if first and case["index"] == killed:
            while not Path(folder, "runs.parquet").exists():
                time.sleep(0.02)
            os.kill(os.getpid(), signal.SIGKILL)
        if first and case["index"] == failing:
            raise ValueError("a bad run")
        yield {"stood": True, "fell": "", "margin_mm": 30.0 + case["index"],
               "tilt_deg": float("nan"), "off_share": 0.1, "token": os.urandom(8).hex()}

    return replace(WALK, run=run)


def swept(kind, n, folder, address, seed=1):
    """Run a sweep; return its rows."""
    with closing(store.Runs(folder)) as runs:
        return running.run(kind, draw(n, seed), ENGINE, runs, address)


def stored(folder):
    """Read the rows of a file by pyarrow alone."""
    return pq.ParquetFile(folder / store.NAME).read().to_pylist()


def test_killed_workers_and_exceptions_cost_only_their_own_run(address, tmp_path):
    """A dead worker's run is done again at once, that of an exception by the next sweep."""
    kind = walks(tmp_path, killed=1, failing=2)
    rows = swept(kind, 4, tmp_path, address)
    assert [row["error"] for row in rows] == [None, None, "ValueError: a bad run", None]
    assert [row.get("margin_mm") for row in rows] == [30.0, 31.0, None, 33.0]
    assert len(stored(tmp_path)) == 4
    again = swept(kind, 4, tmp_path, address)
    assert again[2]["margin_mm"] == 32.0
    assert [row["token"] for row in again[:2] + again[3:]] == [
        row["token"] for row in rows[:2] + rows[3:]]


def test_an_interrupted_sweep_resumes_by_its_rows(address, tmp_path, monkeypatch):
    """Every finished run is in the file at once, and is not run again."""
    put = store.Runs.put

    def interrupted(self, key, rows):
        put(self, key, rows)
        if len(self.rows) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(store.Runs, "put", interrupted)
    with pytest.raises(KeyboardInterrupt):
        swept(walks(tmp_path), 5, tmp_path, address)
    done = {row["index"]: row["token"] for row in stored(tmp_path)}
    assert len(done) == 2
    rows = swept(walks(tmp_path), 5, tmp_path, address)
    assert [row["index"] for row in rows] == list(range(5))
    assert done.items() <= {row["index"]: row["token"] for row in rows}.items()


def test_rows_of_other_versions_or_cases_do_not_count(address, tmp_path, capsys):
    """They stay in the file, and the command says how many there are."""
    row, = swept(walks(tmp_path), 1, tmp_path, address, seed=2)
    with closing(store.Runs(tmp_path)) as runs:
        with pytest.raises(EvaluationError, match="another sweep"):
            store.Runs(tmp_path)  # it would lose the rows of the first
        runs.put("old", [row | {"id": "old", "numpy_version": "1.0"}])
    assert len(swept(walks(tmp_path), 2, tmp_path, address)) == 2
    assert "count: 1 of other versions, 1 of other cases" in capsys.readouterr().out
    assert len(stored(tmp_path)) == 4
    with pytest.raises(EvaluationError, match="numpy_version"):
        running.run_case(row | {"numpy_version": "1.0"}, WALK.run)


@pytest.mark.parametrize(("workers", "preload", "said"), [
    (0, "", "no worker for 1 s: start one"),
    (1, "import sys; sys.modules['door_impact_evaluation'] = None", "cannot run this.*No module"),
    (1, "import pinocchio; pinocchio.__version__ = '1.0'", "pinocchio_version.*the worker.*'1.0'"),
    (1, "import dask; dask.__version__ = '1.0'", "dask_version.*the worker.*'1.0'")])
def test_a_cluster_that_cannot_run_a_sweep_is_told_at_once(
        tmp_path, monkeypatch, workers, preload, said):
    """Without a worker, and with one that lacks the package or has another version."""
    (tmp_path / "first.py").write_text(preload)
    if not workers:
        monkeypatch.setattr(running, "_PATIENCE", 1.0)
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0",
        scheduler_kwargs={"dashboard": False}, preload=str(tmp_path / "first.py"),
    ) as cluster, pytest.raises(EvaluationError, match=said):
        swept(walks(tmp_path), 1, tmp_path, cluster.scheduler_address)


def test_the_same_walk_is_the_same_row_on_every_worker(address, tmp_path):
    """A walk of 0.2 m on slippery, soft soles stands and arrives; its row is equal bit for bit."""
    case = draw(1, 1)[0] | {"goal": [0.2, 0.0, 0.0], "friction": 0.5, "rubber_scale": 0.8}
    with closing(store.Runs(tmp_path)) as runs:
        row, = running.run(WALK, [case], ENGINE, runs, address)
    assert stored(tmp_path) == [row]
    assert running.run_case({name: row[name] for name in (
        "id", "kind", "engine", "robot", *case, *store.versions(ENGINE))}, WALK.run) == [row]
    assert (row["stood"], row["error"], row["refused"]) == (True, None, None)
    assert row["off_mm"] < 10.0
    assert abs(row["yaw_deg"]) < 1.0
    assert row["margin_mm"] > 15.0


def test_the_command_runs_on_this_machine_and_writes_its_files(tmp_path, monkeypatch, capsys):
    """They are runs.parquet, summary.json, report.txt and sweep.png; the table is printed, too."""
    monkeypatch.setitem(sweep.KINDS, "walk", walks(tmp_path))
    out = tmp_path / "deep" / "a=1"
    assert sweep.main(["--kind", "walk", "-n", "2", "--engine", ENGINE, "--out", str(out)]) == 0
    found = json.loads((out / "summary.json").read_text())
    assert (found["n"], found["seed"], found["engine"], found["stood"]) == (2, 1, ENGINE, 2)
    assert found["min_margin_mm"] == pytest.approx({"p5": 30.05, "min": 30.0})
    assert found["runs"] == sorted(stored(out), key=lambda row: row["index"])
    assert (out / "sweep.png").stat().st_size > 5000
    assert (out / "report.txt").read_text() in capsys.readouterr().out
