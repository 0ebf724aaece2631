import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import SensorSettings
from hrp2_sim_bridge.world import World

HALF_WIDTH = 0.065  # of a sole [m]
EXACT = SensorSettings(sensor_noise=False)


def run(world, seconds):
    """Step for a number of seconds or until the robot has fallen; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
        if world.fell:
            break
    return world.log()


def push(world, impulse):
    """Apply an impulse (2,) [N s] along x and y that changes the speed of the whole body."""
    client, body = world.engine.client, world.engine.robot.body
    linear, angular = client.getBaseVelocity(body)
    speed = np.array(linear)
    speed[:2] += np.array(impulse) / world.robot_config.mass
    client.resetBaseVelocity(body, speed.tolist(), angular)


def depth_and_tilt(log, side):
    """Return the depth of a sole's middle [m], its roll and its pitch [rad] at the end."""
    turn = rotation(log[f"{side}_sole_quaternion"][-1].astype(float))
    middle = np.array([0.015, 0.01 if side == "left" else -0.01, 0.0])
    depth = -(log[f"{side}_sole_position"][-1] + turn @ middle)[2]
    return depth, turn[2, 1], -turn[2, 0]


def about_middle(log, side):
    """Return a sole's normal force [N] and its moments about x and y through its middle [N m]."""
    wrench = log[f"{side}_wrench"][-100:].mean(axis=0)
    y = 0.01 if side == "left" else -0.01
    return wrench[2], wrench[3] - y * wrench[2], wrench[4] + 0.015 * wrench[2]


@pytest.fixture(scope="module")
def stood(robot, paper_door):
    """A world on rubber soles that stood for one second, and its log."""
    world = World(robot, paper_door, 0.9, -0.42, sole="rubber", sensors=EXACT)
    yield world, run(world, 1.0)
    world.close()


def test_soles_sag_by_weight_over_stiffness(stood, robot) -> None:
    """The soles sag by m g / 2 k on average, each by its load over k, and all corners bear."""
    world, log = stood
    stiffness = robot.sole_rubber.stiffness
    depths = []
    for side in SIDES:
        depths.append(depth_and_tilt(log, side)[0])
        assert depths[-1] == pytest.approx(about_middle(log, side)[0] / stiffness, rel=0.02)
    assert np.mean(depths) == pytest.approx(robot.mass * GRAVITY / 2.0 / stiffness, rel=0.02)
    corners = world.engine.floor_contacts()
    assert len(corners) == 8
    assert min(np.linalg.norm(corner.force) for corner in corners) > 10.0


@pytest.mark.nightly("a second of simulated time")
def test_soles_tilt_by_moment_over_stiffness(make_world, robot, sway) -> None:
    """The stiffness of a sole against rotation is k times half its width squared."""
    world = make_world(posture=sway(0.03), sole="rubber", sensors=EXACT)
    log = run(world, 1.0)
    stiffness = robot.sole_rubber.stiffness * HALF_WIDTH**2
    for side in SIDES:
        moment = about_middle(log, side)[1]
        assert abs(moment) > 1.0
        assert -moment / depth_and_tilt(log, side)[1] == pytest.approx(stiffness, rel=0.03)


def test_half_sitting_on_rubber_is_upright_with_the_zmp_under_the_com(stood) -> None:
    """With the stabilizer the robot stands on rubber as on rigid soles, without a tremor."""
    _, log = stood
    force, moment = np.zeros(3), np.zeros(3)
    for side in SIDES:
        wrench = log[f"{side}_wrench"][-200:].mean(axis=0)
        force += wrench[:3]
        moment += wrench[3:] + np.cross(log[f"{side}_sole_position"][-1], wrench[:3])
    zmp = np.array([-moment[1], moment[0]]) / force[2]
    np.testing.assert_allclose(zmp, log["com_position"][-1, :2], atol=1e-3)
    assert np.ptp(log["com_position"][-400:], axis=0).max() < 5e-4
    for quaternion in log["base_quaternion"]:
        assert rotation(quaternion)[2, 2] > np.cos(np.radians(0.1))


@pytest.mark.nightly("six seconds of simulated time each")
@pytest.mark.parametrize("impulse", [(23.0, 0.0), (0.0, 34.0)])
def test_a_push_topples_the_robot_only_without_the_stabilizer(make_world, impulse) -> None:
    """Pushes of 23 N s from behind and 34 from the side topple it only without the stabilizer."""
    fell = {}
    for stabilizer in (True, False):
        world = make_world(door_distance=2.0, sole="rubber", stabilizer=stabilizer)
        run(world, 0.1)
        push(world, impulse)
        log = run(world, 3.0)
        fell[stabilizer] = world.fell
        if stabilizer:
            assert rotation(log["base_quaternion"][-1])[2, 2] > np.cos(np.radians(1.0))
    assert fell == {True: False, False: True}


def sway_over_one_foot(world, sway, moving):
    """Move the CoM over the left sole and back in 2.5 s; return the log."""
    path = np.array([sway(y) for y in (0.0, 0.085, 0.085, 0.0)])
    world.follow(moving(np.array([0.1, 1.1, 1.6, 2.6]), path), 0.0)
    return run(world, 3.0)


@pytest.mark.nightly("six seconds of simulated time")
def test_a_sway_onto_one_foot_keeps_the_body_upright(make_world, sway, moving) -> None:
    """With the stabilizer the body tilts by at most 0.3 deg, without it by more than 2 deg."""
    tilt = {}
    for stabilizer in (True, False):
        world = make_world(sole="rubber", stabilizer=stabilizer, sensors=EXACT)
        sway_over_one_foot(world, sway, moving)
        tilt[stabilizer] = np.degrees(world.fall.max_tilt)
    assert tilt[True] < 0.3
    assert tilt[False] > 2.0


@pytest.mark.nightly("four seconds of simulated time")
def test_noise_of_the_sensors_does_not_shake_the_robot(make_world, sway, moving) -> None:
    """With noise in all sensors the tilt is at most 0.4 deg, and the CoM at rest moves 3 mm."""
    world = make_world(sole="rubber", seed=1)
    rest = run(world, 1.0)
    assert np.ptp(rest["com_position"], axis=0).max() < 3e-3
    sway_over_one_foot(world, sway, moving)
    assert np.degrees(world.fall.max_tilt) < 0.4
    assert not world.fell


@pytest.mark.nightly("ten seconds of simulated time")
@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_rubber_may_be_a_third_softer_or_stiffer_than_thought(
    make_world, robot, sway, moving, factor
) -> None:
    """The robot survives a push and a sway on rubber 30 % softer or stiffer than assumed."""
    known = robot.sole_rubber
    world = make_world(door_distance=2.0, sensors=EXACT, rubber_scale=factor)
    assert depth_and_tilt(run(world, 0.3), "left")[0] == pytest.approx(
        robot.mass * GRAVITY / 2.0 / factor / known.stiffness, rel=0.06)
    push(world, (12.0, 0.0))
    run(world, 2.0)
    sway_over_one_foot(world, sway, moving)
    assert not world.fell
