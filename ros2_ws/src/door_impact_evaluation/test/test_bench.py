"""The benchmarks' table, ratios and errors; nothing is measured here."""

import json

import pytest
from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench.bench import Measurement


def test_a_ratio_above_one_is_better_than_the_peer():
    """A duration that is 15 % longer has the ratio 0.87, and twice the rate has the ratio 2."""
    assert Measurement(1.15, "s", False, "bare", 1.0).ratio == pytest.approx(1.0 / 1.15)
    assert Measurement(400.0, "Hz", True, "peer", 200.0).ratio == pytest.approx(2.0)


def test_without_a_peer_there_is_no_ratio(tmp_path, monkeypatch):
    """summary.json then has null for the ratio, and the table a dash."""
    lonely = Measurement(1.1, "simulated over wall time", True, reference="at least 1")
    monkeypatch.setattr(bench, "BENCHMARKS", {"lonely": lambda out: lonely})
    written = bench.run(["lonely"], tmp_path / "deep")
    assert json.loads((tmp_path / "deep" / "summary.json").read_text()) == written
    assert written["lonely"]["ratio"] is None
    assert {"value", "unit", "higher_is_better", "peer", "peer_value", "ratio"} <= set(
        written["lonely"])
    assert "at least 1" in bench.table({"lonely": lonely})
