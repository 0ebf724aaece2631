"""Command ``bench``: measure speeds and, in the same run, those of a peer."""

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from door_impact_common.files import make_folder, run_command, write_whole

from door_impact_evaluation.bench import door, robot

_LOOP = "a loop over the samples: inverse kinematics, Newton-Euler, ZMP, without search and checks"


@dataclass(frozen=True)
class Benchmark:
    """What is measured, beside what.

    Attributes:
        measure: Takes the number of repetitions; returns the figure and that of the peer.
        repeats: Number of repetitions.
        unit: Unit of both figures, and what was measured.
        peer: Description of the peer.
        reference: Published figures or targets, in words.
        higher_is_better: Whether a larger figure is better.
    """

    measure: Callable[[int], tuple[float, float]]
    repeats: int
    unit: str
    peer: str
    reference: str = ""
    higher_is_better: bool = False

    def run(self) -> dict[str, Any]:
        """Measure; return the entry of ``summary.json``, whose ratio is above 1 if it is better."""
        value, peer = self.measure(self.repeats)
        return {"value": value, "unit": self.unit, "higher_is_better": self.higher_is_better,
                "peer": self.peer, "peer_value": peer,
                "ratio": value / peer if self.higher_is_better else peer / value,
                "reference": self.reference}


BENCHMARKS = {
    "identify_five_swings": Benchmark(
        door.identify_five_swings, 5, "ms of CPU time for five swings of 1,500 samples",
        "solve_ivp in least_squares, finite differences, from a guess 20 % off",
        "target: at least 20 times as fast as the peer, and under 100 ms"),
    "simulate_1000_doors": Benchmark(
        door.simulate_1000_doors, 5, "ms of CPU time for 1,000 doors to their peaks",
        "one solve_ivp for each door", "target: at least 50 times as fast as the peer"),
    "plan_service": Benchmark(
        robot.plan_service, 40,
        "ms of CPU time for a request, messages included, median over random angles", _LOOP,
        "target: under 100 ms; 250 ms are published for whole-body pushing postures"),
    "plan_retime": Benchmark(
        robot.plan_retime, 20, "ms of CPU time to time a run-up for another v_rB, median",
        "the whole plan anew", "target: under 10 ms"),
    "plan_walk": Benchmark(
        robot.plan_walk, 15, "ms of CPU time for a walk of 14 s, footsteps included",
        _LOOP, "target: at most 500 ms for 15 s"),
    "plan_passage": Benchmark(
        robot.plan_passage, 5,
        "ms of CPU time for a passage of 9 s from the planned end of the paper's hit", _LOOP),
    "engine_step": Benchmark(
        robot.engine_step, 400, "us for a step of the standing robot in MuJoCo, median",
        "the same in PyBullet"),
    "bridge_overhead": Benchmark(
        robot.bridge_overhead, 1000,
        "s of CPU time for a simulated second of the standing robot in PyBullet",
        "PyBullet's steps alone, same world and steps", "target: the bridge adds at most 0.2 s"),
    "real_time_factor": Benchmark(
        robot.real_time_factor, 1, "simulated over wall time in PyBullet, all nodes",
        "the same in MuJoCo", "targets on 2 cores: at least 0.8, in MuJoCo 1.0", True),
}


def main(args: list[str] | None = None) -> int:
    """Run benchmarks, print a table and write ``summary.json``.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0 if all were measured, 1 if one failed.
    """
    parser = argparse.ArgumentParser(
        prog="bench", description="Measures speeds and, in the same run, those of a peer.")
    parser.add_argument("names", nargs="*", metavar="NAME",
                        help=f"benchmarks: {', '.join(BENCHMARKS)} (default: all)")
    parser.add_argument("--out", type=Path, default=Path("out/bench"),
                        help="folder of the results (default: out/bench)")
    options = parser.parse_args(args)
    for name in options.names:
        if name not in BENCHMARKS:
            parser.error(f"there is no benchmark {name}; there are {', '.join(BENCHMARKS)}")
    return run_command("bench", lambda: _table(options.names or BENCHMARKS, options.out))


def _table(names: Iterable[str], out: Path) -> str:
    """Run benchmarks, write ``summary.json``, and return the table."""
    make_folder(out)
    summary = {}
    for name in names:
        print(f"{name} ...", flush=True)
        summary[name] = BENCHMARKS[name].run()
    write_whole(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    return "\n".join([f"{'':22}{'value':>10}{'peer':>10}{'ratio':>8}", *(
        f"{name:22}{row['value']:10.4g}{row['peer_value']:10.4g}{row['ratio']:8.3f}  "
        f"{row['unit']}\n{'':22}  peer: {row['peer']}\n{'':22}  {row['reference']}".rstrip()
        for name, row in summary.items())])


if __name__ == "__main__":
    sys.exit(main())
