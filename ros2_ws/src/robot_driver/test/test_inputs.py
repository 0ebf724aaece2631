"""What arrives from a robot's sensors is checked before anything rests on it."""

from types import SimpleNamespace

import numpy as np
import pytest
from humanoid_motion.samples import NO_IMU, ImuSample
from rclpy.qos import ReliabilityPolicy
from robot_driver.inputs import Inputs, Motion
from robot_driver.intake import Arrival
from robot_driver.messages import imu_sample
from robot_driver.names import COMMANDERS, TRAJECTORY
from robot_driver.topics import crowded, silence_of
from sensor_msgs.msg import Imu

HALF_SITTING, STILL = np.array([0.4, -0.8, 0.4]), np.zeros(3)
TICK = 0.005


def joints(inputs: Inputs, stamp: float, position: np.ndarray = HALF_SITTING) -> bool:
    """Whether a joint state is accepted, which arrives at its stamp."""
    inputs.on_joints(Arrival(stamp, stamp, 0.0), position, STILL)
    return inputs.joints is not None and inputs.joints[0] == stamp


ROBOT = SimpleNamespace(
    joint_names=("HIP", "KNEE", "ANKLE"), lower=np.full(3, -1.5), upper=np.full(3, 1.5),
    speed_limit=np.full(3, 4.0), config=SimpleNamespace(half_sitting=HALF_SITTING),
    base_tilt=lambda position, turn: 0.0)


@pytest.fixture
def inputs() -> Inputs:
    """Those of a robot that has stood for 2 s."""
    made = Inputs(ROBOT)
    for stamp in np.arange(100.0, 102.0, TICK):
        assert joints(made, stamp)
    return made


@pytest.mark.parametrize("late", [TICK, 0.015, 0.9])
def test_a_late_sample_is_dropped_and_counted(inputs: Inputs, late: float) -> None:
    assert not joints(inputs, 102.0 - TICK - late)
    assert list(inputs.intake.dropped.values()) == [1]
    assert inputs.intake.clocks == 0
    assert joints(inputs, 102.0)


def test_a_stamp_that_goes_back_by_more_than_a_second_begins_a_new_clock(inputs: Inputs) -> None:
    assert joints(inputs, 3.0, HALF_SITTING + 1.0)
    assert inputs.intake.clocks == 1


def tick(inputs: Inputs, stamp: float, speed: np.ndarray = STILL) -> None:
    """Joints and wrenches of one time."""
    arrival = Arrival(stamp, stamp, 0.0)
    inputs.on_wrench("left", arrival, np.zeros(6))
    inputs.on_joints(arrival, HALF_SITTING, speed)
    inputs.on_wrench("right", arrival, np.zeros(6))


@pytest.mark.parametrize("observes", [True, False])
def test_only_who_observes_hears_samples_without_speeds_or_an_imu(observes: bool) -> None:
    inputs = Inputs(ROBOT, observes=observes)
    for number in range(20):
        tick(inputs, 100.0 + TICK * number, np.full(3, np.nan) if number < 10 else STILL)
    assert len(inputs.recent) == 20 * observes
    assert all(each.imu is NO_IMU for each in inputs.recent)
    assert joints(inputs, 101.0)


def test_an_imu_with_stamps_of_its_own_gives_every_sample_its_nearest_reading() -> None:
    inputs, level = Inputs(ROBOT), np.array([0.0, 0.0, 0.0, 1.0])
    for number in range(20):
        if number % 2:  # at 100 Hz
            stamp = 100.001 + TICK * number
            inputs.on_imu(Arrival(stamp, stamp, 0.0), ImuSample(level, STILL, np.full(3, number)))
        tick(inputs, 100.0 + TICK * number)
    nearest = [each.imu.specific_force[0] for each in inputs.recent]
    assert nearest == [number - 1 + number % 2 for number in range(1, 20)]  # heard from 1 on


def test_nothing_of_an_old_clock_is_left_in_a_new_one() -> None:
    """The motion is told, and no sample is complete by what is older."""
    class Heard(Motion):
        running, given_up = False, 0

        def give_up(self, reason: str) -> None:
            self.given_up += 1

        def lags(self, seconds: float) -> None:
            pass

    inputs = Inputs(ROBOT, observes=True)
    inputs.motion = heard = Heard()
    for begin in (100.0, 50.0, 3.0):
        tick(inputs, begin)
        assert len(inputs.recent) == 1
        inputs.on_wrench("left", Arrival(begin + TICK, begin + TICK, 0.0), np.zeros(6))
    assert heard.given_up == 2
    assert inputs.unpaired == 0


