"""Logs: their form, levels, filters, and `/rosout`."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import GetParameters
from rclpy.clock import Clock
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.logging import (
    get_logger,
    get_logger_effective_level,
    get_logger_level,
    get_logging_severity_from_string,
    set_logger_level,
)
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from spinning import make, spin_until

LINE = r"\[{}\] \[\d+\.\d{{9}}\] \[{}\]: {}\n"
KEPT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def run(program: str, *arguments: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Runs a program that logs, in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=60,
        env={**os.environ, **environment},
    )  # fmt: skip


TALK = """
import rclpy
rclpy.init()
logger = rclpy.create_node("n", namespace="ns").get_logger()
logger.debug("debug")
logger.info("info")
logger.warning("warning")
logger.error("error")
logger.fatal("fatal")
logger.get_child("c").debug("of a child")
rclpy.shutdown()
"""


def test_logs_go_to_stderr_in_ros_form() -> None:
    """Severity, time with nine digits, name with dots, text; DEBUG is left out at first."""
    done = run(TALK)
    assert done.stdout == ""
    severities = ("INFO", "info"), ("WARN", "warning"), ("ERROR", "error"), ("FATAL", "fatal")
    expected = "".join(LINE.format(severity, r"ns\.n", text) for severity, text in severities)
    assert re.fullmatch(expected, done.stderr)


def test_the_environment_changes_the_form() -> None:
    """Format with its tokens, colours and stream."""
    form = ("{severity}|{name}|{message}|{function_name}|{line_number}|{nothing}|"
            "{time_as_nanoseconds}")  # fmt: skip
    done = run(
        TALK, RCUTILS_CONSOLE_OUTPUT_FORMAT=form, RCUTILS_LOGGING_USE_STDOUT="1",
        RCUTILS_COLORIZED_OUTPUT="1",
    )  # fmt: skip
    assert done.stderr == ""
    wanted = (("0", "INFO", "info"), ("33", "WARN", "warning"), ("31", "ERROR", "error"),
              ("31", "FATAL", "fatal"))  # fmt: skip
    for number, (line, (colour, severity, text)) in enumerate(
        zip(done.stdout.splitlines(), wanted, strict=True), 6
    ):
        start = f"\033[{colour}m{severity}|ns.n|{text}|<module>|{number}|{{nothing}}|"
        assert re.fullmatch(re.escape(start) + r"\d{19}" + re.escape("\033[0m"), line)


def test_levels_from_the_command_line() -> None:
    """For all loggers, for one, and for its children; the most particular one counts."""
    done = run(TALK, "--ros-args", "--log-level", "error", "--log-level", "ns.n.c:=DEBUG")
    texts = [line.rpartition(": ")[2] for line in done.stderr.splitlines() if "[ns.n" in line]
    assert texts == ["error", "fatal", "of a child"]


def test_logs_can_be_kept_off_the_console(capfd: pytest.CaptureFixture[str]) -> None:
    """Until the shutdown."""
    rclpy.init(args=["--ros-args", "--disable-stdout-logs"])
    get_logger("silent").error("unseen")
    rclpy.shutdown()
    get_logger("silent").error("seen")
    assert [line.rpartition(": ")[2] for line in capfd.readouterr().err.splitlines()] == ["seen"]


def test_levels_are_inherited() -> None:
    """The nearest parent's level counts; UNSET gives way to it."""
    parent, child = get_logger("levels"), get_logger("levels").get_child("a").get_child("b")
    assert child.name == "levels.a.b"
    assert child.get_effective_level() == LoggingSeverity.INFO
    parent.set_level(LoggingSeverity.ERROR)
    assert get_logger_effective_level("levels.a.b") == LoggingSeverity.ERROR
    assert not child.is_enabled_for(LoggingSeverity.WARN)
    assert child.warning("left out") is False
    set_logger_level("levels.a", 10)
    assert child.is_enabled_for(10)
    assert get_logger_level("levels.a") == LoggingSeverity.DEBUG
    assert get_logger_effective_level("levels.ab") == LoggingSeverity.ERROR
    set_logger_level("levels.a", LoggingSeverity.UNSET)
    assert child.get_effective_level() == LoggingSeverity.ERROR
    assert get_logging_severity_from_string("warn") == LoggingSeverity.WARN
    with pytest.raises(RuntimeError):
        get_logging_severity_from_string("nonsense")
    with pytest.raises(ValueError, match="11"):
        parent.set_level(11)
    with pytest.raises(ValueError, match="Logger name must not be empty"):
        get_logger("")
    with pytest.raises(ValueError, match="Child logger name must not be empty"):
        parent.get_child("")


class SetClock(Clock):
    """A clock that shows what it is told."""

    seconds = 1.0

    def now(self) -> Time:
        return Time(seconds=self.seconds, clock_type=self.clock_type)


def test_filters() -> None:
    """Throttled by a clock, once, not the first; together they are asked in that order."""
    logger, clock = get_logger("filters"), SetClock()
    shown: dict[str, list[int]] = {"throttle": [], "once": [], "skip": [], "both": [], "same": []}
    for second in range(1, 9):
        clock.seconds = float(second)
        throttle: dict[str, Any] = {
            "throttle_duration_sec": 3.0, "throttle_time_source_type": clock
        }  # fmt: skip
        for name, done in (
            ("throttle", logger.info("throttle", **throttle)),
            ("once", logger.warning("once", once=True)),
            ("skip", logger.error("skip", skip_first=True)),
            ("both", logger.fatal("both", skip_first=True, **throttle)),
            ("same", logger.info("a", once=True) or logger.info("b", once=True)),
        ):
            if done:
                shown[name].append(second)
    assert shown == {
        "throttle": [3, 6], "once": [1], "skip": [2, 3, 4, 5, 6, 7, 8], "both": [6], "same": [1, 2]
    }  # fmt: skip


