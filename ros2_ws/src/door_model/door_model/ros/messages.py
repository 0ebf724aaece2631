"""Conversions between messages and batches of encoder samples, and doors."""

from door_impact_common.stamps import stamp_of
from door_impact_msgs.msg import CloserParameters, EncoderSamples

from door_model.checks import require_finite, require_not_negative
from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.errors import DoorParameterError
from door_model.recording.batch import SampleBatch
from door_model.recording.batch import to_batch as to_batch  # the way back

DOOR_JOINT = "door_hinge"
"""Name of the door's joint in the messages."""
# Fields of /closer_parameters that hold a number, and those of them that are 0 or above. Door and
# linkage check the others.
_NUMBERS = tuple(
    name for name, kind in CloserParameters.get_fields_and_field_types().items()
    if kind == "double")
_SIZES = (*(name for name in _NUMBERS if name.endswith("_std")), "leaf_mass", "fit_rmse")
_WIDEST_LEAF = 10.0  # planners search along the leaf, which takes time and memory [m]


def to_message(batch: SampleBatch) -> EncoderSamples:
    """Return the message of a batch."""
    message = EncoderSamples()
    message.header.stamp = stamp_of(batch.stamp_ns)
    message.header.frame_id = DOOR_JOINT
    message.period = batch.period
    message.first_index = batch.first_index
    message.counts_per_turn = batch.counts_per_turn
    message.counts = batch.counts.tolist()
    message.gap_before = batch.gap_before
    message.index_counts = batch.index_counts.tolist()
    return message


def door_of(message: CloserParameters) -> Door:
    """Return the door of an identification, with all that its message describes.

    Raises:
        DoorModelError: A number is not finite or out of its range, or the linkage does not close.
    """
    for name in _NUMBERS:
        require_finite(name, getattr(message, name))
    for name in _SIZES:
        require_not_negative(name, getattr(message, name))
    if not 0.0 < message.leaf_width <= _WIDEST_LEAF:
        raise DoorParameterError(
            "leaf_width", message.leaf_width, f"above 0, up to {_WIDEST_LEAF:g} m")
    linkage = FourBarCloser(
        message.link_l, message.link_l1, message.link_l2, message.link_l3, message.theta_i0,
        message.assembly)
    linkage.f(0.0)
    return Door(
        message.i_a, message.c_c, message.k_c, message.tau_c0_prime, linkage,
        c_c_closing=_given(message.c_c_closing),
        backcheck=_zone(message.backcheck_angle, message.backcheck_c_c),
        latch=_zone(message.latch_angle, message.latch_c_c),
        friction=_given(message.friction) or 0.0)


def _zone(angle: float, c_c: float) -> Zone | None:
    return None if angle < 0.0 else Zone(angle, c_c)


def _given(value: float) -> float | None:
    return None if value < 0.0 else float(value)
