"""Definitions of messages, as a recording contains them."""

import json
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory
from door_impact_bringup.recorder_node import definition
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


@pytest.mark.parametrize("name", [
    "sensor_msgs/msg/JointState", "visualization_msgs/msg/MarkerArray", "tf2_msgs/msg/TFMessage",
    "door_impact_msgs/msg/CloserParameters", "door_impact_msgs/msg/EncoderSamples",
    "door_impact_msgs/msg/ImpactPlan"])
def test_a_definition_is_complete_and_that_of_the_installed_type(name: str) -> None:
    """A reader without ROS 2 understands it, and finds the hash that rosidl computed."""
    package, kind, short = name.split("/")
    share = Path(get_package_share_directory(package))
    hashes = json.loads((share / kind / f"{short}.json").read_text("utf-8"))["type_hashes"]
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition(name), name))
    assert {"type_name": name, "hash_string": store.hash_rihs01(name)} in hashes
