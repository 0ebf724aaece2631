"""The benchmarks' ratios and their file; nothing is measured here."""

import json

import pytest
from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench.bench import Benchmark


def test_a_ratio_above_one_is_better_than_the_peer(tmp_path):
    """A duration that is 15 % longer has the ratio 0.87, and twice the rate has the ratio 2."""
    longer = Benchmark(lambda out: (1.15, 1.0), "s", "bare")
    faster = Benchmark(lambda out: (400.0, 200.0), "Hz", "peer", higher_is_better=True)
    assert longer.run(tmp_path)["ratio"] == pytest.approx(1.0 / 1.15)
    assert faster.run(tmp_path)["ratio"] == pytest.approx(2.0)


def test_the_figures_of_each_benchmark_are_written(tmp_path, monkeypatch, capsys):
    """summary.json has what was measured, by the name of the benchmark; a folder is made."""
    monkeypatch.setattr(bench, "BENCHMARKS", {
        "one": Benchmark(lambda out: (3.0, 6.0), "ms for a thing", "the usual way", "target: 4")})
    assert bench.main(["--out", str(tmp_path / "deep")]) == 0
    assert json.loads((tmp_path / "deep" / "summary.json").read_text()) == {"one": {
        "value": 3.0, "unit": "ms for a thing", "higher_is_better": False,
        "peer": "the usual way", "peer_value": 6.0, "ratio": 2.0, "reference": "target: 4"}}
    assert "ms for a thing" in capsys.readouterr().out
