"""The node door_encoder, tested over the middleware."""

import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from door_encoder.ros.door_encoder_node import DoorEncoderNode, main
from door_impact_msgs.msg import EncoderSamples
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState


class Rig:
    """The node, with a second node that acts as counter board and receives the results."""

    def __init__(self) -> None:
        self.node = DoorEncoderNode()
        self.board = rclpy.create_node("board")
        self.samples: list[Any] = []
        self.angles: list[Any] = []
        self.diagnostics: list[Any] = []
        self.counts = self.board.create_publisher(
            EncoderSamples, "/door_encoder/counts", QoSProfile(depth=200))
        for kind, topic, heard in (
            (EncoderSamples, "/door_encoder/samples", self.samples),
            (JointState, "/door_angle", self.angles),
            (DiagnosticArray, "/diagnostics", self.diagnostics)):
            self.board.create_subscription(kind, topic, heard.append, QoSProfile(depth=200))
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.board)

    def until(self, done: Callable[[], bool]) -> None:
        """Spin until a condition holds, but not for ever."""
        limit = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            self.executor.spin_once(timeout_sec=0.05)

    def send(
        self, first: int, counts: list[int], period: float = 1e-3, index: Sequence[int] = ()
    ) -> None:
        """Send a batch."""
        message = EncoderSamples()
        message.header.stamp = Time(nanoseconds=10**9 + first * 10**6).to_msg()
        message.period = period
        message.first_index = first
        message.counts_per_turn = 14400
        message.counts = counts
        message.index_counts = list(index)
        self.counts.publish(message)


@pytest.fixture
def rig() -> Iterator[Rig]:
    """Yield a rig on a domain of its own."""
    rclpy.init()
    made = Rig()
    made.until(lambda: made.counts.get_subscription_count() > 0)
    made.until(lambda: made.node.count_subscribers("/door_encoder/samples") > 0)
    made.until(lambda: made.node.count_subscribers("/door_angle") > 0)
    yield made
    made.executor.shutdown()
    made.node.destroy_node()
    made.board.destroy_node()
    rclpy.shutdown()


def test_samples_angles_and_diagnostics(rig: Rig) -> None:
    """A batch of 20 gives a batch of 20 and two angles with the right stamps; a bad one nothing."""
    rig.send(0, [500] * 20)
    rig.send(20, [7] * 20, period=0.0)
    rig.send(20, list(range(500, 520)))
    rig.until(lambda: len(rig.samples) == 2 and len(rig.angles) == 4)
    assert list(rig.samples[1].counts) == list(range(20))
    assert rig.samples[1].header.frame_id == "door_hinge"
    assert not rig.samples[1].gap_before
    stamps = [Time.from_msg(angle.header.stamp).nanoseconds for angle in rig.angles]
    assert stamps == [10**9 + index * 10**6 for index in (0, 10, 20, 30)]
    assert list(rig.angles[3].name) == ["door_hinge"]
    assert rig.angles[3].position[0] == pytest.approx(10 * 6.283185307 / 14400)
    reports = rig.diagnostics
    rig.until(lambda: any("batches refused: 1" in report.status[0].message for report in reports))
    assert all(report.status[0].level != DiagnosticStatus.OK for report in reports)


def test_garbage_and_lost_counts_do_not_reach_the_angle(rig: Rig) -> None:
    """Noise becomes a gap; an offset is subtracted and reported until the index confirms it."""
    rig.send(0, [500] * 200)
    rig.send(200, [9000] * 20)
    rig.send(220, [510] * 20)
    rig.until(lambda: len(rig.samples) == 2)
    assert [message.gap_before for message in rig.samples] == [False, True]
    assert rig.samples[1].first_index == 224
    assert list(rig.samples[1].counts) == [10] * 16
    rig.send(240, [510] * 20, index=[510])
    rig.send(260, [4510] * 300)
    reports = rig.diagnostics
    rig.until(lambda: any("zero in doubt" in report.status[0].message for report in reports))
    assert list(rig.samples[-1].counts) == [10] * 201
    assert {angle.position[0] for angle in rig.angles} == {0.0, 10 * 6.283185307179586 / 14400}
    rig.send(560, [4510] * 20, index=[4511])
    heard = len(reports)
    rig.until(lambda: len(reports) > heard + 1)
    assert "zero in doubt" not in reports[-1].status[0].message


def test_bad_parameters_end_with_a_sentence(capfd: pytest.CaptureFixture[str]) -> None:
    """A direction of 3 is refused with exit code 1 and without a traceback."""
    assert main(["--ros-args", "-p", "direction:=3"]) == 1
    text = capfd.readouterr().err
    assert "direction is 3" in text
    assert "Traceback" not in text
