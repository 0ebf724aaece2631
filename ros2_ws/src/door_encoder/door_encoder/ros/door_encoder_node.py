"""Node door_encoder: decodes raw counts to checked samples and to the door's angle."""

import math
import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters
from door_impact_common.stamps import stamp_of
from door_impact_msgs.msg import EncoderSamples
from door_model.recording.counts import LARGEST_COUNT
from door_model.ros.messages import DOOR_JOINT, to_batch, to_message
from rclpy.qos import QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState

from door_encoder.decoding.angle import AngleSampler
from door_encoder.decoding.decoder import EncoderDecoder, assess
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BadBatchError

_QUEUE = 1000  # 20 s: number of batches that publishers and subscriptions keep
_THROTTLE = 5.0  # shortest time between two warnings [s]
_PARAMETERS = {
    "counts_per_turn": (14400, "Counts in a turn of the hinge, quadrature included"),
    "counter_bits": (32, "Width of the counter; 0 or 64: it never wraps"),
    "counter_modulus": (-1, "Counts after which the counter wraps; negative: by counter_bits"),
    "direction": (1, "1 if the count grows as the door opens, -1 if it falls"),
    "auto_zero": (True, "Take the zero from the first samples of a door that stands still"),
    "zero_count": (0, "Counter value at the closed door, used without auto_zero"),
    "zero_samples": (20, "Samples of a door that stands still that give the zero"),
    "max_speed": (20.0, "Greatest plausible speed of the door [rad/s]"),
    "angle_rate": (100.0, "Rate of door_angle [Hz]"),
    "velocity_window": (0.05, "Shortest window of the velocity [s]")}


class DoorEncoderNode(GuardedNode):
    """Connects `EncoderDecoder` and `AngleSampler` with the topics."""

    def __init__(self, **options: Any) -> None:
        super().__init__("door_encoder", **options)
        parameters = Parameters(self, _PARAMETERS)
        settings = _settings(parameters)
        self._decoder = EncoderDecoder(settings)
        self._sampler = AngleSampler(
            radians_per_count=settings.radians_per_count,
            rate=parameters.number("angle_rate"),
            window=parameters.number("velocity_window"))
        self._received_at: Time | None = None
        self._reported: dict[str, int] = {}  # health at the last report
        qos = QoSProfile(depth=_QUEUE)
        self._samples = self.create_publisher(EncoderSamples, "door_encoder/samples", qos)
        self._angle = self.create_publisher(JointState, "door_angle", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_subscription(EncoderSamples, "door_encoder/counts", self._on_counts, qos)
        self.create_timer(1.0, self._on_timer)

    def _on_counts(self, message: EncoderSamples) -> None:
        """Decode a batch, and publish samples and the angles that follow from them."""
        self._received_at = self.get_clock().now()
        try:
            pieces = self._decoder.decode(to_batch(message))
        except BadBatchError as error:
            self.get_logger().warning(f"refused: {error}", throttle_duration_sec=_THROTTLE)
            return
        for decoded in pieces:
            self._samples.publish(to_message(decoded))
            for point in self._sampler.take(decoded):
                state = JointState(
                    name=[DOOR_JOINT], position=[point.theta], velocity=[point.omega])
                state.header.stamp = stamp_of(point.stamp_ns)
                self._angle.publish(state)

    def _on_timer(self) -> None:
        """Publish the health of the encoder."""
        now, received = self.get_clock().now(), self._received_at
        age = math.inf if received is None else (now - received).nanoseconds * 1e-9
        level, text, values = assess(self._decoder, age, self._reported)
        self._reported = dict(self._decoder.health)
        message = DiagnosticArray(status=[DiagnosticStatus(
            level=bytes([level]), name=f"{self.get_fully_qualified_name()[1:]}: samples",
            hardware_id=DOOR_JOINT, message=text,
            values=[KeyValue(key=key, value=value) for key, value in values.items()],
        )])
        message.header.stamp = now.to_msg()
        self._diagnostics.publish(message)


def _settings(parameters: Parameters) -> Settings:
    """Return the decoder's settings from the node's parameters."""
    bits = parameters.whole("counter_bits")
    modulus = parameters.whole("counter_modulus", low=-LARGEST_COUNT)
    zero = parameters.whole("zero_count", low=-LARGEST_COUNT)
    return Settings(
        counts_per_turn=parameters.whole("counts_per_turn"),
        modulus=modulus if modulus >= 0 else (1 << bits if 0 < bits < 64 else 0),
        direction=parameters.whole("direction", low=-1),
        zero=None if parameters.switch("auto_zero") else zero,
        zero_samples=parameters.whole("zero_samples"),
        max_speed=parameters.number("max_speed"))


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return run_node(DoorEncoderNode, args=args)


if __name__ == "__main__":
    sys.exit(main())
