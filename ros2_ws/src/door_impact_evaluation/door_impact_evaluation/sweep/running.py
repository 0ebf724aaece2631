"""Run the cases of a sweep on a cluster of Dask, and resume where an earlier sweep ended."""

import hashlib
import json
import logging
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed
from humanoid_motion.errors import HumanoidMotionError
from impact_planner.errors import PlannerError
from tqdm import tqdm
from walking.errors import WalkingError

from door_impact_evaluation.errors import EvaluationError
from door_impact_evaluation.sweep.kind import Kind, Row
from door_impact_evaluation.sweep.store import Runs, versions

_PATIENCE = 20.0  # time in which a cluster must have a worker [s]
REFUSALS = (PlannerError, WalkingError, HumanoidMotionError)  # of plans, results like others


def run(
    kind: Kind, cases: list[Row], engine: str, runs: Runs, address: str = "", robot: str = "",
) -> list[Row]:
    """Run the cases that have no rows yet, or one with an error.

    Args:
        kind: Kind of the sweep.
        cases: The cases.
        engine: Physics engine of the simulation.
        runs: The rows that there are; those of each case are written as soon as it is done.
        address: Address of the cluster's scheduler; if it is empty, this machine's cores run.
        robot: The robot's robot.yaml; empty means HRP-2.

    Returns:
        The rows of all cases, in their order.

    Raises:
        EvaluationError: There is no cluster or no worker, or one has other versions or lacks this
            program.
        OutputError: The rows cannot be written.
    """
    here, wanted = versions(engine), {}
    for case in cases:
        columns = {"kind": kind.name, "engine": engine, "robot": robot, **case, **here}
        key = hashlib.sha256(json.dumps(columns, sort_keys=True).encode()).hexdigest()[:16]
        wanted[key] = {"id": key, **columns}
    others = [row for key, rows in runs.rows.items() if key not in wanted for row in rows]
    old = sum(any(row.get(name) != here[name] for name in here) for row in others)
    if others:
        print(f"{len(others)} rows of {runs.path} do not count: {old} of other versions, "
              f"{len(others) - old} of other cases")
    missing = [case for key, case in wanted.items() if key not in runs.rows or any(
        row["error"] for row in runs.rows[key])]
    if missing:
        with (tqdm(total=len(wanted), initial=len(wanted) - len(missing), unit="case") as bar,
              _connected(address, engine) as client):
            # Not pure: a scheduler that lives on would answer with the results of another sweep.
            tasks = client.map(run_case, missing, run=kind.run, pure=False)
            cases_of = dict(zip(tasks, missing, strict=True))
            for task in as_completed(tasks, loop=client.loop):
                runs.put(cases_of[task]["id"], _result(task, cases_of[task]))
                task.release()  # else the case would be run again when its worker dies
                bar.update()
    return [row for key in wanted for row in runs.rows[key]]


def run_case(case: Row, run: Callable[[Row], Iterator[Row]]) -> list[Row]:
    """Simulate a case; this is what a worker does.

    Args:
        case: The first columns of its rows, versions included.
        run: `Kind.run`.

    Returns:
        One row for each run. An exception ends the case, and is told in its last row.

    Raises:
        EvaluationError: The versions are not those of this worker.
    """
    _require_same(case, versions(case["engine"]), "a worker")
    found: list[Row] = []
    try:
        for measured in run(case):
            found.append(measured)
    except Exception as error:
        found.append({"refused": str(error)} if isinstance(error, REFUSALS) else _failure(error))
    return [_row(case, number, measured) for number, measured in enumerate(found)]


def _installed(engine: str) -> Row:
    return {**versions(engine), "dask_version": dask.__version__}


def _require_same(wanted: Row, here: Row, worker: str) -> None:
    if other := {name: wanted[name] for name in here if wanted[name] != here[name]}:
        raise EvaluationError(
            f"this sweep is of {other}, {worker} has { {name: here[name] for name in other} }")


def _row(case: Row, number: int, measured: Row) -> Row:
    return {**case, "run": number, "refused": None, "error": None, **{  # JSON has no NaN
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in measured.items()}}


def _failure(error: Exception) -> Row:
    return {"error": f"{type(error).__name__}: {error}"}


def _result(task: Future, case: Row) -> list[Row]:
    """Return the rows of a task that ended; of one that ends every worker, one with an error."""
    try:
        return list(task.result())
    except KilledWorker as error:
        return [_row(case, 0, _failure(error))]
    except EvaluationError:
        raise
    except Exception as error:
        raise EvaluationError(f"the cluster cannot run this: {_failure(error)['error']}") from error


@contextmanager
def _connected(address: str, engine: str) -> Iterator[Client]:
    """Connect to a cluster, or start one on this machine: a process of one thread on each core.

    Its processes are new interpreters, because PyBullet and its threads cannot be forked.
    """
    if address:
        try:
            client = Client(address, set_as_default=False)
        except (OSError, ValueError) as error:
            raise EvaluationError(f"there is no cluster at {address}: {error}") from error
        with client:
            try:
                client.wait_for_workers(1, timeout=_PATIENCE)
            except TimeoutError as error:
                raise EvaluationError(
                    f"the cluster at {address} has had no worker for {_PATIENCE:g} s: start one by "
                    f"`dask worker {address}`") from error
            # A task that a worker cannot import, or read, would wait there for ever.
            for worker, found in client.run(_installed, engine, on_error="return").items():
                if isinstance(found, Exception):
                    raise EvaluationError(
                        f"the worker {worker} cannot run this: {found}; is this project there?")
                _require_same(_installed(engine), found, f"the worker {worker}")
            yield client
        return
    dask.config.set({"distributed.comm.timeouts.connect": "120s",  # a loaded machine starts slowly
                     "distributed.scheduler.worker-saturation": 1.0})  # a dead worker had one case
    with LocalCluster(
        n_workers=os.cpu_count(), threads_per_worker=1, host="127.0.0.1", memory_limit=None,
        # Without a dashboard its port is opened all the same, by default a fixed one.
        dashboard_address="127.0.0.1:0", scheduler_kwargs={"dashboard": False},
        silence_logs=logging.CRITICAL,  # what happens is told by rows and errors
    ) as cluster, Client(cluster, set_as_default=False) as client:
        yield client
