import json

import pytest
from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench.bench import Measurement


def test_ratio_above_one_is_better_than_the_peer_whichever_way_better_lies():
    """A bridge that takes 15 % more time has 0.87; twice the rate has 2."""
    assert Measurement(1.15, "s", False, "bare", 1.0).ratio == pytest.approx(1.0 / 1.15)
    assert Measurement(400.0, "Hz", True, "peer", 200.0).ratio == pytest.approx(2.0)


def test_without_a_peer_there_is_no_ratio(tmp_path, monkeypatch):
    """summary.json then has null for it, and the table a dash."""
    lonely = Measurement(1.1, "simulated over wall time", True, reference="at least 1")
    monkeypatch.setattr(bench, "BENCHMARKS", {"lonely": lambda out: lonely})
    written = bench.run(["lonely"], tmp_path / "deep")
    assert json.loads((tmp_path / "deep" / "summary.json").read_text()) == written
    assert written["lonely"]["ratio"] is None
    assert {"value", "unit", "higher_is_better", "peer", "peer_value", "ratio"} <= set(
        written["lonely"])
    assert "at least 1" in bench.table({"lonely": lonely})


def test_unknown_benchmark_is_named_with_those_that_are_there(capsys):
    """Before anything is measured."""
    with pytest.raises(SystemExit) as ended:
        bench.main(["nonsense"])
    assert ended.value.code == 2
    assert "nonsense" in (said := capsys.readouterr().err)
    assert "bridge_overhead" in said


def test_failed_demonstration_is_an_error_that_says_why(tmp_path, monkeypatch, capsys):
    """As where other nodes run already."""
    monkeypatch.setattr("door_impact_evaluation.bench.bridge.sys.executable", "false")
    assert bench.main(["real_time_factor", "--out", str(tmp_path)]) == 1
    assert "the demonstration ended with 1" in capsys.readouterr().err
