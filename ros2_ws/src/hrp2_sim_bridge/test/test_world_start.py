"""Where the robot stands at first."""

import math

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import SensorSettings, WorldSettings

EXACT = SensorSettings(sensor_noise=False)


def run(world, seconds):
    """Step for a number of seconds; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
    return world.log()


def middle(log, row):
    """Return x, y and heading of the middle between the soles in a row of a log."""
    soles = [log[f"{side}_sole_position"][row] for side in SIDES]
    turn = rotation(log["left_sole_quaternion"][row])
    return np.array([*np.mean(soles, axis=0)[:2], math.atan2(turn[1, 0], turn[0, 0])])


@pytest.mark.nightly("four seconds of simulated time")
def test_a_robot_far_away_and_turned_stands_as_at_the_origin(make_world) -> None:
    """It begins where it shall, sways as at the origin to 0.1 mm, and returns there by a reset."""
    paths, start = [], (10.0, -10.0, 2.5)
    for place in ((0.0, 0.0, 0.0), start):
        world = make_world(door_distance=9.0, sensors=EXACT, start=place)
        for _ in range(2):
            world.push_robot(rotation([0.0, 0.0, *half(place[2])]) @ [3.0, 4.0, 0.0])
            log = run(world, 1.0)
            off = middle(log, 0) - place
            off[2] = math.remainder(off[2], math.tau)
            assert np.abs(off).max() < 5e-4
            world.reset()
        assert not world.fell
        turn = rotation([0.0, 0.0, *half(place[2])])
        paths.append((log["com_position"] - [*place[:2], 0.0]) @ turn)
    assert np.ptp(paths[0][:, :2], axis=0).min() > 0.003
    assert np.abs(paths[0] - paths[1]).max() < 1e-4


def half(heading):
    """Return z and w of the quaternion of a heading."""
    return math.sin(heading / 2.0), math.cos(heading / 2.0)


def test_the_place_of_the_door_is_that_in_the_world(make_world) -> None:
    """It does not move with the robot: 5 m along the wall there is no leaf."""
    near = make_world(door_distance=0.45, sole="rigid")
    away = make_world(door_distance=0.45, sole="rigid", start=(5.0, 0.0, 0.0))
    assert near.engine.leaf_distance(1.0) < 0.3
    assert away.engine.leaf_distance(1.0) == 1.0


@pytest.mark.parametrize("start", [
    (math.nan, 0.0, 0.0), (10.1, 0.0, 0.0)])
def test_a_start_that_is_none_is_refused(start) -> None:
    """With the value and the limit."""
    with pytest.raises(SettingError, match="start is"):
        WorldSettings(start=start)
