"""Definitions and type hashes of messages."""

import pytest
from door_impact_bringup.message_definitions import DefinitionError, MessageDefinitions

PLAN = "door_impact_msgs/msg/ImpactPlan"


def test_a_package_message_brings_what_it_refers_to() -> None:
    """A plan's definition contains its phases and a trajectory's points, down to plain numbers."""
    definitions = MessageDefinitions()
    assert PLAN not in definitions.store.fielddefs
    definitions.require(PLAN)
    text, _ = definitions.store.generate_msgdef(PLAN, ros_version=2)
    for part in ("door_impact_msgs/PlanPhase", "trajectory_msgs/JointTrajectoryPoint",
                 "builtin_interfaces/Time"):
        assert f"MSG: {part}\n" in text


def test_the_hash_of_a_ros_message_is_the_published_one() -> None:
    """sensor_msgs/msg/JointState as Jazzy's own packages have it."""
    definitions = MessageDefinitions()
    definitions.require("sensor_msgs/msg/JointState")
    assert definitions.store.hash_rihs01("sensor_msgs/msg/JointState") == (
        "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e")


@pytest.mark.parametrize("name", ["CloserParameters", "EncoderSamples", "ImpactPlan"])
def test_the_hash_of_our_messages_is_the_one_on_the_wire(name: str) -> None:
    """Two implementations of RIHS01, rosbags' and the embedded runtime's, agree."""
    typehash = pytest.importorskip("ros2_embedded.typehash")
    definitions = MessageDefinitions()
    definitions.require(f"door_impact_msgs/msg/{name}")
    found = definitions.store.hash_rihs01(f"door_impact_msgs/msg/{name}")
    assert found == typehash.type_hash(f"door_impact_msgs/msg/{name}")


@pytest.mark.parametrize("name", ["nowhere_msgs/msg/Thing", "door_impact_msgs/msg/Thing"])
def test_an_unknown_message_is_an_error(name: str) -> None:
    """No such package, or no such file in it: the error names the message."""
    with pytest.raises(DefinitionError, match=name) as caught:
        MessageDefinitions().require(name)
    assert caught.value.name == name
