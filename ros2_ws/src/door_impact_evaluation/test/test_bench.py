"""The benchmarks and their file; ``make bench`` measures more than once."""

import json
import math
from dataclasses import replace

from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench.bench import Benchmark

# Without `real_time_factor`, which starts every node twice, as the tests of the demonstration do.
NAMES = ["identify_five_swings", "simulate_1000_doors", "plan_service", "plan_retime", "plan_walk",
         "plan_passage", "engine_step", "bridge_overhead"]


def test_a_ratio_above_one_is_better_than_the_peer(tmp_path, monkeypatch):
    """Half the time has the ratio 2, and so has twice the rate."""
    monkeypatch.setattr(bench, "BENCHMARKS", {
        "time": Benchmark(lambda _: (3.0, 6.0), 1, "ms", "the usual way"),
        "rate": Benchmark(lambda _: (400.0, 200.0), 1, "Hz", "peer", higher_is_better=True)})
    assert bench.main(["--out", str(tmp_path / "deep")]) == 0
    found = json.loads((tmp_path / "deep" / "summary.json").read_text())
    assert [(row["value"], row["ratio"]) for row in found.values()] == [(3.0, 2.0), (400.0, 2.0)]


def test_each_benchmark_measures_itself_and_its_peer(tmp_path, monkeypatch):
    """Once, and both find the same results."""
    assert set(bench.BENCHMARKS) == {*NAMES, "real_time_factor"}
    monkeypatch.setattr(bench, "BENCHMARKS", {
        name: replace(bench.BENCHMARKS[name], repeats=1) for name in NAMES})
    assert bench.main(["--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "summary.json").read_text())
    assert list(found) == NAMES
    for name, row in found.items():
        for key in ("value", "peer_value", "ratio"):
            assert 0.0 < row[key] < math.inf, (name, key)
