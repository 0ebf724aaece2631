"""Command ``sweep``: many simulated runs that differ from what the robot knows and expects."""

import argparse
import json
import signal
import sys
from pathlib import Path
from typing import Any

from door_impact_common.errors import DoorImpactError
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.settings import ENGINES, WorldSettings

from door_impact_evaluation.sweep import running
from door_impact_evaluation.sweep.hit import Hit
from door_impact_evaluation.sweep.kind import BadRun, Kind, Record
from door_impact_evaluation.sweep.miss import Miss
from door_impact_evaluation.sweep.push import PushKind
from door_impact_evaluation.sweep.walk import Walk

KINDS: dict[str, Kind] = {kind.name: kind for kind in (Hit(), Walk(), Miss(), PushKind())}


def folder_of(kind: str, engine: str) -> Path:
    """Returns the folder of the results of a kind of sweep in a physics engine."""
    if (kind, engine) == (Hit.name, WorldSettings.engine):
        return Path("out/sweep")
    return Path(f"out/sweep_{kind}_{engine}")


def summary(
    kind: Kind, records: list[Record], n: int, seed: int, engine: str, bad: list[BadRun],
) -> dict[str, Any]:
    """Makes the contents of summary.json.

    Args:
        kind: Kind of the sweep.
        records: Records of all cases.
        n: Number of cases in each group.
        seed: Seed of the sweep.
        engine: Physics engine of the simulation.
        bad: Runs with a replay.
    """
    return {
        "n": n, "seed": seed, "engine": engine, **kind.numbers(records),
        "replays": [{"name": run.name, kind.part: run.number, "why": run.why, "file": run.file}
                    for run in bad],
        "runs": records,
    }


def write(kind: Kind, found: dict[str, Any], out: Path) -> None:
    """Prints the table and writes summary.json, report.txt and sweep.png.

    Args:
        kind: Kind of the sweep.
        found: Contents of summary.json, as `summary` makes them.
        out: Folder of the results.
    """
    text = kind.table(found)
    print(text)
    (out / "report.txt").write_text(text + "\n", encoding="utf-8")
    kind.figure(found, out / "sweep.png")
    part = out / "summary.json.part"
    part.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    part.replace(out / "summary.json")


def main(args: list[str] | None = None) -> int:
    """Runs a sweep and writes its report.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0 when the sweep is complete, 1 if the engine is not installed or the folder cannot be
        written, 130 after Ctrl-C.
    """
    options = _options(args)
    kind, out = KINDS[options.kind], options.out or folder_of(options.kind, options.engine)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        make_engine(options.engine)  # before anything is written
        digest = running.sources()
        wanted = kind.cases(options.n, options.seed)
        records = running.run(kind, wanted, out, options.engine, digest)
        bad = kind.worst(records)
        write(kind, summary(kind, records, options.n, options.seed, options.engine, bad), out)
        running.make_replays(kind, bad, wanted, out, options.engine, digest)
    except (DoorImpactError, OSError) as error:
        print(f"sweep: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"sweep: interrupted; the cases that were done are kept in {out}",
              file=sys.stderr)
        return 130
    return 0


def _options(args: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="sweep", formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Simulates many perturbed runs and reports what came of them; cases that the\n"
        "same code has run before are not run again. Kinds:\n" + "\n".join(
            f"  {kind.name:6}{kind.what}" for kind in KINDS.values()))
    parser.add_argument("--kind", choices=KINDS, default=Hit.name,
                        help=f"what is run (default: {Hit.name})")
    parser.add_argument("-n", type=int, default=50,
                        help="cases in each group that is drawn (default: 50)")
    parser.add_argument("--seed", type=int, default=1,
                        help="seed of the random numbers (default: 1)")
    parser.add_argument("--engine", choices=ENGINES, default=WorldSettings.engine,
                        help=f"physics engine (default: {WorldSettings.engine})")
    parser.add_argument("--out", type=Path,
                        help="folder of the results (default: out/sweep_KIND_ENGINE, of hits in "
                        f"{WorldSettings.engine} {folder_of(Hit.name, WorldSettings.engine)})")
    options = parser.parse_args(args)
    if options.n < 1 or options.seed < 0:
        parser.error(f"-n is {options.n}, it must be 1 or more; --seed is {options.seed}, "
                     "it must be 0 or more")
    return options


if __name__ == "__main__":
    sys.exit(main())
