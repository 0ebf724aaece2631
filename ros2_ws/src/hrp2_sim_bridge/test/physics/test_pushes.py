"""Pushes on the robot from outside, in each physics engine."""

import numpy as np
import pytest
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings

EXACT = SensorSettings(sensor_noise=False)


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


@pytest.mark.parametrize("engine", ENGINES)
def test_the_robot_gains_the_impulse_of_a_push(make_world, robot, engine) -> None:
    """To 2 %, beside what its soles get from the floor; without a push it gains nothing."""
    impulse = (-3.0, 5.0, -4.0)
    world = make_world(door_distance=2.0, engine=engine, sensors=EXACT)
    still = run(world, 20)
    assert np.abs(external_impulse(still, robot.mass)).max() < 0.03
    world.reset()
    world.push_robot(np.array(impulse))
    gained = external_impulse(run(world, 24), robot.mass)
    np.testing.assert_allclose(gained, impulse, atol=0.02 * np.linalg.norm(impulse))


@pytest.mark.parametrize(("impulse", "duration", "named"), [
    ((201.0, 0.0, 0.0), 0.1, "impulse"), ((1.0, 0.0, 0.0), np.nan, "duration")])
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
