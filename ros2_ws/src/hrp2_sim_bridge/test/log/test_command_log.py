import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hrp2_sim_bridge.errors import TrajectoryRefusedError
from hrp2_sim_bridge.replay import main, replay
from humanoid_motion.driver_interface import TrajectoryArrays


def stop() -> TrajectoryArrays:
    """Return a trajectory that means stop."""
    return TrajectoryArrays((), (), ())


def test_the_same_orders_give_the_same_run_bit_for_bit(make_world, sway, moving) -> None:
    """A run with a sway, a refused order, pushes and two stops is repeated exactly from its log."""
    first = make_world(door_distance=0.5, sole="rigid")
    for tick in range(200):
        if tick == 10:
            path = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
            first.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), path), 0.0)
        if tick == 60:
            with pytest.raises(TrajectoryRefusedError):
                first.follow(TrajectoryArrays(("no_joint",), [1.0], [[0.0]]), 0.0)
        if tick == 70:
            first.push_door(6.0, 0.2)
        if tick == 90:
            first.push_robot(np.array([5.0, 1.0, 0.0]))
        if tick == 120:
            first.stop()
        if tick == 150:
            first.follow(stop(), 0.0)
        first.step()
    log = first.log()
    again = make_world(door_distance=0.5, sole="rigid")
    replay(again, log["commands"], 200)
    other = again.log()
    assert len(json.loads(log["commands"])["orders"]) == 5
    assert np.ptp(log["q"], axis=0).max() > 0.05
    for name, column in log.items():
        np.testing.assert_array_equal(column, other[name], err_msg=name)


def test_a_log_of_another_version_is_refused_in_one_line(
        make_world, tmp_path: Path, capsys: Any) -> None:
    """Exit status 1 and a sentence that names the file."""
    world = make_world(sole="rigid")
    world.step()
    path = tmp_path / "log.npz"
    np.savez(path, **world.log() | {"settings": json.dumps({"sensors": {}, "glue": 1})})
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(path) in said
    assert "glue" in said
