"""The benchmarks' table, ratios and errors; nothing is measured here."""

import json
from types import SimpleNamespace

import pytest
from door_impact_evaluation.bench import bench
from door_impact_evaluation.bench import bridge as bench_bridge
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


def test_an_unknown_benchmark_is_refused_with_the_known_names(capsys):
    """The command ends with status 2 before anything is measured."""
    with pytest.raises(SystemExit) as ended:
        bench.main(["nonsense"])
    assert ended.value.code == 2
    assert "nonsense" in (error := capsys.readouterr().err)
    assert "bridge_overhead" in error


def test_the_contracts_benchmarks_exist_for_both_engines():
    """Those without an engine's name in them are PyBullet's."""
    assert {"engine_step", "bridge_overhead", "bridge_overhead_mujoco", "real_time_factor",
            "real_time_factor_mujoco", "view_cpu", "plan_walk"} <= set(bench.BENCHMARKS)


@pytest.mark.parametrize(("name", "engine"), [
    ("bridge_overhead", "pybullet"), ("bridge_overhead_mujoco", "mujoco")])
def test_a_benchmark_says_which_engine_it_measured_and_what_the_bridge_adds(
        monkeypatch, tmp_path, name, engine):
    """The engine that is named is the one that is run."""
    asked = []
    monkeypatch.setattr("door_impact_evaluation.bench.bridge.overhead",
                        lambda log, which: asked.append(which) or (1.25, 1.0))
    found = bench.BENCHMARKS[name](tmp_path)
    assert asked == [engine]
    assert engine in found.unit
    assert engine in found.peer
    assert "adds 0.250 s" in found.reference


def test_a_busy_machine_changes_no_times_of_the_bridge(monkeypatch):
    """With half of a core every wall time is twice as long, and the result is the same."""
    for share in (1.0, 0.5):
        clock = [0.0]
        monkeypatch.setattr(bench_bridge, "perf_counter", lambda clock=clock: clock[0])
        monkeypatch.setattr(
            bench_bridge, "process_time", lambda clock=clock, share=share: share * clock[0])
        world = SimpleNamespace(wall_time=0.0, engine=SimpleNamespace(stepping_time=0.0))
        times = bench_bridge._Times()
        for _ in range(201):  # a second, in which others than the bridge need 0.1 s
            times(world, None)
            clock[0] += 2.5e-3 / share
            world.wall_time += 2e-3 / share
            world.engine.stepping_time += 1.5e-3 / share
        assert times.per_second() == pytest.approx((0.4, 0.3))


def test_a_step_of_an_engine_is_measured_without_the_bridge(monkeypatch):
    """It is the engine's own time of a step, however long the bridge takes."""

    class StillWorld:
        """A world whose engine needs 70 us for each of ten steps in a tick."""

        def __init__(self, *_, engine, log):
            self.engine = SimpleNamespace(stepping_time=0.0)
            self.time_step = 5e-4

        def step(self):
            self.engine.stepping_time += 7e-4

        def close(self):
            pass

    monkeypatch.setattr(bench_bridge, "World", StillWorld)
    assert bench_bridge.engine_step("mujoco") == pytest.approx(70.0)


def test_a_failed_demonstration_is_an_error_with_its_status(tmp_path, monkeypatch, capsys):
    """The command reports it in one line and ends with status 1."""
    monkeypatch.setattr("door_impact_evaluation.bench.bridge.sys.executable", "false")
    assert bench.main(["real_time_factor", "--out", str(tmp_path)]) == 1
    assert "the demonstration ended with 1" in capsys.readouterr().err
