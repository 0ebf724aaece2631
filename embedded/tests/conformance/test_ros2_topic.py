"""`ros2 topic`, as text: what people read and what scripts take apart."""

import re
import signal
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

Each = Callable[..., "list[subprocess.CompletedProcess[str]]"]
pytestmark = pytest.mark.usefixtures("shared_peer")

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


def test_topics_are_listed(ros2_each: Each) -> None:
    """list prints sorted names, with types or only their number; hidden ones where asked for."""
    typed, hidden, verbose = (
        done.stdout
        for done in ros2_each(
            "topic list -t", "topic list --include-hidden-topics --no-daemon", "topic list -v"
        )
    )
    topics = typed.splitlines()
    assert "/joints [sensor_msgs/msg/JointState]" in topics
    assert topics == sorted(topics)
    assert not any("_action" in line for line in topics)
    assert "/push/_action/feedback" in hidden.splitlines()
    assert verbose.startswith("Published topics:\n * /")
    assert " * /joints [sensor_msgs/msg/JointState] 1 publisher\n" in verbose
    assert "\n\nSubscribed topics:\n" in verbose
    assert " * /say [std_msgs/msg/String] 1 subscriber\n" in verbose
    assert verbose.endswith("\n\n")


def test_a_topic_is_described(ros2_each: Each) -> None:
    """info counts the ends; type prints the type alone, or nothing and 1."""
    info, kind, found, unknown, none = ros2_each(
        "topic info /joints", "topic type /joints", "topic find sensor_msgs/msg/Imu",
        "topic info /none", "topic type /none",
    )  # fmt: skip
    assert info.stdout == (
        "Type: sensor_msgs/msg/JointState\nPublisher count: 1\nSubscription count: 0\n"
    )
    assert kind.stdout == "sensor_msgs/msg/JointState\n"
    assert found.stdout == "/imu\n"
    assert (unknown.stdout, unknown.stderr) == ("", "Unknown topic '/none'\n")
    assert (none.stdout, none.stderr, none.returncode) == ("", "", 1)


def test_messages_are_echoed(ros2_each: Each) -> None:
    """echo matches the publisher's QoS by itself, prints YAML or a line of CSV, and selects."""
    joints, latched, csv, row, stamp, flow, raw = (
        done.stdout
        for done in ros2_each(
            "topic echo --once /joints",
            "topic echo --once /latched",
            "topic echo --once --csv /joints",
            "topic echo --once --field position joints",
            "topic echo --once --field header.stamp /joints",
            "topic echo --once --flow-style --no-str /joints",
            "topic echo --once --raw /latched std_msgs/msg/String",
        )
    )
    assert joints == JOINTS
    assert latched == "data: kept\n---\n"
    assert csv == "0,0,,a,b,1.0,2.5,,\n"
    assert row == "array('d', [1.0, 2.5])\n---\n"
    assert stamp == "sec: 0\nnanosec: 0\n---\n"
    assert "\n  frame_id: '<string length: <0>>'\nname: [" in flow
    assert "]\nposition: [1.0, 2.5]\nvelocity: []\n" in flow
    assert raw.startswith(r"b'\x00\x01\x00\x00\x05\x00\x00\x00kept\x00")
    assert raw.endswith("'\n---\n")


def test_what_cannot_be_echoed_is_said(ros2_each: Each) -> None:
    """Errors go to stderr, with 1."""
    bad, nobody, wrong, silent = ros2_each(
        "topic echo --once --field header.nope /joints",
        "topic echo /none",
        "topic echo /none std_msgs/msg/Nothing",
        "topic echo --timeout 0.1 /none std_msgs/msg/String",
    )
    assert (bad.returncode, bad.stdout) == (1, "")
    assert bad.stderr == "Invalid field 'header.nope': 'Header' object has no attribute 'nope'\n"
    assert nobody.stdout == "WARNING: topic [/none] does not appear to be published yet\n"
    assert nobody.stderr == "Could not determine the type for the passed topic\n"
    assert nobody.returncode == 1
    assert (wrong.returncode, wrong.stderr) == (1, "The passed message type is invalid\n")
    assert (silent.returncode, silent.stdout, silent.stderr) == (0, "", "")


def test_messages_are_published(ros2_each: Each) -> None:
    """pub shows what it sends; the values of the fields are converted to the fields' types."""
    sent, quiet, stamped = ros2_each(
        "topic pub -t 2 -r 50 /say std_msgs/String '{data: 1}'",
        "topic pub --once -w 0 -p 2 /x std_msgs/msg/Empty",
        "topic pub --once -w 0 /y std_msgs/msg/Header 'stamp: now'",
    )
    lines = sent.stdout.splitlines()
    start = lines.index("publisher: beginning loop")
    assert set(lines[:start]) <= {"Waiting for at least 1 matching subscription(s)..."}
    assert lines[start + 1 :] == [
        "publishing #1: std_msgs.msg.String(data='1')", "",
        "publishing #2: std_msgs.msg.String(data='1')", "",
    ]  # fmt: skip
    assert quiet.stdout == "publisher: beginning loop\n"
    assert re.search(r"Time\(sec=[1-9]\d+, nanosec=\d+\), frame_id=''\)\n", stamped.stdout)


UNPUBLISHABLE = {
    "std_msgs/msg/String '{dat: 1}'":
        "Failed to populate field: 'String' object has no attribute 'dat'",
    "std_msgs/msg/String text": "The passed value needs to be a dictionary in YAML format",
    "std_msgs/msg/Float64 '{data: text}'":
        "Failed to populate field: could not convert string to float: 'text'",
    "std_msgs/msg/Header '{stamp: 3}'":
        "Failed to populate field: Value '3' is expected to be a dictionary but is a int",
    "std_msgs/msg/Nothing": "The passed message type is invalid",
}  # fmt: skip


def test_what_cannot_be_published_is_said(ros2_each: Each) -> None:
    """The error names the field and the value."""
    ran = ros2_each(*(f"topic pub --once -w 0 /x {what}" for what in UNPUBLISHABLE))
    assert [done.stderr.removesuffix("\n") for done in ran] == list(UNPUBLISHABLE.values())
    assert {done.returncode for done in ran} == {1}


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
