"""Command ``sweep``: many hits on doors that are not quite what they were said to be."""

import argparse
import hashlib
import json
import os
import signal
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from door_impact_common.errors import DoorImpactError
from door_model.data import data_path as door_data
from hrp2_description.data import data_path as robot_data
from hrp2_description.robot import load_robot_config
from tqdm import tqdm

from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.sweep.cases import Case, cases

PACKAGES = ("door_encoder", "door_impact_common", "door_impact_evaluation", "door_model",
            "hrp2_description", "hrp2_sim_bridge", "humanoid_motion", "impact_planner")
ROBOT_FILES = ("config/robot.yaml", "config/hrp2_links.yaml", "urdf/hrp2.urdf")
RECORD = "runs.jsonl"
UPRIGHT = np.radians(5.0)  # tilt of a robot that stands
HELD_OVER = 0.5            # [s] at the end, whose mean is the held angle


def run_case(case: Case) -> list[dict[str, Any]]:
    """Hits a door as often as its case says; one record a hit."""
    known = case.known()
    records: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for hit in range(case.hits):
            record: dict[str, Any] = {"name": case.name, "hit": hit, "case": case.as_json()}
            try:
                run = rehearse(
                    case.target_deg, Path(folder) / "log.npz", door=case.config(), known=known,
                    door_offset=case.door_offset, run_up=case.run_up, **case.world(hit))
            except DoorImpactError as error:
                return [*records, record | {"refused": str(error)}]
            records.append(record | measured(run))
            if run.impact is None:
                break
            known = replace(known, experience=run.learned())
    return records


def measured(run: Rehearsal) -> dict[str, Any]:
    """What became of a run, by the simulation's log; angles in deg, margins and ways in mm."""
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
    felt = execution.measured
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
        "switch_latency_ms": float(1e3 * (felt.contact_time + felt.switch_latency - contact)),
    }


def sources() -> str:
    """Digest of code, robot and doors that a run rests on: results of others are not taken up."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        folder = Path(str(import_module(package).__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.read_bytes())
    doors = sorted(door_data("doors").glob("*.yaml"))
    for path in (*map(robot_data, ROBOT_FILES), *doors):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def load_records(path: Path, digest: str) -> dict[str, list[dict[str, Any]]]:
    """Records of an earlier run of the same code, by case; a line half written is left out."""
    found: dict[str, list[dict[str, Any]]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                entry = json.loads(line)
                if entry["digest"] == digest:
                    found[json.dumps(entry["case"], sort_keys=True)] = entry["records"]
            except (json.JSONDecodeError, TypeError, KeyError):
                continue
    return found


def run(wanted: list[Case], out: Path) -> list[dict[str, Any]]:
    """Runs what has not been run yet, as many at a time as there are cores.

    Args:
        wanted: The cases.
        out: Folder; what is done is kept there at once.

    Returns:
        The records, in the order of the cases.
    """
    out.mkdir(parents=True, exist_ok=True)
    digest, path = sources(), out / RECORD
    done = load_records(path, digest)
    keys = {case: json.dumps(case.as_json(), sort_keys=True) for case in wanted}
    missing = [case for case in wanted if keys[case] not in done]
    bar = tqdm(total=len(wanted), initial=len(wanted) - len(missing), unit="door",
               disable=not missing)
    # A fresh interpreter each: PyBullet and its threads are not to be forked. What is under way
    # ends with the pool.
    with path.open("a", encoding="utf-8") as record, bar, get_context("spawn").Pool(
            os.cpu_count(), signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
        if record.tell() and not path.read_bytes().endswith(b"\n"):
            record.write("\n")  # ends a line half written
        for case, records in pool.imap_unordered(_with_case, missing):
            done[keys[case]] = records
            entry = {"digest": digest, "case": case.as_json(), "records": records}
            record.write(json.dumps(entry) + "\n")
            record.flush()
            bar.update()
    return [one for case in wanted for one in done[keys[case]]]


def _with_case(case: Case) -> tuple[Case, list[dict[str, Any]]]:
    return case, run_case(case)


def statistics(errors: Iterable[float]) -> dict[str, float | None]:
    """Mean, standard deviation, 95th percentile and largest size of errors [deg]."""
    found = np.array(list(errors))
    if not len(found):
        return dict.fromkeys(("mean", "sd", "p95", "max"))
    size = np.abs(found)
    return {"mean": float(found.mean()), "sd": float(found.std(ddof=1)) if len(found) > 1 else 0.0,
            "p95": float(np.percentile(size, 95.0)), "max": float(size.max())}


def summary(records: list[dict[str, Any]], n: int, seed: int) -> dict[str, Any]:
    """The contract's summary.json of a sweep, the nominal doors beside it."""
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
        args: Command line, without the program's name; the process's own by default.
    """
    parser = argparse.ArgumentParser(
        prog="sweep", description="Hits perturbed doors in the simulation and tells how far they "
        "opened; what was done before by the same code is taken up.")
    parser.add_argument("-n", type=int, default=50, help="doors of each kind (default: 50)")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn (default: 1)")
    parser.add_argument("--out", type=Path, default=Path("out/sweep"), help="folder")
    options = parser.parse_args(args)
    if options.n < 1 or options.seed < 0:
        parser.error(f"-n must be 1 or more and --seed 0 or more, not {options.n}, {options.seed}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        records = run(cases(options.n, options.seed), options.out)
    except OSError as error:
        print(f"sweep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"sweep: interrupted; what was done is kept in {options.out}", file=sys.stderr)
        return 130
    from door_impact_evaluation.sweep import report as sweep_report

    found = summary(records, options.n, options.seed)
    sweep_report.write(found, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
