"""Node closer_identifier: identifies a closer from the encoder's samples or from a recording."""

import sys
from dataclasses import replace
from typing import Any

from door_impact_common.errors import DoorImpactError, SettingError
from door_impact_common.node import GuardedNode, run_node
from door_impact_common.parameters import Parameters
from door_impact_msgs.msg import CloserParameters, EncoderSamples
from door_impact_msgs.srv import IdentifyCloser
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from door_model.checks import require_not_negative
from door_model.door.config import load_geometry
from door_model.door.geometry import DoorGeometry
from door_model.errors import (
    BadRecordingError,
    DoorParameterError,
    NoScaleError,
    NoSwingError,
)
from door_model.identification.identify import Identification, Window, identify
from door_model.identification.parameters import PARAMETERS
from door_model.identification.scale import (
    ForceGauge,
    ForceReading,
    KnownImpulse,
    Reference,
    scale_from_inertia,
    scale_from_leaf,
)
from door_model.recording.mcap import read_recording
from door_model.recording.recording import Recording
from door_model.recording.sample_store import SampleStore
from door_model.ros.messages import to_batch

_QUEUE = 1000  # 20 s: number of batches that the subscription keeps
_THROTTLE = 5.0  # shortest time between two warnings [s]
_READ_ONCE = {
    "door": ("paper", "Door whose leaf and linkage are used: its name or its YAML file"),
    "window": (Window.AUTO.value, "Part of the swings to fit: auto, opening or swing"),
    "memory": (300.0, "Time for which samples are kept [s]")}
_MEASURED = {
    "leaf_mass": (-1.0, "Mass of the leaf [kg]; negative: from the door's configuration"),
    "leaf_width": (-1.0, "Width of the leaf [m]; negative: from the door's configuration")}


