"""Command ``sweep``: many simulated runs that differ from what the robot knows and expects."""

import argparse
import json
import signal
import sys
from contextlib import closing
from pathlib import Path

from door_impact_common.files import draw_into, run_command, write_whole
from hrp2_sim_bridge.physics.engine import require_simulable
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.settings import ENGINES, WorldSettings

from door_impact_evaluation.sweep import running
from door_impact_evaluation.sweep.blocked import BLOCKED
from door_impact_evaluation.sweep.hit import HIT
from door_impact_evaluation.sweep.kind import Kind, robot_of
from door_impact_evaluation.sweep.miss import MISS
from door_impact_evaluation.sweep.passing import PASS
from door_impact_evaluation.sweep.push import PUSH
from door_impact_evaluation.sweep.report import draw, summary, table
from door_impact_evaluation.sweep.store import NAME, Runs
from door_impact_evaluation.sweep.walk import WALK

KINDS: dict[str, Kind] = {kind.name: kind for kind in (HIT, WALK, MISS, BLOCKED, PUSH, PASS)}


def folder_of(kind: str, engine: str) -> Path:
    """Return the folder of the results of a kind of sweep in a physics engine."""
    if (kind, engine) == (HIT.name, WorldSettings.engine):
        return Path("out/sweep")
    return Path(f"out/sweep_{kind}_{engine}")


def main(args: list[str] | None = None) -> int:
    """Run a sweep; write runs.parquet, summary.json, report.txt and sweep.png.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0 when the sweep is complete, 1 if it cannot be run or written, 130 after Ctrl-C.
    """
    options = _options(args)
    out = options.out or folder_of(options.kind, options.engine)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run_command("sweep", lambda: _report(options, KINDS[options.kind], out))
    except KeyboardInterrupt:
        print(f"sweep: interrupted; what was done is kept in {out / NAME}", file=sys.stderr)
        return 130


def _report(options: argparse.Namespace, kind: Kind, out: Path) -> str:
    """Run the sweep, write its files, and return the table."""
    make_engine(options.engine)  # before anything is written
    require_simulable(robot_of({"robot": options.robot}).config, WorldSettings())
    with closing(Runs(out)) as runs:
        rows = running.run(kind, kind.draw(options.n, options.seed), options.engine, runs,
                           options.cluster, options.robot)
        found = summary(kind, rows, options.n, options.seed, options.engine)
        text = table(kind, found)
        write_whole(out / "report.txt", text + "\n")
        draw_into(out / "sweep.png", lambda: draw(kind, found["runs"], out / "sweep.png"))
        write_whole(out / "summary.json", json.dumps(found, indent=1, allow_nan=False) + "\n")
    return text


def _options(args: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="sweep", formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Simulates many perturbed runs and reports what came of them; cases that the\n"
        "same versions have run before are not run again. Kinds:\n" + "\n".join(
            f"  {kind.name:9}{kind.what}" for kind in KINDS.values()))
    parser.add_argument("--kind", choices=KINDS, default=HIT.name, help="default: %(default)s")
    parser.add_argument("-n", type=int, default=50,
                        help="cases in each group that is drawn (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1,
                        help="seed of the random numbers (default: %(default)s)")
    parser.add_argument("--engine", choices=ENGINES, default=WorldSettings.engine,
                        help="physics engine (default: %(default)s)")
    parser.add_argument("--robot", default="", metavar="FILE",
                        help="robot.yaml of another robot (default: HRP-2)")
    parser.add_argument("--cluster", default="", metavar="tcp://HOST:8786",
                        help="scheduler of a cluster of Dask whose workers have the same packages "
                        "(default: a process on each core of this machine)")
    parser.add_argument("--out", type=Path,
                        help="folder of the results (default: out/sweep_KIND_ENGINE, of hits in "
                        f"{WorldSettings.engine} {folder_of(HIT.name, WorldSettings.engine)})")
    options = parser.parse_args(args)
    if options.n < 1 or options.seed < 0:
        parser.error(f"-n is {options.n}, it must be 1 or more; --seed is {options.seed}, "
                     "it must be 0 or more")
    return options


if __name__ == "__main__":
    sys.exit(main())
