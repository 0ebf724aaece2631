"""Node door_encoder: raw counts to checked samples and to the door's angle."""

import math
import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.node import fixed, run_node
from door_impact_msgs.msg import EncoderSamples
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState

from door_encoder.decoding.angle import AngleSampler
from door_encoder.decoding.batch import Batch, Decoded
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.report import assess
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError, DoorEncoderError
from door_encoder.ros.messages import JOINT, to_batch, to_message

_QUEUE = 200  # batches
_THROTTLE = 5.0  # [s]


class DoorEncoderNode(Node):
    """Thin shell around `EncoderDecoder` and `AngleSampler`."""

    def __init__(self, **options: Any) -> None:
        super().__init__("door_encoder", **options)
        try:
            self._set_up()
        except DoorEncoderError:
            self.destroy_node()
            raise

    def _set_up(self) -> None:
        """Read the parameters and connect."""
        settings = self._settings()
        self._decoder = EncoderDecoder(settings)
        self._sampler = AngleSampler(
            radians_per_count=settings.radians_per_count,
            rate=float(self.declare_parameter("angle_rate", 100.0, fixed()).value),
            window=float(self.declare_parameter("velocity_window", 0.05, fixed()).value),
        )
        self._heard_at: Time | None = None
        self._told: dict[str, int] = {}
        qos = QoSProfile(depth=_QUEUE)
        self._samples = self.create_publisher(EncoderSamples, "/door_encoder/samples", qos)
        self._angle = self.create_publisher(JointState, "/door_angle", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._counts = self.create_subscription(
            EncoderSamples, "/door_encoder/counts", self._on_counts, qos
        )
        self._timer = self.create_timer(1.0, self._on_timer)

    def _settings(self) -> Settings:
        """Settings from the node's parameters."""
        bits = int(self.declare_parameter("counter_bits", 32, fixed()).value)
        modulus = int(self.declare_parameter("counter_modulus", -1, fixed()).value)
        auto_zero = bool(self.declare_parameter("auto_zero", True, fixed()).value)
        zero = int(self.declare_parameter("zero_count", 0, fixed()).value)
        return Settings(
            counts_per_turn=int(self.declare_parameter("counts_per_turn", 14400, fixed()).value),
            modulus=modulus if modulus >= 0 else (1 << bits if 0 < bits < 64 else 0),
            direction=int(self.declare_parameter("direction", 1, fixed()).value),
            zero=None if auto_zero else zero,
            zero_samples=int(self.declare_parameter("zero_samples", 20, fixed()).value),
            max_speed=float(self.declare_parameter("max_speed", 20.0, fixed()).value),
        )

    def _on_counts(self, message: EncoderSamples) -> None:
        """Decode a batch and pass it on."""
        self._heard_at = self.get_clock().now()
        try:
            pieces = self._decoder.decode(to_batch(message))
        except BadBatchError as error:
            self.get_logger().warning(f"refused: {error}", throttle_duration_sec=_THROTTLE)
            return
        for decoded in pieces:
            self._publish(decoded)

    def _publish(self, decoded: Decoded) -> None:
        """Samples and angles."""
        samples = Batch(
            decoded.stamp_ns,
            decoded.period,
            decoded.first_index,
            self._decoder.settings.counts_per_turn,
            decoded.counts,
            decoded.gap_before,
        )
        self._samples.publish(to_message(samples))
        for point in self._sampler.take(decoded):
            state = JointState()
            state.header.stamp = Time(nanoseconds=point.stamp_ns).to_msg()
            state.name = [JOINT]
            state.position = [point.theta]
            state.velocity = [point.omega]
            self._angle.publish(state)

    def _on_timer(self) -> None:
        """Report health."""
        now = self.get_clock().now()
        age = math.inf if self._heard_at is None else (now - self._heard_at).nanoseconds * 1e-9
        verdict = assess(self._decoder, age, self._told)
        self._told = verdict.totals
        status = DiagnosticStatus()
        status.level = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.STALE)[
            verdict.level.value
        ]
        status.name = "door_encoder: samples"
        status.hardware_id = JOINT
        status.message = verdict.message
        for key, value in verdict.values.items():
            status.values.append(KeyValue(key=key, value=value))
        message = DiagnosticArray()
        message.header.stamp = now.to_msg()
        message.status = [status]
        self._diagnostics.publish(message)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is told to end."""
    return run_node(DoorEncoderNode, args=args)


if __name__ == "__main__":
    sys.exit(main())
