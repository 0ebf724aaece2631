"""The node closer_identifier, tested over the middleware."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import rclpy
from door_impact_msgs.msg import CloserParameters, EncoderSamples
from door_impact_msgs.srv import IdentifyCloser
from door_model.data import data_path
from door_model.door.config import load_door
from door_model.recording.recording import COUNTS_PER_TURN, read_csv
from door_model.ros.closer_identifier_node import CloserIdentifierNode, main
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time

SAMPLE = data_path("recordings") / "paper_five_swings.csv"


class Rig:
    """The node, with a second node that acts as encoder and as client."""

    def __init__(self) -> None:
        self.node = CloserIdentifierNode()
        self.other = rclpy.create_node("other")
        self.samples = self.other.create_publisher(
            EncoderSamples, "/door_encoder/samples", QoSProfile(depth=200))
        self.client = self.other.create_client(IdentifyCloser, "/identify_closer")
        self.heard: list[Any] = []
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.executor.add_node(self.other)

    def until(self, done: Callable[[], bool]) -> None:
        """Spin until a condition holds, but not for ever."""
        limit = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < limit, "nothing happened"
            self.executor.spin_once(timeout_sec=0.05)

    def listen(self) -> None:
        """Wait for the parameters, which a late subscriber still gets."""
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.other.create_subscription(
            CloserParameters, "/closer_parameters", self.heard.append, latched)
        self.until(lambda: bool(self.heard))

    def ask(self, **fields: Any) -> Any:
        """Call /identify_closer."""
        future = self.client.call_async(IdentifyCloser.Request(**fields))
        self.until(future.done)
        return future.result()


@pytest.fixture
def rig() -> Iterator[Rig]:
    """Yield a rig on a domain of its own."""
    rclpy.init()
    made = Rig()
    made.until(made.client.service_is_ready)
    made.until(lambda: made.samples.get_subscription_count() > 0)
    yield made
    made.executor.shutdown()
    made.node.destroy_node()
    made.other.destroy_node()
    rclpy.shutdown()


def test_identifies_what_it_hears_and_latches_it(rig: Rig) -> None:
    """Received samples give the paper's door, which a late subscriber still gets, no trial."""
    recording = read_csv(SAMPLE)
    counts = np.rint(recording.theta / recording.resolution).astype(int)
    for first in range(0, len(counts), 100):
        message = EncoderSamples(
            period=1e-3, first_index=first, counts_per_turn=COUNTS_PER_TURN,
            counts=counts[first : first + 100].tolist())
        message.header.stamp = Time(nanoseconds=10**9 + first * 10**6).to_msg()
        rig.samples.publish(message)
        rig.executor.spin_once(timeout_sec=0.0)
    rig.until(lambda: len(rig.node._store.recording().t) == len(counts))
    answer = rig.ask()
    assert answer.success, answer.message
    truth = load_door("paper")
    found = answer.parameters
    for name in ("i_a", "c_c", "k_c", "tau_c0_prime"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), rel=0.05)
        assert getattr(found, f"{name}_std") > 0.0
    assert (found.swings, found.link_l3, found.leaf_mass) == (5, 0.265, 47.62)
    assert rig.ask(leaf_mass=95.24, publish=False).success  # a trial
    rig.listen()
    assert rig.heard[0].k_c == found.k_c


def test_failures_are_answers(rig: Rig) -> None:
    """Without samples, file or scale the answer has a code and a sentence."""
    codes = IdentifyCloser.Response
    for fields, code in (
        ({}, codes.NO_SWING),
        ({"csv_path": "nowhere.csv"}, codes.BAD_RECORDING),
        ({"csv_path": str(SAMPLE), "inertia": 0.0, "inertia_std": 0.1}, codes.NO_SCALE),
        ({"csv_path": str(SAMPLE), "force_angles": [0.2], "forces": [1.0, 2.0]},
         codes.BAD_REQUEST),
    ):
        answer = rig.ask(**fields)
        assert (answer.success, answer.error_code) == (False, code), answer.message
        assert answer.message
    heavy = rig.ask(csv_path=str(SAMPLE), leaf_mass=95.24)
    assert heavy.success
    assert heavy.parameters.k_c == pytest.approx(2 * 1.13, rel=0.02)
    assert heavy.parameters.leaf_mass == 95.24


def test_counts_per_turn_and_force_are_asked_for(rig: Rig) -> None:
    """Counts per turn come with the request; an implausible closer fails unless asked for."""
    codes = IdentifyCloser.Response
    weak = rig.ask(csv_path=str(SAMPLE), leaf_mass=20.0)
    assert (weak.success, weak.error_code) == (False, codes.NO_FIT), weak.message
    assert "3.83 N m at the shut door, must be 4 to 280" in weak.message
    assert rig.ask(csv_path=str(SAMPLE), leaf_mass=20.0, force=True).success
    finer = rig.ask(csv_path=str(SAMPLE), counts_per_turn=14000)
    assert "assumed: 14000 counts per turn" in finer.message


def test_scale_by_another_measurement_and_more_than_the_paper(rig: Rig) -> None:
    """Inertia or a gauge's reading fixes the scale, and extras are in the message."""
    truth = load_door("paper").door()
    pull = float(truth.restoring_torque(0.2))
    for fields in (
        {"inertia": truth.i_a, "inertia_std": 0.1},
        {"force_angles": [0.2], "forces": [pull / 0.8], "force_levers": [0.8]}):
        answer = rig.ask(csv_path=str(SAMPLE), extras=["friction"], **fields)
        assert answer.success, answer.message
        found = answer.parameters
        assert found.i_a == pytest.approx(truth.i_a, rel=0.01)
        assert found.i_a_std > 0.0
        assert 0.0 <= found.friction < 0.02
        assert found.latch_angle < 0.0
        assert found.identified[:4] == ["i_a", "c_c", "k_c", "tau_c0_prime"]
        assert len(found.covariance) == len(found.identified) ** 2


def test_a_bad_parameter_ends_with_a_sentence(capfd: pytest.CaptureFixture[str]) -> None:
    """A bad parameter gives exit code 1 and a sentence without a traceback."""
    assert main(["--ros-args", "-p", "window:=half"]) == 1
    text = capfd.readouterr().err
    assert "window" in text
    assert "Traceback" not in text
