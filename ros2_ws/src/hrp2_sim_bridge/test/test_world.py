"""A robot that stands and moves in the default engine."""

import math
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import SettingError
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import SIDES
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.settings import SensorSettings, WorldSettings
from hrp2_sim_bridge.world import World

EXACT = SensorSettings(sensor_noise=False)
SWAY_TIMES = np.array([0.1, 0.5, 0.9, 1.3])
SWAY = (0.0, 0.04, -0.04, 0.0)


def run(world, seconds):
    """Step for a number of seconds or until the robot has fallen; return the log."""
    for _ in range(round(seconds / 0.005)):
        world.step()
        if world.fell:
            break
    return world.log()


def middle(log, row):
    """Return x, y and heading of the middle between the soles in a row of a log."""
    soles = [log[f"{side}_sole_position"][row] for side in SIDES]
    turn = rotation(log["left_sole_quaternion"][row])
    return np.array([*np.mean(soles, axis=0)[:2], math.atan2(turn[1, 0], turn[0, 0])])


@pytest.mark.nightly("four seconds of simulated time")
def test_a_robot_far_away_and_turned_stands_as_at_the_origin(make_world) -> None:
    """A robot 14 m away begins there, is pushed as at the origin to 0.1 mm, and is reset there."""
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
    """The leaf does not move with the robot: 5 m along the wall there is none."""
    near = make_world(door_distance=0.45, sole="rigid")
    away = make_world(door_distance=0.45, sole="rigid", start=(5.0, 0.0, 0.0))
    assert near.engine.leaf_distance(1.0) < 0.3
    assert away.engine.leaf_distance(1.0) == 1.0


def swaying(world, sway, moving, slower=1.0):
    """Start a sway from foot to foot."""
    postures = np.array([sway(y) for y in SWAY])
    world.follow(moving(SWAY_TIMES * slower, postures), 0.0)


def test_joints_follow_a_quick_motion_within_their_windup(make_world, robot, moving) -> None:
    """An arm raised at almost its largest speed follows to 5 mrad, 3 mm at 0.6 m."""
    world = make_world()
    up = robot.posture({"LARM_JOINT0": -1.45, "LARM_JOINT3": -1.2})
    times = np.array([0.05, 0.75, 1.4])
    path = np.array([robot.half_sitting, up, robot.half_sitting])
    world.follow(moving(times, path), 0.0)
    log = run(world, 1.5)
    error = np.abs(log["q"][4::5] - log["tick_reference"])
    assert np.abs(log["dq"]).max() > 3.0
    assert error.max() < 5e-3
    assert np.degrees(world.fall.max_tilt) < 1.0


@pytest.mark.nightly("four seconds of simulated time")
def test_changing_the_step_near_the_leaf_does_not_jolt(make_world, sway, moving) -> None:
    """A change of the physics step near the leaf does not disturb the motion."""
    world = make_world(door_distance=0.5, sole="rigid")
    swaying(world, sway, moving, slower=1.8)  # slow: no sole lifts off
    log = run(world, 2.2)
    fine = log["tick_fine"]
    changes = np.flatnonzero(np.diff(fine.astype(int)))
    assert len(changes) >= 2
    coarse = make_world(door_distance=0.5, sole="rigid", time_step_fine=0.0005)
    swaying(coarse, sway, moving, slower=1.8)
    plain = run(coarse, 2.2)
    assert np.abs(log["com_position"] - plain["com_position"]).max() < 1e-3
    for change in changes:
        around = slice(5 * change - 5, 5 * change + 15)
        for key in ("b_velocity", "com_velocity"):
            assert np.abs(log[key][around] - plain[key][around]).max() < 0.01


