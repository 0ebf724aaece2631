"""The world in each physics engine: what holds whichever engine computes the motion."""

import json

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.engines import make_engine
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings, WorldSettings
from hrp2_sim_bridge.world import World

EXACT = SensorSettings(sensor_noise=False)
EACH_ENGINE = pytest.mark.parametrize("engine", [
    engine if engine != WorldSettings.engine
    else pytest.param(engine, marks=pytest.mark.nightly("the other files test this engine"))
    for engine in ENGINES])


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


def swayed(make_world, sway, moving, engine, **settings):
    """Return the log of a sway from foot to foot."""
    world = make_world(engine=engine, sensors=EXACT, **settings)
    postures = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
    world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), postures), 0.0)
    log = run(world, 1.4)
    assert not world.fell
    return log


@EACH_ENGINE
@pytest.mark.parametrize("sole", ["rubber", "rigid"])
def test_the_robot_stands_on_its_weight_and_its_feet_do_not_creep(
    make_world, robot, engine, sole
) -> None:
    """The feet carry m g to 0.5 %, stay in place to 2 um in a second, and sag on rubber."""
    world = make_world(engine=engine, sole=sole, sensors=EXACT)
    run(world, 0.5)
    log = run(world, 1.0)
    carried = log["left_wrench"][-1000:, 2] + log["right_wrench"][-1000:, 2]
    np.testing.assert_allclose(carried, robot.mass * GRAVITY, rtol=0.005)
    depths = []
    for side in SIDES:
        place = log[f"{side}_sole_position"]
        assert np.abs(place[-1, :2] - place[-1000, :2]).max() < 2e-6
        depths.append(-place[-1, 2])
    wanted = robot.mass * GRAVITY / 2.0 / robot.sole_rubber.stiffness if sole == "rubber" else 0.0
    assert np.mean(depths) == pytest.approx(wanted, rel=0.02, abs=1e-4)


@EACH_ENGINE
def test_wrenches_change_the_momentum_as_newton_says(
    make_world, robot, sway, moving, engine
) -> None:
    """The impulse of the computed wrenches is the change of the momentum."""
    log = swayed(make_world, sway, moving, engine)
    force = np.zeros((len(log["time"]), 3))
    for side in SIDES:
        turn = rotation(log[f"{side}_sole_quaternion"])
        force += (turn @ log[f"{side}_wrench"][:, :3, None])[..., 0]
    force[:, 2] -= robot.mass * GRAVITY
    impulse = np.cumsum(force[1:], axis=0) * 0.001
    momentum = robot.mass * (log["com_velocity"][1:] - log["com_velocity"][0])
    assert np.abs(momentum[:, 1]).max() > 10.0
    np.testing.assert_allclose(momentum, impulse, atol=0.15)


def test_two_engines_show_the_same_sway(make_world, sway, moving) -> None:
    """On rubber the CoM's path differs by less than 1 mm, a foot's load by 3 % of m g.

    On rigid soles the robot rocks on edges, which multiplies every small difference.
    """
    logs = [swayed(make_world, sway, moving, engine) for engine in ENGINES]
    first, second = (log["com_position"] for log in logs)
    assert np.ptp(first[:, 1]) > 0.05
    assert np.abs(first - second).max() < 1e-3
    loads = [log["left_wrench"][:, 2].reshape(-1, 50).mean(axis=1) for log in logs]
    assert np.abs(loads[0] - loads[1]).max() < 0.03 * 58.0 * GRAVITY


@EACH_ENGINE
def test_hit_of_the_robot_turns_the_door_by_its_impulse(
    robot, paper_door, sway, moving, engine
) -> None:
    """The angular momentum that the door gains in a hit is that of the contact's forces."""
    braced = robot.posture(robot.braced_posture)
    places = []
    for distance in (2.0, None):
        world = World(
            robot, paper_door, distance or 0.02 + robot.contact_radius - places[0], -0.42,
            posture=braced, engine=engine)
        places.append(run(world, 0.005)["b_position"][-1, 1])
        if distance:
            world.close()
    path = np.array([sway(y, braced) for y in (0.0, 0.03, -0.03, -0.04)])
    world.follow(moving(np.array([0.1, 0.6, 0.95, 1.15]), path), 0.0)
    log = run(world, 1.0)
    world.close()
    force = log["contact_force"]
    touched = np.flatnonzero(force > 5.0)
    assert {str(log["link_names"][link]) for link in log["contact_link"][touched]} == {
        robot.contact_link}
    first, last = touched[0], touched[0] + 40
    lever = log["contact_point"][first : last + 1, 0] + 0.42
    impulse = (force[first : last + 1] * lever).sum() * 0.001
    closer = paper_door.door().restoring_torque(0.0) * (last + 1 - first) * 0.001
    gained = paper_door.i_a * log["door_velocity"][last]
    assert gained > 2.0
    assert gained == pytest.approx(impulse - closer, rel=0.01)


@EACH_ENGINE
@pytest.mark.parametrize("sole", ["rubber", "rigid"])
def test_reset_brings_back_the_same_run_bit_for_bit(make_world, sway, moving, engine, sole) -> None:
    """Runs after two resets are the same, bit for bit."""
    world = make_world(door_distance=0.47, sole=sole, engine=engine)  # partly with fine steps
    logs = []
    for _ in range(2):
        world.reset()
        world.push_door(6.0, 0.2)
        path = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
        world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), path), 0.0)
        logs.append(run(world, 0.85))
    for name, column in logs[0].items():
        np.testing.assert_array_equal(column, logs[1][name], err_msg=name)


def test_an_unknown_engine_is_an_error_that_names_the_known_ones() -> None:
    """The setting is checked before anything is built."""
    with pytest.raises(SettingError, match="engine is bullet, must be pybullet or mujoco"):
        WorldSettings(engine="bullet")


@pytest.mark.parametrize("engine", ENGINES)
def test_settings_and_log_name_the_engine_that_runs(make_world, engine) -> None:
    """It may be given by its name or as an object."""
    for given in (engine, make_engine(engine)):
        world = make_world(engine=given)
        assert world.engine.name == world.settings.engine == engine
        assert json.loads(str(world.log()["settings"]))["engine"] == engine
