"""Definitions and type hashes of messages."""

import pytest
from door_impact_bringup.errors import DefinitionError
from door_impact_bringup.message_definitions import MessageDefinitions

PLAN = "door_impact_msgs/msg/ImpactPlan"


def test_a_package_message_brings_what_it_refers_to() -> None:
    """The definition of a plan contains those of its phases and of its trajectories' points."""
    definitions = MessageDefinitions()
    assert PLAN not in definitions.store.fielddefs
    definitions.require(PLAN)
    text, _ = definitions.store.generate_msgdef(PLAN, ros_version=2)
    for part in ("door_impact_msgs/PlanPhase", "trajectory_msgs/JointTrajectoryPoint",
                 "builtin_interfaces/Time"):
        assert f"MSG: {part}\n" in text


def test_the_hash_of_a_ros_message_is_the_published_one() -> None:
    """The hash of sensor_msgs/msg/JointState is the one in Jazzy's own packages."""
    definitions = MessageDefinitions()
    definitions.require("sensor_msgs/msg/JointState")
    assert definitions.store.hash_rihs01("sensor_msgs/msg/JointState") == (
        "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e")


@pytest.mark.parametrize("name", ["CloserParameters", "EncoderSamples", "ImpactPlan"])
def test_two_implementations_compute_the_same_hash_of_our_messages(name: str) -> None:
    """rosbags and the embedded runtime, which writes RIHS01 on the wire, agree."""
    typehash = pytest.importorskip("ros2_embedded.typehash")
    definitions = MessageDefinitions()
    definitions.require(f"door_impact_msgs/msg/{name}")
    found = definitions.store.hash_rihs01(f"door_impact_msgs/msg/{name}")
    assert found == typehash.type_hash(f"door_impact_msgs/msg/{name}")


@pytest.mark.parametrize("name", ["nowhere_msgs/msg/Thing", "door_impact_msgs/msg/Thing"])
def test_an_unknown_message_is_an_error(name: str) -> None:
    """If the package or its file does not exist, the error names the message."""
    with pytest.raises(DefinitionError, match=name) as caught:
        MessageDefinitions().require(name)
    assert caught.value.name == name
