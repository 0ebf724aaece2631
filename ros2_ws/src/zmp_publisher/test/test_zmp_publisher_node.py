"""The node zmp_publisher, fed with messages."""

import numpy as np
import pinocchio as pin
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from door_impact_common.constants import GRAVITY
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import load_robot_config
from sensor_msgs.msg import Imu, JointState
from zmp_publisher.zmp_publisher_node import ZmpPublisher

ROBOT = load_robot_config()
WEIGHT = ROBOT.mass * GRAVITY
PERIOD = 5_000_000


@pytest.fixture
def node():
    """The node, its publishers replaced by lists."""
    rclpy.init()
    node = ZmpPublisher()
    node.sent = {"zmp": [], "tf": [], "com": [], "polygon": [], "marker": [], "diagnostics": []}
    for name, messages in node.sent.items():
        publisher = node._diagnostics if name == "diagnostics" else getattr(
            node, f"_{name}_publisher")
        publisher.publish = messages.append
        publisher.get_subscription_count = lambda: 1
    yield node
    node.destroy_node()
    rclpy.shutdown()


def _stamped(message, time):
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time, 1_000_000_000)
    return message


def _joints(time, posture=ROBOT.half_sitting, names=ROBOT.joint_names):
    message = _stamped(JointState(), time)
    message.name, message.position = list(names), [float(angle) for angle in posture]
    return message


def _wrench(time, normal, torque_y=0.0):
    message = _stamped(WrenchStamped(), time)
    message.wrench.force.z, message.wrench.torque.y = float(normal), float(torque_y)
    return message


def _imu(time, pitch=0.0, rate=0.0):
    message = _stamped(Imu(), time)
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, pitch, 2.0))
    message.orientation.x, message.orientation.y = float(turn.x), float(turn.y)
    message.orientation.z, message.orientation.w = float(turn.z), float(turn.w)
    message.angular_velocity.z = rate
    return message


def _base(node):
    """Roll, pitch and heading of base_link, and its position, in the last transforms."""
    transform = node.sent["tf"][-1].transforms[0].transform
    turn, to = transform.rotation, transform.translation
    matrix = pin.Quaternion(turn.w, turn.x, turn.y, turn.z).matrix()
    return pin.rpy.matrixToRpy(matrix), np.array([to.x, to.y, to.z])


def _feed(node, time, left=0.5 * WEIGHT, right=0.5 * WEIGHT, **joints):
    node._take("left", _wrench(time, left))
    node._take("joints", _joints(time, **joints))
    node._take("right", _wrench(time, right))


def _status(node):
    node._publish_diagnostics()
    status = node.sent["diagnostics"][-1].status[0]
    return status, {pair.key: pair.value for pair in status.values}


def test_zmp_in_odom_with_the_samples_stamp(node):
    """Each complete set of samples gives one point, in odom, at its own stamp."""
    for step in range(4):
        _feed(node, 1_000_000_000 + step * PERIOD, 0.75 * WEIGHT, 0.25 * WEIGHT)
    assert len(node.sent["zmp"]) == 4
    last = node.sent["zmp"][-1]
    assert (last.header.frame_id, last.header.stamp.sec) == ("odom", 1)
    assert last.header.stamp.nanosec == 3 * PERIOD
    assert last.point.y == pytest.approx(0.095 * 0.5)
    assert last.point.z == 0.0


def test_silent_below_the_threshold_but_tf_goes_on(node):
    """In the air no /zmp is published; transforms continue from the last foothold."""
    _feed(node, 0)
    for step in range(1, 41):
        _feed(node, step * PERIOD, 0.05 * WEIGHT, 0.05 * WEIGHT)
    assert len(node.sent["zmp"]) == 1
    assert len(node.sent["tf"]) == 11
    status, _ = _status(node)
    assert status.level == DiagnosticStatus.WARN


def test_transforms_are_a_tree_at_the_tf_rate(node):
    """200 Hz of samples give 50 Hz of 37 transforms, each link once, base_link below odom."""
    for step in range(200):
        _feed(node, step * PERIOD)
    assert len(node.sent["tf"]) == 50
    transforms = node.sent["tf"][-1].transforms
    children = [transform.child_frame_id for transform in transforms]
    assert len(children) == len(set(children)) == 37
    first = transforms[0]
    assert (first.header.frame_id, first.child_frame_id) == ("odom", "base_link")
    assert first.transform.translation.z == pytest.approx(0.648702, abs=1e-6)
    assert {t.header.frame_id for t in transforms} <= {"odom", *children}


def test_bad_joint_states_are_skipped(node, capfd):
    """Missing joints and NaN give no ZMP and a warning that names the joint."""
    _feed(node, 0, posture=ROBOT.half_sitting[:-1], names=ROBOT.joint_names[:-1])
    bad = np.array(ROBOT.half_sitting)
    bad[3] = np.nan
    _feed(node, PERIOD, posture=bad)
    assert not node.sent["zmp"]
    assert "LARM_JOINT6" in capfd.readouterr().err
    _feed(node, 2 * PERIOD)
    assert len(node.sent["zmp"]) == 1


