"""The log of a world, and that a run can be had again."""

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from humanoid_motion.driver_interface import TrajectoryArrays
from robot_driver.errors import TrajectoryRefusedError


def test_after_a_reset_the_same_orders_give_the_same_run_bit_for_bit(
        make_world, sway, moving) -> None:
    """A run with a sway, a refused order, pushes and a stop repeats exactly after a reset."""
    world = make_world(door_distance=0.5, sole="rigid")
    logs = []
    for _ in range(2):
        for tick in range(160):
            if tick == 10:
                path = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
                world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), path), 0.0)
            if tick == 60:
                with pytest.raises(TrajectoryRefusedError):
                    world.follow(TrajectoryArrays(("no_joint",), [1.0], [[0.0]]), 0.0)
            if tick == 70:
                world.push_door(6.0, 0.2)
            if tick == 90:
                world.push_robot(np.array([5.0, 1.0, 0.0]))
            if tick == 120:
                world.stop()
            world.step()
        logs.append(world.log())
        world.reset()
    assert np.ptp(logs[0]["q"], axis=0).max() > 0.05
    for name, column in logs[0].items():
        np.testing.assert_array_equal(column, logs[1][name], err_msg=name)


def test_a_log_keeps_the_last_seconds_that_it_was_asked_for(make_world) -> None:
    """A log of 20 ms keeps the last four of 20 ticks, with one row for each millisecond."""
    world = make_world(sole="rigid", log_seconds=0.02)
    for _ in range(20):
        world.step()
    log = world.log()
    np.testing.assert_allclose(log["tick_time"], np.arange(17, 21) * 0.005)
    np.testing.assert_allclose(log["time"], np.arange(81, 101) * 0.001)


def test_a_log_that_was_not_asked_for_cannot_be_read(make_world, tmp_path) -> None:
    """A world without a log refuses to save one, and writes no file."""
    world = make_world(log=False, sole="rigid")
    world.step()
    with pytest.raises(SettingError, match="log"):
        world.save_log(tmp_path / "run.npz")
    assert not list(tmp_path.iterdir())
