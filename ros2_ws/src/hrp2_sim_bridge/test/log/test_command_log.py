import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.log.command_log import CommandLog
from hrp2_sim_bridge.replay import main, replay
from humanoid_motion.driver_interface import TrajectoryArrays


def stop() -> TrajectoryArrays:
    """Return a trajectory that means stop."""
    return TrajectoryArrays((), (), ())


def test_the_same_orders_give_the_same_run_bit_for_bit(make_world, sway, moving) -> None:
    """A run with a sway, a refused order, a push and two stops is repeated exactly from its log."""
    first = make_world(door_distance=0.5)
    for tick in range(200):
        if tick == 10:
            path = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
            first.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), path), 0.0)
        if tick == 60:
            with pytest.raises(TrajectoryRefusedError):
                first.follow(TrajectoryArrays(("no_joint",), [1.0], [[0.0]]), 0.0)
        if tick == 70:
            first.push_door(6.0, 0.2)
        if tick == 120:
            first.stop()
        if tick == 150:
            first.follow(stop(), 0.0)
        first.step()
    log = first.log()
    again = make_world(door_distance=0.5)
    replay(again, log["commands"], 200)
    other = again.log()
    assert len(json.loads(log["commands"])["orders"]) == 4
    assert np.ptp(log["q"], axis=0).max() > 0.05
    for name, column in log.items():
        np.testing.assert_array_equal(column, other[name], err_msg=name)


def test_orders_of_numpys_numbers_can_be_kept(make_world) -> None:
    """NumPy's numbers, which JSON does not have, are converted."""
    world = make_world()
    world.push_door(np.float32(5.0), np.float64(0.2))
    assert json.loads(world.log(with_com=False)["commands"])["orders"][0]["impulse"] == 5.0


def test_reset_begins_a_new_log(make_world) -> None:
    """A log has no orders from before the last reset."""
    world = make_world()
    world.push_door(5.0, 0.2)
    world.step()
    world.reset()
    assert json.loads(world.log(with_com=False)["commands"])["orders"] == []


def test_a_log_with_lost_orders_is_refused(make_world, monkeypatch) -> None:
    """A log with lost orders cannot give the same run and is not replayed."""
    monkeypatch.setattr("hrp2_sim_bridge.log.command_log._MOST", 1)
    log = CommandLog()
    for tick in range(3):
        log.add(tick, "stop")
    log.add(3, "push", numbers=10, impulse=1.0, duration=0.2)
    world = make_world()
    with pytest.raises(SettingError, match="lost") as error:
        replay(world, log.text(), 5)
    assert error.value.value == 3
    assert world.tick == 0


def test_replay_wants_a_world_at_its_start(make_world) -> None:
    """A world that has been stepped is refused."""
    world = make_world()
    world.step()
    with pytest.raises(SettingError, match="tick"):
        replay(world, CommandLog().text(), 1)


def test_an_order_of_an_unknown_kind_is_refused(make_world) -> None:
    """It is named; nothing is guessed."""
    log = json.dumps({"lost": 0, "orders": [{"tick": 0, "kind": "dance"}]})
    with pytest.raises(SettingError, match="dance"):
        replay(make_world(), log, 1)


@pytest.mark.parametrize(("changes", "message"), [
    ({"settings": json.dumps({"sensors": {}, "glue": 1})}, "engine, .*glue"),
    ({"settings": "{"}, "not a log"),
    ({"commands": "no"}, "not a log"),
    ({"ticks": "many"}, "not a log"),
])
def test_logs_of_other_versions_and_broken_ones_are_refused_in_one_line(
        make_world, tmp_path: Path, capsys: Any, changes: dict[str, str], message: str) -> None:
    """Exit status 1 and a sentence that names the file."""
    world = make_world()
    world.step()
    path = tmp_path / "log.npz"
    np.savez(path, **{**world.log(), **changes})
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(path) in said
    assert re.search(message, said)


def test_a_file_that_is_no_archive_is_refused_in_one_line(tmp_path: Path, capsys: Any) -> None:
    """Exit status 1 and a sentence."""
    path = tmp_path / "log.npz"
    path.write_text("hello", encoding="utf-8")
    assert main([str(path)]) == 1
    assert capsys.readouterr().err.startswith(f"replay: {path}")
