"""Nodes of another middleware: what is warned of, and what cannot disturb a node."""

import re
import struct
import subprocess
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import ros2_embedded.fast_dds as fast_dds
from cyclonedds._clayer import ddspy_write
from hypothesis import given
from hypothesis import strategies as st
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from ros2_embedded.cdr import LITTLE_ENDIAN
from ros2_embedded.fast_dds import Mismatch, is_fast_dds, mismatches, warnings
from spinning import make, spin_until
from std_msgs.msg import String
from std_srvs.srv import SetBool

CALLER = """
import rclpy, std_srvs.srv
rclpy.init()
node = rclpy.create_node('caller')
node.create_client(std_srvs.srv.SetBool, '/flip')
node.create_client(std_srvs.srv.SetBool, '/flip')
rclpy.spin(node)
"""


@pytest.fixture
def cyclone_taken_for_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every peer counts as one of Fast DDS: Cyclone DDS's number stands for Fast DDS's."""
    monkeypatch.setattr(fast_dds, "_FAST_DDS", b"\x01\x10")


def errors_with(
    executor: SingleThreadedExecutor, capfd: pytest.CaptureFixture[str], words: str
) -> str:
    """All of stderr until half a second after certain words."""
    text = ""

    def said() -> bool:
        nonlocal text
        text += capfd.readouterr().err
        return words in text

    assert spin_until(executor, said)
    spin_until(executor, lambda: False, 0.5)
    said()
    return text


@given(st.binary(min_size=16, max_size=16))
def test_the_vendor_is_the_first_two_bytes(guid: bytes) -> None:
    """01.0F is Fast DDS, whatever follows; nothing else is."""
    assert is_fast_dds(b"\x01\x0f" + guid[2:])
    assert is_fast_dds(guid) == guid.startswith(b"\x01\x0f")


@given(st.dictionaries(st.binary(max_size=2), st.text("rqt/_aRequst", max_size=40), max_size=8))
def test_any_topic_is_looked_at_calmly(topics: dict[bytes, str]) -> None:
    """Only topics that both sides have, in opposite roles, are ever a mismatch."""
    guids = list(topics)
    nodes = [("/own", guids[::2], guids[1::2])]
    common = {topics[a] for a in guids[::2]} & {topics[b] for b in guids[1::2]}
    found = mismatches(nodes, [("/other", guids[::2], guids[1::2])], topics)
    assert bool(found) == any(name.startswith("rq/") for name in common)


def test_services_have_the_names_that_users_know() -> None:
    """One warning for an action, one for all parameters, one for all `ros2 ...` commands."""
    topics = {b"1": "rq/push/_action/send_goalRequest", b"2": "rq/push/_action/get_resultRequest",
              b"3": "rq/own/get_parametersRequest", b"4": "rq/own/set_parameters_atomicallyRequest",
              b"5": "rt/imu", b"6": "rq/planRequest"}  # fmt: skip
    own = [("/own", [b"1", b"2", b"3", b"4", b"5"], [b"6"])]
    others = [(f"/_ros2cli_{pid}", [b"6"], list(topics)[:5]) for pid in (17, 18)]
    found = mismatches(own, others, topics)
    command = "the ros2 command"
    assert found == {
        Mismatch("/own", command, "/push", True),
        Mismatch("/own", command, "/own's parameters", True),
        Mismatch("/own", command, "/plan", False),
    }
    said = warnings(found)
    assert [name for name, _ in said] == ["/own", "/own"]
    assert "its calls of /own's parameters, /push cannot be answered" in said[0][1]
    assert "/plan cannot be called" in said[1][1]


@pytest.mark.usefixtures("peer", "cyclone_taken_for_fast")
def test_a_server_of_fast_dds_is_never_ready(
    executor: SingleThreadedExecutor, capfd: pytest.CaptureFixture[str]
) -> None:
    """Two clients of its service wait on, and the node says once why."""
    node = make(executor)
    first = node.create_client(SetBool, "/peer/flip")
    assert spin_until(executor, first._reader.get_matched_publications)
    second = node.create_client(SetBool, "/peer/flip")
    assert spin_until(executor, second._reader.get_matched_publications)
    assert not first.wait_for_service(0.0)
    text = errors_with(executor, capfd, "cannot be called")
    assert len(re.findall("/peer uses rmw_fastrtps_cpp: /peer/flip cannot be called", text)) == 1


@pytest.mark.usefixtures("cyclone_taken_for_fast")
def test_a_client_of_fast_dds_is_warned_of(
    executor: SingleThreadedExecutor,
    start: Callable[..., "subprocess.Popen[str]"],
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Who will get no answer is told by name, once for its two clients."""
    node = make(executor)
    node.create_service(SetBool, "/flip", lambda _, response: response)
    start("-c", CALLER)
    text = errors_with(executor, capfd, "cannot be answered")
    assert text.count("/caller uses rmw_fastrtps_cpp: its calls of /flip cannot") == 1


def test_what_has_no_header_is_no_request(executor: SingleThreadedExecutor) -> None:
    """A number that rmw_cyclonedds_cpp never gives shows that the first bytes are payload."""
    service = Node("tester").create_service(SetBool, "flip", lambda _, response: response)

    @given(st.integers(-(1 << 63), (1 << 63) - 1), st.integers(1, (1 << 63) - 1))
    def offer(number: int, handle: int) -> None:
        info = SimpleNamespace(publication_handle=handle)
        service.receive([(LITTLE_ENDIAN + struct.pack("<Qq", 1, number), info)])
        assert bool(service._inbox) == (0 <= number < 1 << 32)
        service._inbox.clear()

    offer()


def test_text_that_is_not_utf_8_is_replaced(executor: SingleThreadedExecutor) -> None:
    """As in rclpy; what comes afterwards is heard."""
    node = make(executor)
    got: list[Any] = []
    node.create_subscription(String, "text", lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(String, "text", 10)
    assert spin_until(executor, publisher.get_subscription_count)
    assert ddspy_write(publisher._writer._ref, b"\0\1\0\0\3\0\0\0\xff\xfe\0\0") == 0
    publisher.publish(String(data="after"))
    assert spin_until(executor, lambda: len(got) == 2)
    assert got == ["\ufffd\ufffd", "after"]