def test_what_a_line_asked_for_must_stay() -> None:
    """Another severity, name, filter or parameter at one line of the program is an error."""
    logger = get_logger("changes")

    def log(severity: int, **options: Any) -> None:
        logger.log("text", severity, **options)

    log(LoggingSeverity.INFO)
    with pytest.raises(ValueError, match="Logger severity cannot be changed between calls"):
        log(LoggingSeverity.WARN)
    with pytest.raises(ValueError, match="Logger name cannot be changed between calls"):
        log(LoggingSeverity.INFO, name="other")
    with pytest.raises(ValueError, match="Requested logging filters cannot be changed"):
        log(LoggingSeverity.INFO, once=True)

    def throttled(duration: float) -> None:
        logger.info("text", throttle_duration_sec=duration)

    throttled(1.0)
    with pytest.raises(ValueError, match="Logging filter parameters cannot be changed"):
        throttled(2.0)


def test_wrong_options() -> None:
    """Unknown, incomplete, of another type; a logger that is not enabled does not look."""
    logger = get_logger("wrong")
    with pytest.raises(TypeError, match='parameter "nonsense" is not one of the recognized'):
        logger.info("x", nonsense=1)
    with pytest.raises(TypeError, match='required parameter "throttle_duration_sec" not specified'):
        logger.info("x", throttle_time_source_type=SetClock())
    with pytest.raises(ValueError, match="is not a clock instance"):
        logger.info("x", throttle_duration_sec=1.0, throttle_time_source_type="steady")
    with pytest.raises(TypeError):
        logger.info(5)
    assert logger.debug("x", nonsense=1) is False
    assert logger.info("x") is True
    with pytest.raises(ValueError, match="7"):
        logger.log("x", 7)


def logs(executor: Any, name: str = "listener") -> list[Log]:
    """What comes on `/rosout`, also from before."""
    got: list[Log] = []
    make(executor, name, enable_rosout=False).create_subscription(Log, "/rosout", got.append, KEPT)
    return got


def test_rosout(executor: SingleThreadedExecutor) -> None:
    """Everything that a node's logger and its children write, with where it was written."""
    node = make(executor, "n", namespace="ns")
    node.get_logger().warning("before")
    got = logs(executor)
    node.get_logger().get_child("child").error("of a child")
    node.get_logger().debug("left out")
    get_logger("stranger").error("not a node's")
    node.get_logger().info("last")
    assert spin_until(executor, lambda: got and got[-1].msg == "last")
    assert [(m.name, m.level, m.msg) for m in got] == [
        ("ns.n", 30, "before"), ("ns.n.child", 40, "of a child"), ("ns.n", 20, "last")
    ]  # fmt: skip
    first = got[0]
    assert first.function == "test_rosout"
    assert first.file == os.path.abspath(__file__)
    assert 0 < first.line < got[2].line
    assert first.stamp.sec > 1_600_000_000
    assert Log.WARN == b"\x1e" or Log.WARN == 30


def test_the_quality_of_rosout(executor: SingleThreadedExecutor) -> None:
    """A thousand messages are kept for latecomers, for ten seconds."""
    node = make(executor, "logs")

    def own() -> list[Any]:
        infos = node.get_publishers_info_by_topic("/rosout")
        return [info for info in infos if info.node_name == "logs"]

    assert spin_until(executor, own)
    (info,) = own()
    qos = info.qos_profile
    assert (qos.depth, qos.durability) == (1000, DurabilityPolicy.TRANSIENT_LOCAL)
    assert qos.reliability == ReliabilityPolicy.RELIABLE
    assert qos.lifespan == Duration(seconds=10)
    assert "/rosout" not in [publisher.topic_name for publisher in node.publishers]


@pytest.fixture
def without_rosout() -> Iterator[Node]:
    """A node of a process that does not publish its logs."""
    rclpy.init(args=["--ros-args", "--disable-rosout-logs"])
    yield Node("switched_off")
    rclpy.try_shutdown()


def published(node: Node) -> list[str]:
    """Topics that a node publishes, as the graph has it."""
    own = node.get_name(), node.get_namespace()
    if own not in node.get_node_names_and_namespaces():
        return []
    return [topic for topic, _ in node.get_publisher_names_and_types_by_node(*own)]


def test_rosout_can_be_left_out(executor: SingleThreadedExecutor) -> None:
    """By the node."""
    node = make(executor, "left_out", enable_rosout=False)
    assert spin_until(executor, lambda: published(node))
    assert published(node) == ["/parameter_events"]


def test_rosout_can_be_switched_off(without_rosout: Node) -> None:
    """By the command line."""
    executor = SingleThreadedExecutor()
    executor.add_node(without_rosout)
    assert spin_until(executor, lambda: published(without_rosout))
    assert published(without_rosout) == ["/parameter_events"]


def test_levels_from_another_node(executor: SingleThreadedExecutor) -> None:
    """A node may let others read and set its loggers' levels."""
    node = make(executor, "n", enable_logger_service=True)
    assert spin_until(executor, lambda: {
        "/n/get_logger_levels", "/n/set_logger_levels"
    } <= {name for name, _ in node.get_service_names_and_types()})  # fmt: skip
    plain = make(executor, "plain", start_parameter_services=False)
    client = plain.create_client(GetParameters, "/plain/get_parameters")
    assert not client.service_is_ready()
