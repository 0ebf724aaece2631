"""A world whose log nobody asked for: it keeps nothing of its past."""

import tracemalloc

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.settings import ENGINES

MOST = 30_000  # largest growth, of caches and of what is being followed [bytes]


def grown(world, trajectory) -> int:
    """Memory that a world has gained over 200 ticks with orders of all kinds [bytes]."""
    def run(ticks: int) -> None:
        for tick in range(ticks):
            if tick % 40 == 0:
                world.follow(trajectory, 0.0)
            if tick % 40 == 20:
                world.stop()
                world.push_door(1.0, 0.05)
            world.step()

    run(80)
    tracemalloc.start()
    try:
        run(40)
        before, _ = tracemalloc.get_traced_memory()
        run(200)
        after, _ = tracemalloc.get_traced_memory()
        return after - before
    finally:
        tracemalloc.stop()


def test_memory_grows_only_where_a_log_is_asked_for(
    make_world, moving, robot, monkeypatch
) -> None:
    """Without a log the rows and the orders of the past are not kept; with one they are."""
    monkeypatch.setattr("hrp2_sim_bridge.log.recorder._FIRST_CAPACITY", 16)
    nod = np.tile(robot.half_sitting, (3, 1))
    nod[1, robot.index("HEAD_JOINT0")] += 0.05
    trajectory = moving(np.array([0.02, 0.05, 0.09]), nod)
    assert grown(make_world(log=True), trajectory) > 10 * MOST
    assert grown(make_world(log=False), trajectory) < MOST


def test_a_log_that_was_not_asked_for_cannot_be_read(make_world, tmp_path) -> None:
    """It would be empty; the error says what to do, and no file is written."""
    world = make_world(log=False)
    world.step()
    with pytest.raises(SettingError, match="log"):
        world.log()
    with pytest.raises(SettingError, match="log"):
        world.save_log(tmp_path / "run.npz")
    assert not list(tmp_path.iterdir())
    world.reset()
    assert world.step().time > 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_log_changes_no_measurement_and_costs_what_it_needs(
    make_world, moving, robot, engine
) -> None:
    """Only for a log the links are read each millisecond; without one, once in a tick."""
    pytest.importorskip(engine)
    nod = np.tile(robot.half_sitting, (2, 1))
    nod[1, robot.index("HEAD_JOINT0")] += 0.05
    measured, calls = [], []
    for kept in (True, False):
        world = make_world(0.47, engine=engine, log=kept)  # partly with fine steps
        reads, read = [], world.engine.read_frames
        world.engine.read_frames = lambda reads=reads, read=read: reads.append(1) or read()
        world.follow(moving(np.array([0.02, 0.15]), nod), 0.0)
        world.push_door(3.0, 0.05)
        measured.append([
            np.concatenate([sample.position, sample.velocity, sample.left_wrench,
                            sample.imu.orientation, sample.counts])
            for sample in (world.step() for _ in range(40))])
        calls.append(len(reads))
    np.testing.assert_array_equal(*measured)
    assert calls == [200, 40]
