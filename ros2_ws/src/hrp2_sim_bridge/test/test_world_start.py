"""Where the robot stands at first, and how stiff its soles are, in each physics engine."""

import math

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.replay import differences, replay_log
from hrp2_sim_bridge.settings import ENGINES, SensorSettings, WorldSettings

EXACT = SensorSettings(sensor_noise=False)
EACH_ENGINE = pytest.mark.parametrize("engine", ENGINES)


@pytest.fixture(autouse=True)
def installed() -> None:
    """Skip these tests where an engine is not installed."""
    for engine in ENGINES:
        pytest.importorskip(engine)


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


@EACH_ENGINE
@pytest.mark.parametrize("start", [(10.0, -10.0, 2.5), (-7.0, 3.0, -math.pi)])
def test_a_robot_far_away_and_turned_stands_as_at_the_origin(make_world, engine, start) -> None:
    """It begins where it shall, sways as at the origin to 0.1 mm, and returns there by a reset."""
    paths = []
    for place in ((0.0, 0.0, 0.0), start):
        world = make_world(door_distance=9.0, engine=engine, sensors=EXACT, start=place)
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


@EACH_ENGINE
@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_soles_sag_by_the_stiffness_that_they_have(make_world, robot, engine, scale) -> None:
    """By m g / 2 k, though the stabilizer does not know of it."""
    world = make_world(engine=engine, sensors=EXACT, rubber_scale=scale)
    log = run(world, 0.5)
    depth = -np.mean([log[f"{side}_sole_position"][-1, 2] for side in SIDES])
    stiffness = scale * robot.sole_rubber.stiffness
    assert depth == pytest.approx(robot.mass * 9.81 / 2.0 / stiffness, rel=0.03)


def test_the_place_of_the_door_is_that_in_the_world(make_world) -> None:
    """It does not move with the robot: 5 m along the wall there is no leaf."""
    near = make_world(door_distance=0.45)
    away = make_world(door_distance=0.45, start=(5.0, 0.0, 0.0))
    assert near.engine.leaf_distance(1.0) < 0.3
    assert away.engine.leaf_distance(1.0) == 1.0


def test_a_run_that_began_elsewhere_is_repeated_from_its_log(make_world) -> None:
    """The log has the start."""
    log = run(make_world(start=(1.0, 2.0, 3.0), rubber_scale=1.1), 0.1)
    assert differences(log, replay_log(log)) == []


@pytest.mark.parametrize("start", [
    (0.0, 0.0), (math.nan, 0.0, 0.0), (0.0, 0.0, math.inf), (10.1, 0.0, 0.0), (0.0, -10.1, 0.0)])
def test_a_start_that_is_none_is_refused(start) -> None:
    """With the value and the limit."""
    with pytest.raises(SettingError, match="start is"):
        WorldSettings(start=start)


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan])
def test_rubber_without_stiffness_is_refused(scale) -> None:
    """As every other multiple."""
    with pytest.raises(SettingError, match="rubber_scale"):
        WorldSettings(rubber_scale=scale)
