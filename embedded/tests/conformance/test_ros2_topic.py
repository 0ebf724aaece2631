"""`ros2 topic`, as text: what people read and what scripts take apart."""

import re
import signal
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]
pytestmark = pytest.mark.usefixtures("peer")

JOINTS = """\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: ''
name:
- a
- b
position:
- 1.0
- 2.5
velocity: []
effort: []
---
"""


def test_topics_are_listed(ros2: Ros2) -> None:
    """list prints sorted names, with types or only their number; hidden ones where asked for."""
    topics = ros2("topic", "list", "-t").stdout.splitlines()
    assert "/joints [sensor_msgs/msg/JointState]" in topics
    assert topics == sorted(topics)
    assert not any("_action" in line for line in topics)
    hidden = ros2("topic", "list", "--include-hidden-topics", "--no-daemon").stdout.splitlines()
    assert "/push/_action/feedback" in hidden
    verbose = ros2("topic", "list", "-v").stdout
    assert verbose.startswith("Published topics:\n * /")
    assert " * /joints [sensor_msgs/msg/JointState] 1 publisher\n" in verbose
    assert "\n\nSubscribed topics:\n" in verbose
    assert " * /say [std_msgs/msg/String] 1 subscriber\n" in verbose
    assert verbose.endswith("\n\n")


def test_a_topic_is_described(ros2: Ros2) -> None:
    """info counts the ends; type prints the type alone, or nothing and 1."""
    assert ros2("topic", "info", "/joints").stdout == (
        "Type: sensor_msgs/msg/JointState\nPublisher count: 1\nSubscription count: 0\n"
    )
    assert ros2("topic", "type", "/joints").stdout == "sensor_msgs/msg/JointState\n"
    assert ros2("topic", "find", "sensor_msgs/msg/Imu").stdout == "/imu\n"
    unknown = ros2("topic", "info", "/none")
    assert (unknown.stdout, unknown.stderr) == ("", "Unknown topic '/none'\n")
    unknown = ros2("topic", "type", "/none")
    assert (unknown.stdout, unknown.stderr, unknown.returncode) == ("", "", 1)


def test_messages_are_echoed_as_yaml(ros2: Ros2) -> None:
    """echo matches the publisher's QoS by itself; `---` ends each message."""
    assert ros2("topic", "echo", "--once", "/joints").stdout == JOINTS
    assert ros2("topic", "echo", "--once", "/latched").stdout == "data: kept\n---\n"
    flow = ros2("topic", "echo", "--once", "--flow-style", "--no-arr", "--no-str", "/joints").stdout
    assert flow == (
        "{header: {stamp: {sec: 0, nanosec: 0}, frame_id: '<string length: <0>>'}, "
        "name: '<sequence type: string, length: 2>', "
        "position: '<sequence type: double, length: 2>', "
        "velocity: '<sequence type: double, length: 0>', "
        "effort: '<sequence type: double, length: 0>'}\n---\n"
    )
    short = ros2("topic", "echo", "--once", "-l", "1", "/joints").stdout
    assert "name:\n- a\n- '...'\nposition:\n- 1.0\n- '...'\n" in short


def test_messages_are_echoed_in_parts(ros2: Ros2) -> None:
    """csv is one line; a field that is no message, and raw data, are as Python prints them."""
    assert ros2("topic", "echo", "--once", "--csv", "/joints").stdout == "0,0,,a,b,1.0,2.5,,\n"
    assert ros2("topic", "echo", "--once", "--field", "position", "joints").stdout == (
        "array('d', [1.0, 2.5])\n---\n"
    )
    assert ros2("topic", "echo", "--once", "--field", "header.stamp", "/joints").stdout == (
        "sec: 0\nnanosec: 0\n---\n"
    )
    raw = ros2("topic", "echo", "--once", "--raw", "/latched", "std_msgs/msg/String").stdout
    assert raw.startswith(r"b'\x00\x01\x00\x00\x05\x00\x00\x00kept\x00")
    assert raw.endswith("'\n---\n")


