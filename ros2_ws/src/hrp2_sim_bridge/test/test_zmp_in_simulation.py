"""ZMP and odometry of a simulated robot, compared with the simulator's true states."""

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.kinematics import RobotKinematics
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator

pytest.importorskip("pybullet")
ROBOT = load_robot_config()


@pytest.fixture(scope="module")
def moved():
    """The trunk moves 38 mm forward in one second and stands for half a second, on rigid soles."""
    from hrp2_sim_bridge.world import World
    from humanoid_motion.driver_interface import TrajectoryArrays

    world = World(ROBOT, load_door("paper"), 0.9, -0.5, sole="rigid")
    target = np.array(ROBOT.half_sitting)
    for side in "RL":
        for number, degrees in {2: -22.0, 3: 50.0, 4: -28.0}.items():
            target[ROBOT.index(f"{side}LEG_JOINT{number}")] = np.deg2rad(degrees)
    still = [0.0] * 30
    world.driver.accept(
        TrajectoryArrays(ROBOT.joint_names, [1.0], [list(target)], [still], [still]),
        0.0,
        world.time,
    )
    odometry = FootOdometry(RobotKinematics(ROBOT), loaded_force=0.05 * ROBOT.mass * GRAVITY)
    zmp = ZmpEstimator(ROBOT.mass * GRAVITY, ROBOT.soles)
    poses, readings = [], []
    for _ in range(300):
        tick = world.step()
        wrenches = {"left": tick.left_wrench, "right": tick.right_wrench}
        pose = odometry.update(tick.position, {side: row[2] for side, row in wrenches.items()})
        poses.append(pose)
        readings.append(zmp.read(pose.soles, wrenches))
    log = world.log()
    world.close()
    return poses, readings, log


def test_odometry_follows_the_simulators_truth(moved):
    """Joint angles and foot loads alone give base_link to 1 mm while the robot moves by 38 mm."""
    poses, _, log = moved
    at = np.searchsorted(log["time"], np.arange(1, 301) * 0.005 - 1e-6)
    truth = log["base_position"][at]
    measured = np.array([pose.base[:3, 3] for pose in poses])
    assert np.ptp(truth[:, 0]) > 0.035
    assert np.linalg.norm(measured - truth, axis=1).max() < 1e-3


def test_standing_zmp_is_below_the_com_in_simulation(moved):
    """When the robot stands still again, the ZMP is the projection of the CoM to 1 mm."""
    _, readings, log = moved
    assert log["com_position"][-1, 0] > 0.03
    np.testing.assert_allclose(readings[-1].point, log["com_position"][-1, :2], atol=1e-3)
    assert readings[-1].normal_force == pytest.approx(ROBOT.mass * GRAVITY, rel=0.005)
    assert readings[-1].loaded == ("left", "right")


def test_moving_zmp_leads_the_com_as_a_pendulums_does(moved):
    """During the motion the ZMP differs from the CoM by the acceleration times z / g, to 5 mm."""
    _, readings, log = moved
    ticks = np.arange(20, 200)
    at = np.searchsorted(log["time"], (ticks + 1) * 0.005 - 1e-6)
    velocity = log["com_velocity"]
    acceleration = np.gradient(velocity, log["time"], axis=0)[at]
    com = log["com_position"][at]
    pendulum = com[:, :2] - com[:, 2:] / GRAVITY * acceleration[:, :2]
    measured = np.array([readings[tick].point for tick in ticks])
    assert np.abs(pendulum - com[:, :2]).max() > 0.005
    # The pendulum leaves out the change of angular momentum, small with the trunk upright.
    assert np.sqrt(np.mean((measured - pendulum) ** 2)) < 0.005
