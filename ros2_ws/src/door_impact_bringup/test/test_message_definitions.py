"""Definitions and type hashes of messages."""

import json
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory
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
def test_rosbags_and_rosidl_compute_the_same_hash_of_our_messages(name: str) -> None:
    """A reader of the recording compares it with that of the installed package."""
    full = f"door_impact_msgs/msg/{name}"
    share = Path(get_package_share_directory("door_impact_msgs"))
    installed = json.loads((share / "msg" / f"{name}.json").read_text("utf-8"))["type_hashes"]
    definitions = MessageDefinitions()
    definitions.require(full)
    assert {"type_name": full, "hash_string": definitions.store.hash_rihs01(full)} in installed


def test_an_unknown_message_is_an_error() -> None:
    """If its file does not exist, the error names the message."""
    name = "door_impact_msgs/msg/Thing"
    with pytest.raises(DefinitionError, match=name) as caught:
        MessageDefinitions().require(name)
    assert caught.value.name == name
