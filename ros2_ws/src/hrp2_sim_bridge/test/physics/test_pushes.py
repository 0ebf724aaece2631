"""Pushes on the robot from outside, in each physics engine."""

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.replay import differences, replay_log
from hrp2_sim_bridge.settings import ENGINES, SensorSettings

EXACT = SensorSettings(sensor_noise=False)
EACH_ENGINE = pytest.mark.parametrize("engine", ENGINES)


@pytest.fixture(autouse=True)
def installed() -> None:
    """Skip these tests where an engine is not installed."""
    for engine in ENGINES:
        pytest.importorskip(engine)


def run(world, ticks):
    """Step; return the log."""
    for _ in range(ticks):
        world.step()
    return world.log()


def external_impulse(log, mass):
    """Return the change of the robot's momentum that the floor's forces do not explain [N s].

    The forces computed for the floor contain the share of the push on the soles themselves, 0.7 %.
    """
    floor = sum(
        (rotation(log[f"{side}_sole_quaternion"]) @ log[f"{side}_wrench"][:, :3, None])[1:, :, 0]
        for side in ("left", "right"))
    floor = floor.sum(axis=0) * 0.001
    floor[2] -= 9.81 * mass * (len(log["time"]) - 1) * 0.001
    return mass * (log["com_velocity"][-1] - log["com_velocity"][0]) - floor


@EACH_ENGINE
@pytest.mark.parametrize("impulse", [(8.0, 0.0, 0.0), (-3.0, 5.0, -4.0)])
def test_the_robot_gains_the_impulse_of_a_push(make_world, robot, engine, impulse) -> None:
    """To 2 %, beside what its soles get from the floor; without a push it gains nothing."""
    world = make_world(door_distance=2.0, engine=engine, sensors=EXACT)
    still = run(world, 20)
    assert np.abs(external_impulse(still, robot.mass)).max() < 0.03
    world.reset()
    world.push_robot(np.array(impulse))
    gained = external_impulse(run(world, 24), robot.mass)
    np.testing.assert_allclose(gained, impulse, atol=0.02 * np.linalg.norm(impulse))


@EACH_ENGINE
def test_a_push_acts_for_its_duration_only(make_world, robot, engine) -> None:
    """Half of it after half of its time, and nothing afterwards, also at odd durations.

    The log begins with the end of the first millisecond.
    """
    world = make_world(door_distance=2.0, engine=engine, sensors=EXACT)
    world.push_robot(np.array([6.0, 0.0, 0.0]), duration=0.0853)
    speed = run(world, 40)
    gained = np.array([external_impulse(
        {name: column[:row] for name, column in speed.items() if np.ndim(column)}, robot.mass)[0]
        for row in (2, 43, 86, 200)])
    np.testing.assert_allclose(gained, np.array([1.0, 42.0, 84.3, 84.3]) * 6.0 / 85.3, atol=0.06)


@EACH_ENGINE
def test_a_pushed_run_is_repeated_from_its_log(make_world, engine) -> None:
    """Bit for bit, and a reset forgets a push that still acts."""
    world = make_world(door_distance=2.0, engine=engine)
    world.push_robot(np.array([5.0, 1.0, 0.0]))
    pushed = run(world, 30)
    assert differences(pushed, replay_log(pushed)) == []
    world.push_robot(np.array([5.0, 0.0, 0.0]), duration=5.0)
    run(world, 2)
    world.reset()
    assert np.abs(run(world, 20)["com_velocity"]).max() < 0.01


@pytest.mark.parametrize(("impulse", "duration", "named"), [
    ((np.nan, 0.0, 0.0), 0.1, "impulse"), ((1.0, 0.0), 0.1, "impulse"),
    ((201.0, 0.0, 0.0), 0.1, "impulse"), ((1.0, 0.0, 0.0), 0.0, "duration"),
    ((1.0, 0.0, 0.0), np.nan, "duration"), ((1.0, 0.0, 0.0), 11.0, "duration")])
def test_a_push_that_nobody_can_give_is_refused(make_world, impulse, duration, named) -> None:
    """With the value and the limit, and without an effect."""
    world = make_world(sole="rigid")
    with pytest.raises(SettingError, match=named):
        world.push_robot(np.array(impulse), duration)
    assert "push_robot" not in str(world.log()["commands"])


def test_pushes_that_act_together_are_limited_together(make_world) -> None:
    """Three of 90 N s are more than a robot gets, unless one is over."""
    world = make_world(sole="rigid")
    for _ in range(2):
        world.push_robot(np.array([0.0, 90.0, 0.0]), duration=0.004)
    with pytest.raises(SettingError, match="270 N s"):
        world.push_robot(np.array([0.0, 90.0, 0.0]))
    run(world, 1)
    world.push_robot(np.array([0.0, 90.0, 0.0]))