def test_position_error_decays_with_the_servos_time_constant(make_world, robot) -> None:
    """A motor's position error decays to 1/e in D / P of its servo."""
    world = make_world()
    joint, data = robot.index("LARM_JOINT4"), robot.drives
    time = data.speed_gain[joint] / data.position_gain[joint]
    before = world.joints.drives.position[joint]
    world.joints.drives.position[joint] += 0.02
    for _ in range(round(time / 0.005)):
        world.step()
    left = world.joints.drives.position[joint] - before
    assert left == pytest.approx(0.02 * np.exp(-1.0), rel=0.05)


@pytest.fixture(scope="module")
def stood(robot, paper_door):
    """A world on rigid soles that stood for a second, its log, and exact sensors' readings."""
    world = World(robot, paper_door, 0.9, -0.42, sole="rigid", sensors=EXACT)
    samples = [world.step() for _ in range(200)]
    yield world, world.log(), samples
    world.close()


def test_a_robot_that_is_only_planned_for_is_refused_by_what_it_lacks(robot, paper_door):
    """All fields that are missing are named at once; what is switched off is not missed."""
    blind = {**robot.feet, "left": replace(robot.feet["left"], sensor_joint=None)}
    with pytest.raises(RobotConfigError, match=r"\['imu_frame', 'feet.left.sensor_joint'\]"):
        World(replace(robot, imu_frame=None, feet=blind), paper_door, 0.9, -0.42)
    bare = replace(robot, drives=None, sole_rubber=None)
    with pytest.raises(RobotConfigError, match=r"HRP-2 cannot .*'drives', 'sole_rubber'\]"):
        World(bare, paper_door, 0.9, -0.42)
    with pytest.raises(RobotConfigError, match=r"\['drives'\]"):
        World(bare, paper_door, 0.9, -0.42, sole="rigid")


@pytest.mark.parametrize("place", [(-1.0, -0.42), (0.9, math.nan), (0.9, 11.0)])
def test_a_door_that_is_nowhere_near_is_refused(robot, paper_door, place) -> None:
    """A door farther than 10 m away, behind the robot, or at NaN is refused."""
    with pytest.raises(SettingError, match=r"door_distance|hinge_x"):
        World(robot, paper_door, *place)


def test_the_friction_of_soles_and_floor_is_the_one_that_was_asked_for(stood, robot) -> None:
    """The friction of a sole multiplied by that of the floor is the configured one."""
    world = stood[0]
    client, floor = world.engine.client, world.engine.floor
    for foot in robot.feet.values():
        sole = world.engine.link_names.index(foot.sole)
        pair = client.getDynamicsInfo(floor, -1)[1] * client.getDynamicsInfo(
            world.engine.body, sole)[1]
        assert pair == pytest.approx(WorldSettings.friction)


def test_motor_torques_are_those_of_statics_for_the_arms(stood, robot) -> None:
    """The torques of the free arms and the head are those of gravity."""
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(robot.urdf_path), pin.JointModelFreeFlyer())
    q = pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.half_sitting, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    gravity = pin.computeGeneralizedGravity(model, model.createData(), q)
    for index, name in enumerate(robot.joint_names):
        if "ARM" in name or "HEAD" in name:
            wanted = gravity[model.joints[model.getJointId(name)].idx_v]
            assert stood[2][-1].effort[index] == pytest.approx(wanted, abs=0.05)


def push(world, impulse):
    """Apply an impulse (2,) [N s] along x and y that changes the speed of the whole body."""
    client, body = world.engine.client, world.engine.body
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


@pytest.mark.nightly("a second of simulated time")
def test_soles_tilt_by_moment_over_stiffness(make_world, robot, sway) -> None:
    """The stiffness of a sole against rotation is k times half its width squared."""
    world = make_world(posture=sway(0.03), sole="rubber", sensors=EXACT)
    log = run(world, 1.0)
    stiffness = robot.sole_rubber.stiffness * 0.065**2
    for side in SIDES:
        moment = about_middle(log, side)[1]
        assert abs(moment) > 1.0
        assert -moment / depth_and_tilt(log, side)[1] == pytest.approx(stiffness, rel=0.03)


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