def test_what_cannot_be_echoed_is_said(ros2: Ros2) -> None:
    """Errors go to stderr, with 1."""
    bad = ros2("topic", "echo", "--once", "--field", "header.nope", "/joints")
    assert (bad.returncode, bad.stdout) == (1, "")
    assert bad.stderr == "Invalid field 'header.nope': 'Header' object has no attribute 'nope'\n"
    nobody = ros2("topic", "echo", "/none")
    assert nobody.stdout == "WARNING: topic [/none] does not appear to be published yet\n"
    assert nobody.stderr == "Could not determine the type for the passed topic\n"
    assert nobody.returncode == 1
    wrong = ros2("topic", "echo", "/none", "std_msgs/msg/Nothing")
    assert (wrong.returncode, wrong.stderr) == (1, "The passed message type is invalid\n")
    silent = ros2("topic", "echo", "--timeout", "0.1", "/none", "std_msgs/msg/String")
    assert (silent.returncode, silent.stdout, silent.stderr) == (0, "", "")


def test_messages_are_published(ros2: Ros2) -> None:
    """pub shows what it sends; the values of the fields are converted to the fields' types."""
    sent = ros2("topic", "pub", "-t", "2", "-r", "50", "/say", "std_msgs/String", "{data: 1}")
    lines = sent.stdout.splitlines()
    start = lines.index("publisher: beginning loop")
    assert set(lines[:start]) <= {"Waiting for at least 1 matching subscription(s)..."}
    assert lines[start + 1 :] == [
        "publishing #1: std_msgs.msg.String(data='1')", "",
        "publishing #2: std_msgs.msg.String(data='1')", "",
    ]  # fmt: skip
    quiet = ros2("topic", "pub", "--once", "-w", "0", "-p", "2", "/x", "std_msgs/msg/Empty")
    assert quiet.stdout == "publisher: beginning loop\n"
    stamped = ros2("topic", "pub", "--once", "-w", "0", "/x", "std_msgs/msg/Header", "stamp: now")
    assert re.search(r"Time\(sec=[1-9]\d+, nanosec=\d+\), frame_id=''\)\n", stamped.stdout)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["std_msgs/msg/String", "{dat: 1}"],
         "Failed to populate field: 'String' object has no attribute 'dat'"),
        (["std_msgs/msg/String", "text"],
         "The passed value needs to be a dictionary in YAML format"),
        (["std_msgs/msg/Float64", "{data: text}"],
         "Failed to populate field: could not convert string to float: 'text'"),
        (["std_msgs/msg/Header", "{stamp: 3}"],
         "Failed to populate field: Value '3' is expected to be a dictionary but is a int"),
        (["std_msgs/msg/Nothing"], "The passed message type is invalid"),
    ],
)  # fmt: skip
def test_what_cannot_be_published_is_said(ros2: Ros2, arguments: list[str], error: str) -> None:
    """The error names the field and the value."""
    done = ros2("topic", "pub", "--once", "-w", "0", "/x", *arguments)
    assert (done.returncode, done.stderr) == (1, error + "\n")


def _interrupted(start_ros2: Any, lines: int, *arguments: str) -> tuple[list[str], int]:
    """The first lines of a command that runs until Ctrl-C, and its exit code then."""
    process = start_ros2(*arguments)
    said = [process.stdout.readline() for _ in range(lines)]
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    return said, process.returncode


def test_rate_and_bandwidth(start_ros2: Any) -> None:
    """hz and bw report every second; after Ctrl-C the exit code is 2."""
    said, code = _interrupted(start_ros2, 2, "topic", "hz", "/joints", "--window", "40")
    assert re.fullmatch(r"average rate: \d+\.\d{3}\n", said[0])
    assert re.fullmatch(
        r"\tmin: \d\.\d{3}s max: \d\.\d{3}s std dev: \d\.\d{5}s window: (40|[1-3]\d)\n", said[1]
    )
    assert code == 2
    said, code = _interrupted(start_ros2, 3, "topic", "bw", "/joints")
    assert said[0] == "Subscribed to [/joints]\n"
    assert re.fullmatch(r"\d+(\.\d\d)? K?B/s from \d+ messages\n", said[1])
    assert re.fullmatch(
        r"\tMessage size mean: \d+(\.\d\d)? K?B min: \d+(\.\d\d)? K?B max: \d+(\.\d\d)? K?B\n",
        said[2],
    )
    assert code == 2


def test_an_endless_echo_ends_with_the_signal(start_ros2: Any) -> None:
    """A filter chooses messages; Ctrl-C gives 2."""
    said, code = _interrupted(
        start_ros2, 3, "topic", "echo", "--csv", "/joints", "--filter", "m.position[1] == 2.5"
    )
    assert said == ["0,0,,a,b,1.0,2.5,,\n"] * 3
    assert code == 2
