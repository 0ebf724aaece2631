"""`make bench`: measures speeds and, in the same run, those of a peer."""

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from door_impact_evaluation.bench import bridge as bench_bridge
from door_impact_evaluation.bench import door as bench_door
from door_impact_evaluation.bench import planner as bench_planner
from door_impact_evaluation.bench import view as bench_view
from door_impact_evaluation.bench import walking as bench_walking
from door_impact_evaluation.errors import EvaluationError


@dataclass(frozen=True)
class Measurement:
    """The figure of a benchmark and that of its peer.

    Attributes:
        value: Measured figure.
        unit: Unit of the figure, and what was measured.
        higher_is_better: Whether a larger figure is better.
        peer: Description of the peer; None if there is none.
        peer_value: Figure of the peer in the same run; None if there is no peer.
        reference: Published figures or targets, in words.
    """

    value: float
    unit: str
    higher_is_better: bool
    peer: str | None = None
    peer_value: float | None = None
    reference: str = ""

    @property
    def ratio(self) -> float | None:
        """Ratio above 1 if this is better than the peer; None if there is no peer."""
        if self.peer_value is None:
            return None
        better = self.value / self.peer_value
        return better if self.higher_is_better else 1.0 / better


def _identify_five_swings(_: Path) -> Measurement:
    ours, peer = bench_door.identify_five_swings()
    return Measurement(
        ours, "ms for five swings of 1,500 samples", False,
        "solve_ivp in least_squares, finite differences, from a guess 20 % off", peer,
        "target: at least 20 times as fast as the peer, and under 100 ms")


def _identify_twenty_swings(_: Path) -> Measurement:
    ours, peer = bench_door.identify_more(swings=4)
    return Measurement(
        ours, "ms for twenty swings of 1,500 samples", False, "five such swings", peer)


def _identify_6000_samples(_: Path) -> Measurement:
    ours, peer = bench_door.identify_more(samples=4)
    return Measurement(
        ours, "ms for five swings of 6,000 samples", False, "five of 1,500", peer)


def _simulate_1000_doors(_: Path) -> Measurement:
    ours, peer = bench_door.simulate_1000_doors()
    return Measurement(
        ours, "ms for 1,000 doors to their peaks", False,
        "one solve_ivp for each door", peer, "target: at least 50 times as fast as the peer")


def _plan_service(_: Path) -> Measurement:
    ours, peer = bench_planner.plan_service()
    return Measurement(
        ours, "ms for a request, median over random angles, messages included", False,
        "inverse kinematics, Newton-Euler and ZMP sample by sample, without hold, checks, search",
        peer, "target: under 100 ms; 250 ms are published for whole-body pushing postures")


def _plan_longer(_: Path) -> Measurement:
    ours, peer = bench_planner.plan_longer()
    return Measurement(
        ours, "ms for a plan with slow phases twice as long", False, "the usual plan", peer)


def _plan_retime(_: Path) -> Measurement:
    ours, peer = bench_planner.plan_retime()
    return Measurement(
        ours, "ms to time the run-up anew for another v_rB, median", False,
        "inverse kinematics, Newton-Euler and ZMP sample by sample", peer, "target: under 10 ms")


def _plan_walk(_: Path) -> Measurement:
    ours, peer, duration = bench_walking.plan_walk()
    return Measurement(
        ours, f"ms of processor time for a walk of {duration:.1f} s, footsteps included", False,
        "inverse kinematics, Newton-Euler and ZMP sample by sample, without control and checks",
        peer, "target: at most 500 ms for 15 s")


def _plan_step(_: Path) -> Measurement:
    ours, largest = bench_walking.plan_step()
    return Measurement(
        ours, "ms of processor time for two steps and the end from within a walk, median", False,
        reference=f"largest {largest:.1f} ms; target: at most 20 ms")


