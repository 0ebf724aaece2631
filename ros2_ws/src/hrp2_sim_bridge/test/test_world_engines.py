"""The world in each physics engine: what holds whichever engine computes the motion."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import ENGINES, SensorSettings, WorldSettings
from hrp2_sim_bridge.world import World

EXACT = SensorSettings(sensor_noise=False)
OTHERS = pytest.mark.parametrize(  # the other files test the default engine
    "engine", [engine for engine in ENGINES if engine != WorldSettings.engine])


@pytest.fixture(scope="module", autouse=True)
def installed() -> None:
    """Skip these tests where an engine is not installed."""
    for engine in ENGINES:
        pytest.importorskip(engine)


def run(world, seconds):
    """Step for a number of seconds; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
    return world.log()


@pytest.fixture(scope="module")
def sways(robot, paper_door, sway, moving):
    """The logs of a sway from foot to foot, by the engine."""
    logs = {}
    for engine in ENGINES:
        world = World(robot, paper_door, 0.9, -0.42, engine=engine, sensors=EXACT)
        postures = np.array([sway(y) for y in (0.0, 0.04, -0.04, 0.0)])
        world.follow(moving(np.array([0.1, 0.5, 0.9, 1.3]), postures), 0.0)
        logs[engine] = run(world, 1.4)
        assert not world.fell
        world.close()
    return logs


@OTHERS
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


@pytest.mark.parametrize("engine", ENGINES)
def test_wrenches_change_the_momentum_as_newton_says(sways, robot, engine) -> None:
    """The impulse of the computed wrenches is the change of the momentum."""
    log = sways[engine]
    force = np.zeros((len(log["time"]), 3))
    for side in SIDES:
        turn = rotation(log[f"{side}_sole_quaternion"])
        force += (turn @ log[f"{side}_wrench"][:, :3, None])[..., 0]
    force[:, 2] -= robot.mass * GRAVITY
    impulse = np.cumsum(force[1:], axis=0) * 0.001
    momentum = robot.mass * (log["com_velocity"][1:] - log["com_velocity"][0])
    assert np.abs(momentum[:, 1]).max() > 10.0
    np.testing.assert_allclose(momentum, impulse, atol=0.15)


@pytest.mark.parametrize("engine", ENGINES)
def test_logged_velocities_are_the_slopes_of_logged_positions(sways, engine) -> None:
    """The logged velocities are the derivatives of the logged positions."""
    log = sways[engine]
    for position, velocity in (
        ("com_position", "com_velocity"), ("b_position", "b_velocity"),
        ("base_position", "base_linear_velocity"),
    ):
        moved = log[position][-1] - log[position][0]
        integral = log[velocity][1:].sum(axis=0) * 0.001
        np.testing.assert_allclose(integral, moved, atol=3e-4)
        slope = np.gradient(log[position], 0.001, axis=0)[50:-50]
        # Sudden changes of the floor's forces show in a derivative over 2 ms.
        assert np.median(np.abs(slope - log[velocity][50:-50])) < 2e-3


def test_two_engines_show_the_same_sway(sways) -> None:
    """On rubber the CoM's path differs by less than 1 mm, a foot's load by 3 % of m g.

    On rigid soles the robot rocks on edges, which multiplies every small difference.
    """
    logs = [sways[engine] for engine in ENGINES]
    first, second = (log["com_position"] for log in logs)
    assert np.ptp(first[:, 1]) > 0.05
    assert np.abs(first - second).max() < 1e-3
    loads = [log["left_wrench"][:, 2].reshape(-1, 50).mean(axis=1) for log in logs]
    assert np.abs(loads[0] - loads[1]).max() < 0.03 * 58.0 * GRAVITY


@OTHERS
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


def test_an_unknown_engine_is_an_error_that_names_the_known_ones() -> None:
    """The setting is checked before anything is built."""
    with pytest.raises(SettingError, match="bullet"):
        WorldSettings(engine="bullet")