def test_a_second_publisher_whose_robot_is_elsewhere_is_left_out(inputs: Inputs) -> None:
    """Zeros with the driver's stamp arrive before each of its messages, for five seconds."""
    for stamp in np.arange(102.0, 107.0, TICK):
        inputs.on_joints(Arrival(stamp, stamp, 0.0), STILL, STILL)
        assert joints(inputs, stamp)
    np.testing.assert_array_equal(inputs.joints[1], HALF_SITTING)
    assert list(inputs.intake.dropped) == [("joint_states", "a value jumps")]


@pytest.mark.parametrize(("position", "speed", "name"), [
    (np.degrees(HALF_SITTING), STILL, "KNEE [rad]: -45.84, at most 1.8"),
    (HALF_SITTING, np.array([0.0, 0.0, 57.3]), "speed of ANKLE [rad/s]: 57.3, at most 8"),
    (np.array([0.4, -0.8, np.nan]), STILL, "ANKLE [rad]: nan")])
def test_degrees_and_what_is_no_number_are_dropped_and_named(
        inputs: Inputs, position: np.ndarray, speed: np.ndarray, name: str) -> None:
    inputs.on_joints(Arrival(102.0, 102.0, 0.0), position, speed)
    assert name in inputs.intake.last_dropped["joint_states"]


def test_a_robot_that_was_moved_while_nothing_arrived_is_believed(inputs: Inputs) -> None:
    assert not joints(inputs, 102.0, STILL)
    assert joints(inputs, 103.5, STILL)


def imu(**changes: tuple[str, float]) -> Imu:
    """The message of an IMU that lies level, with one of its parts changed."""
    message = Imu()
    message.linear_acceleration.z = 9.81
    for part, (name, value) in changes.items():
        if part.endswith("covariance"):
            getattr(message, part)[0] = value
        else:
            setattr(getattr(message, part), name, value)
    return message


@pytest.mark.parametrize("message", [
    Imu(), imu(orientation_covariance=("", -1.0)), imu(orientation=("w", 0.0)),
    imu(orientation=("x", np.nan)), imu(angular_velocity=("y", np.nan)),
    imu(angular_velocity_covariance=("", -1.0)), imu(linear_acceleration=("z", np.nan))])
def test_an_imu_without_an_orientation_or_a_number_gives_no_reading(message: Imu) -> None:
    """A message as constructed is no robot that stands upright."""
    assert imu_sample(message) is None


def test_an_imu_without_an_accelerometer_has_a_specific_force_of_zeros() -> None:
    """By REP 145 a covariance of -1 means that a field is not measured."""
    message = imu(orientation=("x", 0.1), linear_acceleration_covariance=("", -1.0))
    reading = imu_sample(message)
    assert reading is not None
    assert not reading.specific_force.any()


@pytest.mark.parametrize(("publishers", "cause"), [
    ([], "nobody publishes there"), ([ReliabilityPolicy.RELIABLE], ""),
    ([ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT], "imu_driver publishes with")])
def test_a_silent_topic_is_explained_by_its_publishers(
        publishers: list[ReliabilityPolicy], cause: str) -> None:
    """A reliable subscription gets nothing from a publisher with the QoS best effort."""
    found = [SimpleNamespace(node_name="imu_driver", qos_profile=SimpleNamespace(reliability=each))
             for each in publishers]
    text = silence_of(SimpleNamespace(get_publishers_info_by_topic=lambda _: found), "imu")
    assert cause in text
    assert bool(text) == bool(cause)


def test_another_robots_commander_is_foreign() -> None:
    """Who may send trajectories in one namespace may not in another."""
    names = [("/robot1", COMMANDERS[0])]
    node = SimpleNamespace(
        get_namespace=lambda: "/robot1", get_publishers_info_by_topic=lambda _: [
            SimpleNamespace(node_namespace=space, node_name=name) for space, name in names])
    assert crowded(node, [TRAJECTORY]) == {}
    names.append(("/", COMMANDERS[0]))
    assert crowded(node, [TRAJECTORY]) == {
        TRAJECTORY: [f"/{COMMANDERS[0]}", f"/robot1/{COMMANDERS[0]}"]}
