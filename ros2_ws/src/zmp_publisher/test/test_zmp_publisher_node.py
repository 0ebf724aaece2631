"""The node zmp_publisher, fed with messages."""

import numpy as np
import pinocchio as pin
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from door_impact_common.constants import GRAVITY
from geometry_msgs.msg import WrenchStamped
from hrp2_description.robot import load_robot_config
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
from zmp_publisher.zmp_publisher_node import ZmpPublisher

ROBOT = load_robot_config()
WEIGHT = ROBOT.mass * GRAVITY
PERIOD = 5_000_000
BETWEEN = 1_000_000  # from a wrench to the joint state of its period [ns]


@pytest.fixture
def node(request, monkeypatch):
    """The node, its publishers replaced by lists; `hear` has what hears each topic."""
    hear = {}
    monkeypatch.setattr(
        ZmpPublisher, "create_subscription",
        lambda self, kind, topic, callback, qos: hear.update({topic.lstrip("/"): callback}))
    rclpy.init(args=getattr(request, "param", []))
    node = ZmpPublisher()
    node.hear = lambda topic, message: hear[topic](message, {"source_timestamp": 0})
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


def _feed(node, time, left=0.5 * WEIGHT, right=0.5 * WEIGHT, torque_y=0.0,
          posture=ROBOT.half_sitting, names=ROBOT.joint_names):
    joints = _stamped(JointState(), time)
    joints.name, joints.position = list(names), [float(angle) for angle in posture]
    # As of ros2_control's broadcasters, each of which takes its own time.
    node.hear("left_foot/wrench", _wrench(time + BETWEEN, left, torque_y))
    node.hear("joint_states", joints)
    node.hear("right_foot/wrench", _wrench(max(time - BETWEEN, 0), right))


def _status(node):
    node._publish_diagnostics()
    status = node.sent["diagnostics"][-1].status[0]
    return status, {pair.key: pair.value for pair in status.values}


def test_each_complete_set_of_samples_gives_one_zmp_in_odom_with_its_stamp(node):
    for step in range(4):
        _feed(node, 1_000_000_000 + step * PERIOD, 0.75 * WEIGHT, 0.25 * WEIGHT)
    assert len(node.sent["zmp"]) == 4
    last = node.sent["zmp"][-1]
    assert (last.header.frame_id, last.header.stamp.sec) == ("odom", 1)
    assert last.header.stamp.nanosec == 3 * PERIOD
    assert (last.point.y, last.point.z) == (pytest.approx(0.095 * 0.5), 0.0)


def test_without_load_there_is_no_zmp_but_the_transforms_go_on(node):
    _feed(node, 0)
    for step in range(1, 41):
        _feed(node, step * PERIOD, 0.05 * WEIGHT, 0.05 * WEIGHT)
    assert len(node.sent["zmp"]) == 1
    assert len(node.sent["tf"]) == 11
    assert _status(node)[0].level == DiagnosticStatus.WARN


def test_the_feet_of_a_robot_that_hangs_are_tared_and_those_that_bear_it_are_not(node):
    for step in range(70):
        _feed(node, step * PERIOD)
    answer = node._on_tare(None, Trigger.Response())
    assert not answer.success
    assert "no foot is in the air: let the robot hang" in answer.message
    for step in range(70, 140):
        _feed(node, step * PERIOD, 45.0, -3.0, 0.5)
    answer = node._on_tare(None, Trigger.Response())
    assert answer.success
    assert answer.message == ("left_foot_offset: [0.0, 0.0, 45.0, 0.0, 0.5, 0.0]\n"
                              "right_foot_offset: [0.0, 0.0, -3.0, 0.0, 0.0, 0.0]")


def test_transforms_are_a_tree_at_the_tf_rate(node):
    """200 Hz of samples give 50 Hz of 37 transforms, each link once, base_link below odom."""
    for step in range(200):
        _feed(node, step * PERIOD)
    assert len(node.sent["tf"]) == 50
    first, *others = node.sent["tf"][-1].transforms
    children = [transform.child_frame_id for transform in (first, *others)]
    assert len(children) == len(set(children)) == 37
    assert (first.header.frame_id, first.child_frame_id) == ("odom", "base_link")
    assert first.transform.translation.z == pytest.approx(0.648702, abs=1e-6)
    assert {transform.header.frame_id for transform in others} <= {"odom", *children}


@pytest.mark.parametrize("node", [["--ros-args", "-p", "frame_prefix:=r1/"]], indirect=True)
def test_every_frame_gets_the_prefix(node):
    _feed(node, 0)
    stamped = [messages[-1].header.frame_id for name, messages in node.sent.items()
               if name in ("zmp", "com", "polygon")]
    frames = {name for each in node.sent["tf"][-1].transforms
              for name in (each.header.frame_id, each.child_frame_id)}
    assert {*stamped, node.sent["marker"][-1].markers[0].header.frame_id} == {"r1/odom"}
    assert len(frames) == 38
    assert all(name.startswith("r1/") for name in frames)