def test_time_jump_backwards_fixes_odom_anew(node):
    """After a reset the robot stands at the origin, whatever its base had moved to before."""
    _feed(node, 10_000_000_000)
    turned = np.array(ROBOT.half_sitting)
    turned[[ROBOT.index("LLEG_JOINT0"), ROBOT.index("RLEG_JOINT0")]] = 0.2
    _feed(node, 10_020_000_000, posture=turned)
    moved = node.sent["tf"][-1].transforms[0].transform.rotation.z
    assert abs(moved) > 0.05
    _feed(node, 0)
    base = node.sent["tf"][-1].transforms[0].transform
    assert base.rotation.z == pytest.approx(0.0, abs=1e-9)
    assert base.translation.x == pytest.approx(-0.009490, abs=1e-6)


def test_tilt_comes_from_the_imu_where_there_is_one(node):
    """The base leans as the IMU does, turns with the gyro alone, and is level without an IMU."""
    _feed(node, 0)
    assert _base(node)[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert _status(node)[1]["odometry"] == "soles"
    for step in range(4, 8):
        node._take_imu(_imu(step * PERIOD, 0.03))
        _feed(node, step * PERIOD)
    assert _base(node)[0] == pytest.approx([0.0, 0.03, 0.0], abs=1e-9)
    assert _status(node)[1]["odometry"] == "soles and imu"
    node._take_imu(_imu(8 * PERIOD, 0.0, rate=0.2))
    _feed(node, 8 * PERIOD)
    assert 0.9e-3 < _base(node)[0][2] <= 1e-3
    for step in range(9, 40):  # the IMU has fallen silent
        _feed(node, step * PERIOD)
    assert _base(node)[0][1] == pytest.approx(0.0, abs=1e-9)
    assert len(node.sent["zmp"]) == 37


@pytest.mark.parametrize("wrong", ["orientation", "nan"])
def test_an_imu_that_says_nothing_does_not_count(node, wrong, capfd):
    """By REP-145 a covariance of -1 means that a field is not filled in; NaN is no rotation."""
    for step in range(0, 20, 4):
        message = _imu(step * PERIOD, 0.05)
        if wrong == "orientation":
            message.orientation_covariance[0] = -1.0
        else:
            message.angular_velocity.z = float("nan")
        node._take_imu(message)
        _feed(node, step * PERIOD)
    assert len(node.sent["zmp"]) == 5
    assert _base(node)[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert "imu" in capfd.readouterr().err


@pytest.mark.parametrize("with_imu", [False, True])
def test_a_start_elsewhere_and_a_reset_there(with_imu):
    """The middle of the soles is at `robot_start` at first, and again when the stamps go back."""
    rclpy.init(args=["--ros-args", "-p", "robot_start:=[3.0, -2.0, 1.5707963267948966]"])
    node = ZmpPublisher()
    transforms = []
    node._tf_publisher.publish = transforms.append
    node._tf_publisher.get_subscription_count = lambda: 1
    node.sent = {"tf": transforms}
    turned = np.array(ROBOT.half_sitting)
    turned[[ROBOT.index("LLEG_JOINT0"), ROBOT.index("RLEG_JOINT0")]] = 0.2
    try:
        for times in ((9_000_000_000, 9_020_000_000), (0, 20_000_000)):
            for time, posture in zip(times, (ROBOT.half_sitting, turned), strict=True):
                if with_imu:
                    node._take_imu(_imu(time, rate=-10.0 if time % 1_000_000_000 else 0.0))
                _feed(node, time, posture=posture)
                if time == times[0]:
                    angles, place = _base(node)
                    assert angles == pytest.approx([0.0, 0.0, np.pi / 2.0], abs=1e-9)
                    assert place[:2] == pytest.approx([3.0, -2.00949], abs=1e-5)
            assert abs(_base(node)[0][2] - np.pi / 2.0) > 0.05
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_diagnostics_tell_margin_and_polygon(node):
    """Margin in millimetres, support and polygon; stale without samples, error outside."""
    status, _ = _status(node)
    assert status.level == DiagnosticStatus.STALE
    _feed(node, 0)
    status, values = _status(node)
    assert status.level == DiagnosticStatus.OK
    assert float(values["margin_mm"]) == pytest.approx(100.0, abs=0.1)
    assert values["support"] == "left+right"
    assert len(values["polygon"].split(";")) >= 4
    node._take("joints", _joints(PERIOD))
    node._take("left", _wrench(PERIOD, WEIGHT, torque_y=-0.14 * WEIGHT))
    node._take("right", _wrench(PERIOD, 0.0))
    status, values = _status(node)
    assert status.level == DiagnosticStatus.ERROR
    assert float(values["margin_mm"]) == pytest.approx(-10.0, abs=0.1)
    assert values["support"] == "left"
