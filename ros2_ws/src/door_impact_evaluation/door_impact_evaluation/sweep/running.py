"""Runs the cases of a sweep in parallel processes, and resumes where an earlier sweep ended."""

import hashlib
import json
import os
import signal
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from door_model.data import data_path as door_data
from hrp2_description.data import data_path as robot_data
from tqdm import tqdm

from door_impact_evaluation.sweep import replays
from door_impact_evaluation.sweep.kind import BadRun, Case, Kind, Record
from door_impact_evaluation.sweep.numbers import plain

PACKAGES = ("door_encoder", "door_impact_common", "door_impact_evaluation", "door_model",
            "hrp2_description", "hrp2_sim_bridge", "humanoid_motion", "impact_planner", "walking")
ROBOT_FILES = ("config/robot.yaml", "config/hrp2_links.yaml", "urdf/hrp2.urdf")
RECORD = "runs.jsonl"


def sources() -> str:
    """Computes a digest of all code, of the robot and of the doors.

    Records with another digest are of other code; a sweep runs their cases anew.
    """
    digest = hashlib.sha256()
    for package in PACKAGES:
        folder = Path(str(import_module(package).__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.read_bytes())
    doors = sorted(door_data("doors").glob("*.yaml"))
    for path in (*map(robot_data, ROBOT_FILES), *doors):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def load_records(path: Path, digest: str, kind: str, engine: str) -> dict[str, list[Record]]:
    """Reads the records of earlier runs of the same code in the same physics engine.

    Args:
        path: File of the records; it need not exist.
        digest: Digest of the code, as `sources` computes it.
        kind: Kind of the sweep.
        engine: The physics engine.

    Returns:
        The records by case; incomplete lines are left out.
    """
    found: dict[str, list[Record]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                entry = json.loads(line)
                if (entry["digest"], entry["kind"], entry["engine"]) == (digest, kind, engine):
                    found[_key(entry["case"])] = entry["records"]
            except (json.JSONDecodeError, TypeError, KeyError):
                continue
    return found


def run(kind: Kind, wanted: list[Case], out: Path, engine: str, digest: str) -> list[Record]:
    """Runs the cases that have no records yet, as many at a time as there are cores.

    Args:
        kind: Kind of the sweep.
        wanted: The cases.
        out: Folder of the results; the records of each case are written as soon as it is done.
        engine: Physics engine of the simulation.
        digest: Digest of the code, as `sources` computes it.

    Returns:
        The records of all cases, in their order.

    Raises:
        OSError: The folder cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    path = out / RECORD
    done = load_records(path, digest, kind.name, engine)
    keys = {case: _key(case.as_json()) for case in wanted}
    missing = [case for case in wanted if keys[case] not in done]
    bar = tqdm(total=len(wanted), initial=len(wanted) - len(missing), unit=kind.unit,
               disable=not missing)
    with path.open("a", encoding="utf-8") as file, bar, _pool() as pool:
        if file.tell() and not path.read_bytes().endswith(b"\n"):
            file.write("\n")  # ends an incomplete line
        for case, records in pool.imap_unordered(partial(_with_case, kind, engine), missing):
            done[keys[case]] = records
            entry = {"digest": digest, "kind": kind.name, "engine": engine,
                     "case": case.as_json(), "records": records}
            file.write(json.dumps(entry, allow_nan=False) + "\n")
            file.flush()
            bar.update()
    return [record for case in wanted for record in done[keys[case]]]


def make_replays(
    kind: Kind, bad: list[BadRun], wanted: list[Case], out: Path, engine: str, digest: str
) -> None:
    """Makes a replay of each bad run that has none yet, and removes those of other runs.

    Args:
        kind: Kind of the sweep.
        bad: The bad runs.
        wanted: The cases of the sweep.
        out: Folder of the sweep's results.
        engine: Physics engine of the simulation.
        digest: Digest of the code, as `sources` computes it.
    """
    orders = replays.orders(kind, bad, wanted, out, engine, digest)
    with tqdm(total=len(orders), unit="replay", disable=not orders) as bar, _pool() as pool:
        for _ in pool.imap_unordered(replays.make, orders):
            bar.update()


def _pool() -> Any:
    """Makes a pool of processes, one for each core.

    Each process is a new interpreter, because PyBullet and its threads cannot be forked. After an
    interrupt the pool ends what is running.
    """
    return get_context("spawn").Pool(
        os.cpu_count(), signal.signal, (signal.SIGINT, signal.SIG_IGN))


def _with_case(kind: Kind, engine: str, case: Case) -> tuple[Case, list[Record]]:
    return case, plain(kind.run(case, engine))


def _key(case: dict[str, Any]) -> str:
    return json.dumps(case, sort_keys=True)
