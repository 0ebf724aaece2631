"""The benchmarks' file; nothing is measured here."""

import json

from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench.bench import Benchmark


def test_a_ratio_above_one_is_better_than_the_peer(tmp_path, monkeypatch):
    """Half the time has the ratio 2, and so has twice the rate."""
    monkeypatch.setattr(bench, "BENCHMARKS", {
        "time": Benchmark(lambda out: (3.0, 6.0), "ms", "the usual way"),
        "rate": Benchmark(lambda out: (400.0, 200.0), "Hz", "peer", higher_is_better=True)})
    assert bench.main(["--out", str(tmp_path / "deep")]) == 0
    found = json.loads((tmp_path / "deep" / "summary.json").read_text())
    assert [(row["value"], row["ratio"]) for row in found.values()] == [(3.0, 2.0), (400.0, 2.0)]