def test_missing_joints_and_nan_give_no_zmp_and_a_warning_that_names_the_joint(node, capfd):
    _feed(node, 0, posture=ROBOT.half_sitting[:-1], names=ROBOT.joint_names[:-1])
    bad = np.array(ROBOT.half_sitting)
    bad[3] = np.nan
    _feed(node, PERIOD, posture=bad)
    assert not node.sent["zmp"]
    assert "LARM_JOINT6" in capfd.readouterr().err
    _feed(node, 2 * PERIOD)
    assert len(node.sent["zmp"]) == 1


def test_a_quaternion_of_another_length_is_refused_with_its_length(node, capfd):
    message = _imu(0)
    message.orientation.z, message.orientation.w = 2.0**14, 0.0
    node.hear("imu", message)
    assert "the length of its quaternion is 16384, must be 1" in capfd.readouterr().err


def test_tilt_comes_from_the_imu_where_there_is_one(node):
    """The base leans as the IMU does, turns with the gyro alone, and is level without an IMU."""
    _feed(node, 0)
    assert _base(node)[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert _status(node)[1]["odometry"] == "soles"
    for step in range(4, 8):
        node.hear("imu", _imu(step * PERIOD, 0.03))
        _feed(node, step * PERIOD)
    assert _base(node)[0] == pytest.approx([0.0, 0.03, 0.0], abs=1e-9)
    assert _status(node)[1]["odometry"] == "soles and imu"
    node.hear("imu", _imu(8 * PERIOD, 0.0, rate=0.2))
    _feed(node, 8 * PERIOD)
    assert 0.9e-3 < _base(node)[0][2] <= 1e-3
    for step in range(9, 40):  # the IMU has fallen silent
        _feed(node, step * PERIOD)
    assert _base(node)[0][1] == pytest.approx(0.0, abs=1e-9)
    assert len(node.sent["zmp"]) == 37


@pytest.mark.parametrize("node", [
    [], ["--ros-args", "-p", "robot_start:=[3.0, -2.0, 1.5707963267948966]"]], indirect=True)
def test_after_a_jump_of_time_a_robot_that_has_moved_stands_at_its_start(node):
    """The middle of the soles is at `robot_start` at first, and when the stamps go back.

    One that stands still keeps its place, until the time is that of a new simulation.
    """
    x, y, yaw = node.get_parameter("robot_start").value
    turned = ROBOT.posture({"LLEG_JOINT0": 0.2, "RLEG_JOINT0": 0.2})
    for begin in (9_000_000_000, 0):
        for time, posture in ((begin, ROBOT.half_sitting), (begin + 500_000_000, turned)):
            node.hear("imu", _imu(time))
            _feed(node, time, posture=posture)
            if time == begin:
                angles, place = _base(node)
                assert angles == pytest.approx([0.0, 0.0, yaw], abs=1e-9)
                turn = np.array([np.cos(yaw), np.sin(yaw)])
                assert place[:2] == pytest.approx([x, y] - 0.00949 * turn, abs=1e-5)
        before = _base(node)
        assert abs(before[0][2] - yaw) > 0.05
        for leap in (1, -100):  # another clock that went back, and the driver's own
            node._topics._clock_went_back(None)
            for step in range(2):
                later = time + leap * 20_000_000 + step * PERIOD
                node.hear("imu", _imu(later))
                _feed(node, later, posture=turned)
            assert np.concatenate(_base(node)) == pytest.approx(np.concatenate(before))


def test_a_second_publisher_of_the_clock_is_named(node, capfd):
    """In the log and in the diagnostics."""
    for _ in range(2):
        node.create_publisher(Clock, "/clock", 1)
    node._look_at_graph()
    told = "more than one node publishes on /clock: /zmp_publisher, /zmp_publisher"
    assert told in _status(node)[0].message
    assert told in capfd.readouterr().err


def test_diagnostics_tell_margin_and_polygon(node):
    """Margin in millimetres, support and polygon; stale without samples, error outside."""
    assert _status(node)[0].level == DiagnosticStatus.STALE
    _feed(node, 0)
    status, values = _status(node)
    assert status.level == DiagnosticStatus.OK
    assert float(values["margin_mm"]) == pytest.approx(100.0, abs=0.1)
    assert values["support"] == "left+right"
    assert len(values["polygon"].split(";")) >= 4
    _feed(node, PERIOD, WEIGHT, 0.0, torque_y=-0.14 * WEIGHT)
    status, values = _status(node)
    assert status.level == DiagnosticStatus.ERROR
    assert float(values["margin_mm"]) == pytest.approx(-10.0, abs=0.1)
    assert values["support"] == "left"


def test_wrenches_of_exchanged_feet_are_doubted_while_the_other_foot_is_lifted(node):
    """The left knee is bent, the left foot in the air, and the left wrench bears the robot."""
    lifted = ROBOT.posture({"LLEG_JOINT2": -0.9, "LLEG_JOINT3": 1.6, "LLEG_JOINT4": -0.7})
    for step in range(200):
        share = min(1.0, step / 100)
        _feed(node, step * PERIOD, 0.0, WEIGHT,
              posture=(1.0 - share) * ROBOT.half_sitting + share * lifted)
    assert "foot/wrench" not in _status(node)[0].message
    for step in range(200, 400):
        _feed(node, step * PERIOD, WEIGHT, 0.0, posture=lifted)
    assert "exchanged" in _status(node)[0].message