def _engine_step(_: Path) -> Measurement:
    ours, peer = map(bench_bridge.engine_step, ("mujoco", "pybullet"))
    return Measurement(
        ours, "us for a physics step of the standing robot in mujoco, median", False,
        "the same in pybullet", peer)


def _bridge_overhead(engine: str) -> Callable[[Path], Measurement]:
    """Makes the benchmark of what the bridge adds to a physics engine."""

    def benchmark(out: Path) -> Measurement:
        bridge, bare = bench_bridge.overhead(out / "bridge.npz", engine)
        return Measurement(
            bridge, f"s of processor time for a simulated second, engine {engine}", False,
            f"the steps of {engine} alone, same world and steps", bare,
            f"the bridge adds {bridge - bare:.3f} s; target: at most 0.2 s")

    return benchmark


def _real_time_factor(engine: str, target: float) -> Callable[[Path], Measurement]:
    """Makes the benchmark of a demonstration in a physics engine."""

    def benchmark(out: Path) -> Measurement:
        return Measurement(
            bench_bridge.real_time_factor(out / f"demo_{engine}", engine),
            f"simulated over wall time, all nodes, engine {engine}", True,
            reference=f"target: at least {target:g} on 2 cores")

    return benchmark


def _view_cpu(out: Path) -> Measurement:
    ours, peer = bench_view.view_cpu(out)
    return Measurement(
        ours, "% of a core, the view with a client at 20 Hz during a hit", False,
        "the same without a client", peer,
        "targets: at most 15 % with a client, 5 % without")


BENCHMARKS: dict[str, Callable[[Path], Measurement]] = {
    "identify_five_swings": _identify_five_swings,
    "identify_twenty_swings": _identify_twenty_swings,
    "identify_6000_samples": _identify_6000_samples,
    "simulate_1000_doors": _simulate_1000_doors,
    "plan_service": _plan_service,
    "plan_longer": _plan_longer,
    "plan_retime": _plan_retime,
    "plan_walk": _plan_walk,
    "plan_walk_step": _plan_step,
    "engine_step": _engine_step,
    "bridge_overhead": _bridge_overhead("pybullet"),
    "bridge_overhead_mujoco": _bridge_overhead("mujoco"),
    "real_time_factor": _real_time_factor("pybullet", 0.8),
    "real_time_factor_mujoco": _real_time_factor("mujoco", 1.0),
    "view_cpu": _view_cpu,
}


def table(measured: dict[str, Measurement]) -> str:
    """Formats the measurements as a table for a terminal."""
    lines = [f"{'':24}{'value':>10}{'peer':>10}{'ratio':>8}"]
    for name, row in measured.items():
        peer = "-" if row.peer_value is None else f"{row.peer_value:.4g}"
        ratio = "-" if row.ratio is None else f"{row.ratio:.3f}"
        lines.append(f"{name:24}{row.value:10.4g}{peer:>10}{ratio:>8}  {row.unit}")
        lines += [f"{'':24}  {text}" for text in (
            row.peer and f"peer: {row.peer}", row.reference) if text]
    return "\n".join(lines)


def run(names: list[str], out: Path) -> dict[str, Any]:
    """Measures, prints the table and writes ``summary.json``.

    Args:
        names: Names of the benchmarks to run.
        out: Folder of the results.

    Returns:
        The contents of ``summary.json``.

    Raises:
        EvaluationError: A benchmark could not be measured.
    """
    out.mkdir(parents=True, exist_ok=True)
    measured = {}
    for name in names:
        print(f"{name} ...", flush=True)
        measured[name] = BENCHMARKS[name](out)
    print(table(measured))
    summary = {name: asdict(row) | {"ratio": row.ratio} for name, row in measured.items()}
    (out / "summary.json").write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    return summary


def main(args: list[str] | None = None) -> int:
    """Runs the benchmarks.

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
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]}; there are {', '.join(BENCHMARKS)}")
    try:
        run(options.names or list(BENCHMARKS), options.out)
    except (EvaluationError, OSError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
