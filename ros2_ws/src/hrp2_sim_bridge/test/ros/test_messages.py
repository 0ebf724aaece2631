"""Tests of the conversions; they need the message packages, but no graph."""

import numpy as np
import pytest

pytest.importorskip("door_impact_msgs.msg")
pytest.importorskip("trajectory_msgs.msg")

from door_impact_common.stamps import stamp_of
from hrp2_sim_bridge.ros import messages as convert
from hrp2_sim_bridge.sensors.imu import imu_variances
from hrp2_sim_bridge.settings import SensorSettings
from humanoid_motion.driver_interface import ImuSample
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
def test_imu_message_carries_the_variances_on_its_diagonals(noisy: bool) -> None:
    """Covariances are row-major and diagonal; those of exact sensors are zero."""
    settings = SensorSettings(sensor_noise=noisy)
    sample = ImuSample(np.array([0.0, 0.0, 0.6, 0.8]), np.arange(3.0), np.arange(3.0, 6.0))
    message = convert.imu(stamp_of(0), "imu_link", sample, imu_variances(settings))
    rate = settings.gyro_noise**2 if noisy else 0.0
    force = settings.accelerometer_noise**2 + settings.accelerometer_bias**2 if noisy else 0.0
    covariance = np.reshape(message.angular_velocity_covariance, (3, 3))
    np.testing.assert_allclose(covariance, rate * np.eye(3), rtol=1e-3)
    covariance = np.reshape(message.linear_acceleration_covariance, (3, 3))
    np.testing.assert_allclose(covariance, force * np.eye(3))
    covariance = np.reshape(message.orientation_covariance, (3, 3))
    assert np.count_nonzero(covariance) == (3 if noisy else 0)
    assert covariance[0, 0] == covariance[1, 1] <= covariance[2, 2]
    assert message.linear_acceleration.z == 5.0
