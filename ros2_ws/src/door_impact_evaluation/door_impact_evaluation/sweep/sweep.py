"""Command ``sweep``: many hits on doors that differ from what the planner knows of them."""

import argparse
import hashlib
import json
import os
import signal
import sys
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_model.data import data_path as door_data
from hrp2_description.data import data_path as robot_data
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.settings import ENGINES, WorldSettings
from tqdm import tqdm

from door_impact_evaluation.sweep import replays
from door_impact_evaluation.sweep.cases import Case, cases
from door_impact_evaluation.sweep.hits import run_case

PACKAGES = ("door_encoder", "door_impact_common", "door_impact_evaluation", "door_model",
            "hrp2_description", "hrp2_sim_bridge", "humanoid_motion", "impact_planner")
ROBOT_FILES = ("config/robot.yaml", "config/hrp2_links.yaml", "urdf/hrp2.urdf")
RECORD = "runs.jsonl"
FOLDERS = {engine: Path("out/sweep") if engine == WorldSettings.engine
           else Path(f"out/sweep_hit_{engine}") for engine in ENGINES}
"""Folder of the results of each physics engine."""


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


def load_records(path: Path, digest: str, engine: str) -> dict[str, list[dict[str, Any]]]:
    """Reads the records of earlier runs of the same code in the same physics engine.

    Args:
        path: File of the records; it need not exist.
        digest: Digest of the code, as `sources` computes it.
        engine: The physics engine.

    Returns:
        The records by case; incomplete lines are left out.
    """
    found: dict[str, list[dict[str, Any]]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                entry = json.loads(line)
                if (entry["digest"], entry["engine"]) == (digest, engine):
                    found[json.dumps(entry["case"], sort_keys=True)] = entry["records"]
            except (json.JSONDecodeError, TypeError, KeyError):
                continue
    return found


def run(
    wanted: list[Case], out: Path, engine: str = WorldSettings.engine,
) -> list[dict[str, Any]]:
    """Runs the cases that have no records yet, as many at a time as there are cores.

    Args:
        wanted: The cases.
        out: Folder of the results; the records of each case are written as soon as it is done.
        engine: Physics engine of the simulation.

    Returns:
        The records of all cases, in their order.

    Raises:
        OSError: The folder cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    digest, path = sources(), out / RECORD
    done = load_records(path, digest, engine)
    keys = {case: json.dumps(case.as_json(), sort_keys=True) for case in wanted}
    missing = [case for case in wanted if keys[case] not in done]
    bar = tqdm(total=len(wanted), initial=len(wanted) - len(missing), unit="door",
               disable=not missing)
    with path.open("a", encoding="utf-8") as file, bar, _pool() as pool:
        if file.tell() and not path.read_bytes().endswith(b"\n"):
            file.write("\n")  # ends an incomplete line
        for case, records in pool.imap_unordered(partial(_with_case, engine), missing):
            done[keys[case]] = records
            entry = {"digest": digest, "engine": engine, "case": case.as_json(),
                     "records": records}
            file.write(json.dumps(entry) + "\n")
            file.flush()
            bar.update()
    return [record for case in wanted for record in done[keys[case]]]


def _pool() -> Any:
    """Makes a pool of processes, one for each core.

    Each process is a new interpreter, because PyBullet and its threads cannot be forked. After an
    interrupt the pool ends what is running.
    """
    return get_context("spawn").Pool(
        os.cpu_count(), signal.signal, (signal.SIGINT, signal.SIG_IGN))


def make_replays(
    bad: list[replays.BadRun], wanted: list[Case], out: Path, engine: str = WorldSettings.engine,
) -> None:
    """Makes a replay of each bad run that has none yet, and removes those of other runs.

    Args:
        bad: The bad runs.
        wanted: The cases of the sweep.
        out: Folder of the sweep's results.
        engine: Physics engine of the simulation.
    """
    orders = replays.orders(bad, wanted, out, engine, sources())
    with tqdm(total=len(orders), unit="replay", disable=not orders) as bar, _pool() as pool:
        for _ in pool.imap_unordered(replays.make, orders):
            bar.update()


def _with_case(engine: str, case: Case) -> tuple[Case, list[dict[str, Any]]]:
    return case, run_case(case, engine)


def statistics(errors: Iterable[float]) -> dict[str, float | None]:
    """Computes the mean and the standard deviation of errors, p95 and maximum of their sizes.

    Args:
        errors: Errors [deg].

    Returns:
        The statistics [deg]; each is None without errors.
    """
    found = np.array(list(errors))
    if not len(found):
        return dict.fromkeys(("mean", "sd", "p95", "max"))
    size = np.abs(found)
    return {"mean": float(found.mean()), "sd": float(found.std(ddof=1)) if len(found) > 1 else 0.0,
            "p95": float(np.percentile(size, 95.0)), "max": float(size.max())}


def summary(
    records: list[dict[str, Any]], n: int, seed: int, engine: str = WorldSettings.engine,
) -> dict[str, Any]:
    """Makes the contents of summary.json.

    Args:
        records: Records of all cases.
        n: Number of cases in each group.
        seed: Seed of the sweep.
        engine: Physics engine of the simulation.
    """
    def of(group: str, hit: int) -> list[dict[str, Any]]:
        return [r for r in records if r["case"]["group"] == group and r["hit"] == hit]

    def errors(group: str, hit: int) -> list[float]:
        return [r["error_deg"] for r in of(group, hit) if "error_deg" in r]

    first = of("perturbed", 0)
    hits = [r for r in records if "error_deg" in r]
    phases = list(dict.fromkeys(name for r in hits for name in r["margin_mm"]))
    margins = {name: np.array([r["margin_mm"][name] for r in hits if name in r["margin_mm"]])
               for name in phases}
    return {
        "n": n,
        "seed": seed,
        "engine": engine,
        "stood": sum(r.get("stood", False) for r in first),
        "error_deg": statistics(errors("perturbed", 0)),
        "after_learning": statistics(errors("rough", 1)),
        "before_learning": statistics(errors("rough", 0)),
        "refused": sum("refused" in r for r in records),
        "min_margin_mm": {name: {"p5": float(np.percentile(each, 5.0)), "min": float(each.min())}
                          for name, each in margins.items()},
        "contacts_one": sum(r.get("contacts") == 1 for r in first),
        "nominal": of("nominal", 0) + of("nominal", 1),
        "replays": [asdict(bad) for bad in replays.worst(records)],
        "runs": records,
    }


def main(args: list[str] | None = None) -> int:
    """Runs a sweep and writes its report.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0 when the sweep is complete, 1 if the engine is not installed or the folder cannot be
        written, 130 after Ctrl-C.
    """
    parser = argparse.ArgumentParser(
        prog="sweep", description="Hits perturbed doors in the simulation and reports how far they "
        "opened; cases that the same code has run before are not run again.")
    parser.add_argument("-n", type=int, default=50,
                        help="perturbed and rough doors, each (default: 50)")
    parser.add_argument("--seed", type=int, default=1,
                        help="seed of the random numbers (default: 1)")
    parser.add_argument("--engine", choices=ENGINES, default=WorldSettings.engine,
                        help=f"physics engine (default: {WorldSettings.engine})")
    folders = ", ".join(f"{folder} with {engine}" for engine, folder in FOLDERS.items())
    parser.add_argument("--out", type=Path, help=f"folder of the results (default: {folders})")
    options = parser.parse_args(args)
    out = options.out or FOLDERS[options.engine]
    if options.n < 1 or options.seed < 0:
        parser.error(f"-n is {options.n}, it must be 1 or more; --seed is {options.seed}, "
                     "it must be 0 or more")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        make_engine(options.engine)  # before anything is written
        wanted = cases(options.n, options.seed)
        records = run(wanted, out, options.engine)
        from door_impact_evaluation.sweep import report as sweep_report

        sweep_report.write(summary(records, options.n, options.seed, options.engine), out)
        make_replays(replays.worst(records), wanted, out, options.engine)
    except (DoorImpactError, OSError) as error:
        print(f"sweep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"sweep: interrupted; the cases that were done are kept in {out}",
              file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
