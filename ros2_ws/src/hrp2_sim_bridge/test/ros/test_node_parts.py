"""Messages, parameters and pacing of the bridge's node, without a graph."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import rclpy
from door_impact_common.errors import SettingError
from hrp2_sim_bridge.ros import messages as convert
from hrp2_sim_bridge.ros.hrp2_sim_bridge_node import Company, Pacer
from hrp2_sim_bridge.ros.parameters import BridgeParameters
from hrp2_sim_bridge.sensors.imu import imu_variances
from hrp2_sim_bridge.settings import SensorSettings, WorldSettings
from humanoid_motion.driver_interface import ImuSample, TickSample
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def test_trajectory_message_keeps_its_content_and_emptiness() -> None:
    """Missing velocities stay missing, and a message without points means stop."""
    point = JointTrajectoryPoint(positions=[0.1, 0.2])
    point.time_from_start.sec, point.time_from_start.nanosec = 1, 500_000_000
    arrays = convert.trajectory_arrays(JointTrajectory(joint_names=["a", "b"], points=[point]))
    assert arrays.times == [1.5]
    assert arrays.positions == [[0.1, 0.2]]
    assert arrays.velocities == [[]]
    assert not arrays.is_stop
    assert convert.trajectory_arrays(JointTrajectory()).is_stop


@pytest.mark.parametrize("noisy", [True, False])
def test_messages_are_filled_anew_each_tick(robot, noisy: bool) -> None:
    """Messages carry stamp, values and frames of the last tick; covariances are diagonal."""
    settings = SensorSettings(sensor_noise=noisy)
    messages = convert.TickMessages(robot, imu_variances(settings), "robot1/")
    for scale in (1.0, 2.0):
        imu = ImuSample(np.array([0.0, 0.0, 0.6, 0.8]), np.arange(3.0), scale * np.arange(3.0, 6.0))
        joints = scale * np.arange(90.0).reshape(3, 30)
        wrenches = scale * np.arange(24.0).reshape(4, 6)
        messages.fill(round(scale * 1_500_000_000), TickSample(
            scale * 1.5, *joints, *wrenches[:2], imu, (), *wrenches[2:]))
    for message in (messages.joints, messages.imu, *messages.wrenches):
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (3, 0)
    assert [*messages.joints.name] == [*robot.joint_names]
    assert [*messages.joints.effort] == joints[2].tolist()
    assert messages.imu.linear_acceleration.z == 10.0
    for message, row in zip(messages.wrenches, wrenches, strict=True):
        assert message.wrench.force.x == row[0]
        assert message.wrench.torque.z == row[5]
    assert messages.wrenches[1].header.frame_id == f"robot1/{robot.feet['right'].sole}"
    assert messages.imu.header.frame_id == f"robot1/{robot.imu_frame}"
    rate = settings.gyro_noise**2 if noisy else 0.0
    covariance = np.reshape(messages.imu.angular_velocity_covariance, (3, 3))
    np.testing.assert_allclose(covariance, rate * np.eye(3), rtol=1e-3)
    covariance = np.reshape(messages.imu.orientation_covariance, (3, 3))
    assert np.count_nonzero(covariance) == (3 if noisy else 0)
    assert covariance[0, 0] == covariance[1, 1] <= covariance[2, 2]


@contextmanager
def parameters(*assignments: str) -> Iterator[BridgeParameters]:
    """The parameters of a node that is given NAME:=VALUE."""
    flags = [word for each in assignments for word in ("-p", each)]
    rclpy.init(args=["--ros-args", *flags] if flags else None)
    node = rclpy.create_node("parameters_of_the_bridge")
    try:
        yield BridgeParameters(node)
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_the_nodes_defaults_are_those_of_the_library() -> None:
    """Parameters give the library's own defaults, except that no log is kept without a file."""
    with parameters() as given:
        assert WorldSettings(**given.world_settings()) == WorldSettings(log=False)


def test_parameters_become_settings() -> None:
    """Numbers may be typed as integers; the start must be a list of three finite numbers."""
    with parameters("robot_start:=[2, -1, 1]", "solver_iterations:=30", "restitution:=0",
                    "opens_to:=0.0", "sensor_noise:=0", "log_file:=run.npz") as given:
        found = WorldSettings(**given.world_settings())
    assert (found.start, found.iterations, found.restitution) == ((2.0, -1.0, 1.0), 30, 0.0)
    assert found.opens_to == 0.0
    assert found.log
    assert not found.sensors.sensor_noise
    for wrong in ("[2.0, 1.0]", "[2.0, 1.0, .nan]"):
        with parameters(f"robot_start:={wrong}") as refused, pytest.raises(
                SettingError, match="robot_start"):
            refused.world_settings()


def test_pacer_waits_for_real_time_and_does_not_hurry_after_a_long_stop() -> None:
    """After a long stop the simulation makes up for at most 0.2 s."""
    now = [0.0]
    pacer = Pacer(2.0, lambda: now[0])
    pacer.advance(0.1)
    assert pacer.wait() == pytest.approx(0.05)
    now[0] = 100.0
    for _ in range(82):
        pacer.advance(0.005)
    assert pacer.wait() > 0.0


def test_the_simulation_waits_for_the_node_that_moves_its_robot() -> None:
    """It is never 0.1 s ahead of it, and goes on when that has ended, or comes no farther."""
    real = [0.0]
    company = Company(lambda: real[0])
    assert not company.waits(5.0)
    company.handled(5.0)
    assert not company.waits(5.01)
    assert company.waits(5.1)
    company.handled(0.0)
    assert not company.waits(5.1)
    company.handled(5.0)
    real[0] = 1.0
    assert not company.waits(5.1)
