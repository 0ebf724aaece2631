"""Messages from and to text, definitions of interfaces, and what a command refuses."""

import subprocess
import time
from collections.abc import Callable

import pytest
from geometry_msgs.msg import PoseStamped
from ros2_commands.errors import CommandError
from ros2_commands.messages import message_from_yaml, to_csv, to_yaml
from ros2_commands.topic import Rate
from sensor_msgs.msg import Imu, JointState, PointCloud2
from std_msgs.msg import Bool, Byte, Int8, String
from trajectory_msgs.msg import JointTrajectory

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]


def test_messages_from_yaml() -> None:
    """Numbers become floats where the field is one; rows, arrays and nested messages are filled."""
    imu = message_from_yaml(
        Imu, "{header: {stamp: {sec: 3}}, orientation: {x: 1}, "
        "angular_velocity_covariance: [0, 1, 2, 3, 4, 5, 6, 7, 8]}")  # fmt: skip
    assert (imu.header.stamp.sec, imu.orientation.x, imu.orientation.w) == (3, 1.0, 1.0)
    assert imu.angular_velocity_covariance.tolist() == list(range(9))
    joints = message_from_yaml(JointState, "{name: [a, b], position: [1, 2.5]}")
    assert joints == JointState(name=["a", "b"], position=[1.0, 2.5])
    path = message_from_yaml(JointTrajectory, "{points: [{time_from_start: {sec: 2}}, {}]}")
    assert [point.time_from_start.sec for point in path.points] == [2, 0]
    assert message_from_yaml(String, "{data: 5}").data == "5"
    before, now = time.time(), message_from_yaml(Imu, "{header: {stamp: now}}").header.stamp
    assert before - 1e-6 <= now.sec + 1e-9 * now.nanosec <= time.time()


@pytest.mark.parametrize(("kind", "text", "reason"), [
    (PoseStamped, "{pose: {orient: {}}}", "pose: Pose has no field 'orient'; its fields: "),
    (Imu, "{header: 3}", "header: Header needs a mapping"), (Imu, "3", "Imu needs a mapping"),
    (Imu, "{orientation: {x: a}}", "orientation: x: could not convert"),
    (Imu, "{angular_velocity_covariance: [1.0]}", "angular_velocity_covariance: "),
    (JointState, "{name: [1]}", "name: "), (Int8, "{data: 200}", "data: "),
    (Bool, "{data: [", "flow")])
def test_bad_values_are_refused(kind: type, text: str, reason: str) -> None:
    """The reason names the field."""
    with pytest.raises(CommandError, match=r"^Failed to populate field: ") as caught:
        message_from_yaml(kind, text)
    assert reason in str(caught.value)


def test_messages_as_text() -> None:
    """As ROS 2 prints them."""
    joints = JointState(name=["a"], position=[1.0, 2.0, 3.0])
    assert to_yaml(joints) == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\n"
        "name:\n- a\nposition:\n- 1.0\n- 2.0\n- 3.0\nvelocity: []\neffort: []\n"
    )
    assert "position: [1.0, 2.0, '...']\n" in to_yaml(joints, 2, flow=True)
    assert to_csv(joints) == "0,0,,a,1.0,2.0,3.0"
    assert to_yaml(Byte(data=b"\x01")) == 'data: "\\x01"\n'
    assert to_yaml(String(data="grüß"), 3) == "data: grü...\n"
    assert "data:\n- 1\n- 2\n" in to_yaml(PointCloud2(data=[1, 2]))


def test_rate_of_even_stamps() -> None:
    """The mean rate of the gaps, once a second."""
    rate = Rate(150)
    reports = [rate.add(1.0 + stamp / 64) for stamp in range(129)]
    assert [i for i, text in enumerate(reports) if text] == [64, 128]
    assert str(reports[64]).startswith("average rate: 64.000\n\tmin: 0.016s max: 0.016s")


def test_interfaces_are_shown_with_what_they_contain(ros2: Ros2) -> None:
    """Nested definitions stand indented below their field, comments only at the top."""
    shown = ros2("interface", "show", "geometry_msgs/msg/PointStamped").stdout
    assert shown.startswith("# This represents a Point with reference coordinate frame and ")
    assert "std_msgs/Header header\n\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n" in shown
    assert shown.endswith("Point point\n\tfloat64 x\n\tfloat64 y\n\tfloat64 z\n")
    bare = ros2("interface", "show", "--no-comments", "std_srvs/srv/SetBool").stdout
    assert bare == "bool data\n---\nbool success\nstring message\n"
    assert "    std_srvs/srv/SetBool\n" in ros2("interface", "list", "-s").stdout
    assert "std_srvs/srv/SetBool\n" in ros2("interface", "package", "std_srvs").stdout


@pytest.mark.parametrize(("command", "status", "reason"), [
    ("bag record", 1, "ros2 bag is not part of ros2_commands: record with the launch"),
    ("interface show std_msgs/msg/Nothing", 1, "Could not find the interface"),
    ("run nope x", 1, "Package 'nope' not found"),
    ("service call /x std_srvs/msg/Empty", 1, "The passed service type is invalid"),
    ("topic pub /x std_msgs/msg/Empty -r 0", 2, "a number above 0 expected"),
    ("topic pub /x std_msgs/msg/Empty -t " + 400 * "1", 2, "at most nine digits"),
    ("topic pub x/ std_msgs/msg/Empty", 1, "topic name must not end with")])
def test_bad_usage_is_told_in_a_sentence(
        ros2: Ros2, command: str, status: int, reason: str) -> None:
    """With an exit status, without a traceback."""
    done = ros2(*command.split())
    assert done.returncode == status
    assert reason in done.stderr
    assert "Traceback" not in done.stderr
