"""Command ``sweep``: many hits on doors that differ from what the planner knows of them."""

import argparse
import hashlib
import json
import os
import signal
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_model.data import data_path as door_data
from hrp2_description.data import data_path as robot_data
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.errors import SimBridgeError
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.settings import ENGINES, WorldSettings
from tqdm import tqdm

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.sweep.cases import Case, cases

PACKAGES = ("door_encoder", "door_impact_common", "door_impact_evaluation", "door_model",
            "hrp2_description", "hrp2_sim_bridge", "humanoid_motion", "impact_planner")
ROBOT_FILES = ("config/robot.yaml", "config/hrp2_links.yaml", "urdf/hrp2.urdf")
RECORD = "runs.jsonl"
FOLDERS = {engine: Path("out/sweep") if engine == WorldSettings.engine
           else Path(f"out/sweep_hit_{engine}") for engine in ENGINES}
"""Folder of the results of each physics engine."""
UPRIGHT = np.radians(5.0)  # tilt at the end below which the robot counts as standing [rad]
HELD_OVER = 0.5            # time at the end over which the held angle is averaged [s]


def run_case(case: Case, engine: str = WorldSettings.engine) -> list[dict[str, Any]]:
    """Runs the hits of a case.

    Args:
        case: The case.
        engine: Physics engine of the simulation.

    Returns:
        One record for each hit. A refused plan or a miss is the last.
    """
    known = case.known()
    records: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for hit in range(case.hits):
            record: dict[str, Any] = {"name": case.name, "hit": hit, "case": case.as_json()}
            try:
                run = rehearse(
                    case.target_deg, Path(folder) / "log.npz", door=case.config(), known=known,
                    door_offset=case.door_offset, run_up=case.run_up, engine=engine,
                    **case.world(hit))
            except SimBridgeError:  # no refusal of the planner, and no result
                raise
            except DoorImpactError as error:
                return [*records, record | {"refused": str(error)}]
            records.append(record | measured(run))
            if run.impact is None:
                break
            known = replace(known, experience=run.learned())
    return records


def measured(run: Rehearsal) -> dict[str, Any]:
    """Evaluates a run by the simulation's log.

    Args:
        run: The run.

    Returns:
        Figures of the run in SI units; angles in degrees, lengths in millimetres and times in
        milliseconds where the key says so.
    """
    plan, motion, execution = run.plan, run.log.motion, run.execution
    found: dict[str, Any] = {
        "outcome": execution.outcome.value,
        "stood": not run.log.fell and bool(
            evaluation.tilt(motion.base_orientation[-1:])[0] < UPRIGHT),
        "planned": {"v_rb": plan.v_rb, "omega_door": plan.omega_door,
                    "effective_mass": plan.effective_mass, "restitution": plan.restitution,
                    "impulse": plan.required_impulse, "learned_hits": plan.learned_hits},
    }
    if run.impact is None:
        return found
    hit, t = run.impact, motion.t
    contact, peak = t[hit.contact.start], t[hit.peak]
    starts = [(start, name) for name, start in execution.starts.items()
              if name not in ("post", plan.ending)]
    ends = [start for start, _ in starts[1:]] + [contact]
    phases = {name: (start, end) for (start, name), end in zip(starts, ends, strict=True)}
    phases |= {"post": (contact, peak), plan.ending: (peak, t[-1])}
    margin = evaluation.support(motion, load_robot_config(), window=evaluation.WINDOW).margin
    pushed = evaluation.centred_mean(motion.contact_force[hit.peak:, None], 20)
    opened = float(np.degrees(motion.door_angle[hit.peak]))
    by_robot = execution.measured
    return found | {
        "peak_deg": opened,
        "error_deg": opened - float(np.degrees(plan.desired_opening_angle)),
        "held_deg": float(np.degrees(motion.door_angle[t > t[-1] - HELD_OVER].mean())),
        "margin_mm": {name: 1e3 * value for name, value in
                      evaluation.smallest_margins(t, margin, phases).items()},
        "contacts": hit.contacts_before_peak,
        "v_rb": hit.v_rb,
        "omega_door": hit.omega_door,
        "momentum_ratio": plan.effective_mass * (hit.v_rb - hit.v_rb_post) * plan.l_b / (
            run.known.door.i_a * hit.omega_door),
        "slip_mm": 1e3 * evaluation.slip(motion, contact, contact + 0.1),
        "hand_force_n": float(pushed.max()),
        "switch_latency_ms": float(
            1e3 * (by_robot.contact_time + by_robot.switch_latency - contact)),
    }


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
    # Each process is a new interpreter, because PyBullet and its threads cannot be forked. After an
    # interrupt the pool ends the cases that are running.
    with path.open("a", encoding="utf-8") as file, bar, get_context("spawn").Pool(
            os.cpu_count(), signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
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
        records = run(cases(options.n, options.seed), out, options.engine)
        from door_impact_evaluation.sweep import report as sweep_report

        sweep_report.write(summary(records, options.n, options.seed, options.engine), out)
    except (SimBridgeError, OSError) as error:
        print(f"sweep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"sweep: interrupted; the cases that were done are kept in {out}",
              file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