class CloserIdentifierNode(GuardedNode):
    """Offers `identify` as a service. It knows leaf and linkage of the door, not its closer."""

    def __init__(self, **options: Any) -> None:
        super().__init__("closer_identifier", **options)
        try:
            self._set_up()
        except DoorImpactError:
            self.destroy_node()
            raise

    def _set_up(self) -> None:
        """Read the parameters, and create publisher, subscription and service."""
        parameters = Parameters(self, _READ_ONCE)
        self._geometry = load_geometry(parameters.text("door"))
        self._window = Window(parameters.choice("window", [choice.value for choice in Window]))
        self._store = SampleStore(parameters.positive("memory"))
        self._measurements = Parameters(self, _MEASURED, read_only=False)
        latched = QoSProfile(
            depth=1, reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._closer_topic = self.create_publisher(CloserParameters, "closer_parameters", latched)
        self._samples = self.create_subscription(
            EncoderSamples, "door_encoder/samples", self._on_samples, QoSProfile(depth=_QUEUE))
        self._service = self.create_service(IdentifyCloser, "identify_closer", self._on_identify)

    def _on_samples(self, message: EncoderSamples) -> None:
        """Store a batch."""
        try:
            self._store.add(to_batch(message))
        except DoorImpactError as error:
            self.get_logger().warning(f"refused: {error}", throttle_duration_sec=_THROTTLE)

    def _on_identify(
        self, request: IdentifyCloser.Request, response: IdentifyCloser.Response
    ) -> IdentifyCloser.Response:
        """Identify the closer; an error becomes an answer with a code and a message."""
        try:
            mass = self._measured(request.leaf_mass, "leaf_mass", self._geometry.leaf.mass)
            width = self._measured(request.leaf_width, "leaf_width", self._geometry.leaf.width)
            scale = _reference(request) or scale_from_leaf(mass, width)
            leaf = replace(self._geometry.leaf, mass=mass, width=width)
            result = identify(
                self._recording(request), self._geometry.linkage, scale, window=self._window,
                extras=request.extras, leaf=leaf, force=request.force)
        except DoorImpactError as error:
            response.success = False
            response.error_code = _error_code(error)
            response.message = str(error)
            self.get_logger().warning(f"not identified: {error}")
            return response
        response.success = True
        response.error_code = IdentifyCloser.Response.NONE
        response.message = (
            f"{len(result.swings)} swings: " + ", ".join(
                f"{name} {value:.4f} +- {result.std_of(name):.2g}"
                for name, value in zip(result.names, result.values, strict=True))
            + f"; assumed: {', '.join(result.assumptions)}"
        )
        for warning in result.warnings:
            self.get_logger().warning(warning)
        response.parameters = self._to_message(result, replace(self._geometry, leaf=leaf))
        if request.publish:
            self._closer_topic.publish(response.parameters)
        self.get_logger().info(response.message)
        return response

    def _recording(self, request: IdentifyCloser.Request) -> Recording:
        """Return the recording of a file, or the samples received until now if there is no file."""
        path = request.csv_path
        if not path:
            return self._store.recording()
        return read_recording(path, request.counts_per_turn or None)

    def _measured(self, requested: float, parameter: str, configured: float) -> float:
        """Return a measurement: from the request, else from the parameter, else as configured."""
        if not requested < 0.0:  # NaN does not mean that the measurement is left out.
            return float(requested)
        override = self._measurements.number(parameter)
        return configured if override < 0.0 else override

    def _to_message(self, result: Identification, geometry: DoorGeometry) -> CloserParameters:
        """Return the message of an identification."""
        message = CloserParameters()
        message.header.stamp = self.get_clock().now().to_msg()
        message.door = geometry.name
        for name in result.names:
            setattr(message, name, result.value_of(name))
        for name in PARAMETERS:
            setattr(message, f"{name}_std", result.std_of(name))
        message.identified = list(result.names)
        message.covariance = result.covariance.ravel().tolist()
        linkage = geometry.linkage
        message.link_l = linkage.l
        message.link_l1 = linkage.l1
        message.link_l2 = linkage.l2
        message.link_l3 = linkage.l3
        message.theta_i0 = linkage.theta_i0
        message.assembly = linkage.assembly
        message.leaf_mass = geometry.leaf.mass
        message.leaf_width = geometry.leaf.width
        message.leaf_height = geometry.leaf.height
        message.fit_rmse = result.fit_rmse
        message.swings = len(result.swings)
        message.scale_reference = result.scale_reference
        message.warnings = result.warnings
        return message


def _reference(request: IdentifyCloser.Request) -> Reference | None:
    """Return the measurement that the request contains in place of the leaf's mass and width.

    Returns:
        The measurement; None if the request contains none.

    Raises:
        DoorParameterError: The request contains more than one measurement, or an incomplete one.
    """
    columns = request.force_angles, request.forces, request.force_levers
    lengths = [len(column) for column in columns]
    given = [not request.inertia < 0.0, not request.impulse < 0.0, any(lengths)]
    if sum(given) > 1:
        raise DoorParameterError(
            "what fixes the scale", "more than one of them", "inertia, impulse or forces")
    if given[0]:
        require_not_negative("inertia_std", request.inertia_std)
        return scale_from_inertia(request.inertia, request.inertia_std)
    if given[1]:
        require_not_negative("impulse_std", request.impulse_std)
        return KnownImpulse(request.impulse, request.impulse_std, request.impulse_swing)
    if len(set(lengths)) > 1:
        raise DoorParameterError(
            "numbers of force_angles, forces and force_levers", lengths, "the same")
    readings = [ForceReading(*row) for row in zip(*columns, strict=True)]
    return ForceGauge(readings) if readings else None


def _error_code(error: DoorImpactError) -> int:
    """Return the code of the service's answer to an error."""
    codes = IdentifyCloser.Response
    if isinstance(error, NoSwingError):
        return int(codes.NO_SWING)
    if isinstance(error, NoScaleError):
        return int(codes.NO_SCALE)
    if isinstance(error, BadRecordingError):
        return int(codes.BAD_RECORDING)
    if isinstance(error, DoorParameterError | SettingError):
        return int(codes.BAD_REQUEST)
    return int(codes.NO_FIT)


def main(args: list[str] | None = None) -> int:
    """Run the node until it is shut down."""
    return run_node(CloserIdentifierNode, args=args)


if __name__ == "__main__":
    sys.exit(main())
