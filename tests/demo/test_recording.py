"""run.mcap of the demonstration: complete, decodable, and what the viewers' files ask for."""

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.replay import replay_of
from door_impact_evaluation.run import evaluation, simulation_log
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from running_graph import seconds

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = {f"{package}/msg/{name}": topics.split() for package, name, topics in (
    ("door_impact_msgs", "EncoderSamples", "/door_encoder/counts /door_encoder/samples"),
    ("door_impact_msgs", "CloserParameters", "/closer_parameters"),
    ("door_impact_msgs", "ImpactPlan", "/door_impact_plan"),
    ("door_impact_msgs", "Footsteps", "/footsteps"),
    ("sensor_msgs", "JointState", "/door_angle /joint_states"), ("sensor_msgs", "Imu", "/imu"),
    ("geometry_msgs", "WrenchStamped", "/left_foot/wrench /right_foot/wrench /left_wrist/wrench "
     "/right_wrist/wrench"),
    ("geometry_msgs", "PointStamped", "/zmp /com"),
    ("geometry_msgs", "PolygonStamped", "/support_polygon"),
    ("trajectory_msgs", "JointTrajectory", "/joint_trajectory"),
    ("visualization_msgs", "MarkerArray", "/balance_markers /footstep_markers"),
    ("tf2_msgs", "TFMessage", "/tf /tf_static"),
    ("std_msgs", "String", "/robot_description /door_description"),
    ("diagnostic_msgs", "DiagnosticArray", "/diagnostics"), ("rosgraph_msgs", "Clock", "/clock"))}
RATES = {"/joint_states": 200.0, "/imu": 200.0, "/left_foot/wrench": 200.0, "/clock": 50.0,
         "/right_foot/wrench": 200.0, "/left_wrist/wrench": 200.0, "/right_wrist/wrench": 200.0,
         "/zmp": 200.0, "/door_angle": 100.0, "/com": 50.0, "/support_polygon": 50.0,
         "/door_encoder/counts": 50.0}
RVIZ_TYPES = {"MarkerArray": "visualization_msgs/msg/MarkerArray",
              "RobotModel": "std_msgs/msg/String",
              "Polygon": "geometry_msgs/msg/PolygonStamped",
              "PointStamped": "geometry_msgs/msg/PointStamped"}
FOXGLOVE_3D_TYPES = {"geometry_msgs/msg/PolygonStamped", "visualization_msgs/msg/MarkerArray"}
SHARE = Path(get_package_share_directory("door_impact_bringup"))


@dataclass(frozen=True)
class Recording:
    """What AnyReader finds: topics with types, receive times [s] and messages."""

    types: dict[str, str]
    times: dict[str, np.ndarray]
    messages: dict[str, list[Any]]

    def stamps(self, topic: str) -> np.ndarray:
        """Header stamps of a topic [s]."""
        return np.array([seconds(message.header.stamp) for message in self.messages[topic]])


@pytest.fixture(scope="module")
def recording(demo: Any) -> Recording:
    """run.mcap with every message decoded."""
    assert demo.status == 0, demo.text
    with AnyReader([demo.out / "run.mcap"], default_typestore=STORE) as reader:
        times: dict[str, list[int]] = {c.topic: [] for c in reader.connections}
        messages: dict[str, list[Any]] = {c.topic: [] for c in reader.connections}
        for connection, time, data in reader.messages():
            times[connection.topic].append(time)
            messages[connection.topic].append(reader.deserialize(data, connection.msgtype))
        types = {c.topic: c.msgtype for c in reader.connections}
    return Recording(types, {t: np.array(v) * 1e-9 for t, v in times.items()}, messages)


@pytest.mark.parametrize("kind", TYPES)
def test_every_topic_of_the_graph_is_recorded(recording: Recording, kind: str) -> None:
    """With its type and at least one message that decodes."""
    for topic in TYPES[kind]:
        assert recording.types[topic] == kind
        assert recording.messages[topic]


@pytest.mark.parametrize("topic", sorted(RATES))
def test_no_sample_is_lost(recording: Recording, topic: str) -> None:
    """Stamps grow; between the first and the last there are as many as the rate says, to 2 %."""
    times = recording.times["/clock"] if topic == "/clock" else recording.stamps(topic)
    assert len(times) == pytest.approx((times[-1] - times[0]) * RATES[topic], rel=0.02)
    assert times[-1] - times[0] > 20.0
    assert topic == "/clock" or (np.diff(times) > 0.0).all()


def test_receive_times_are_the_graphs(recording: Recording) -> None:
    """Simulated time: none lies outside of what /clock, each 20 ms, told in the run."""
    clock = [seconds(message.clock) for message in recording.messages["/clock"]]
    times = np.concatenate(list(recording.times.values()))
    assert times.min() > 0.0
    assert times.max() < clock[-1] + 0.02


def test_zmp_at_rest_is_under_the_com(recording: Recording) -> None:
    """While the robot stands still at the start, within 5 mm."""
    zmp, com = recording.messages["/zmp"][50].point, recording.messages["/com"][12].point
    assert np.hypot(zmp.x - com.x, zmp.y - com.y) < 0.005
    assert 0.6 < com.z < 1.0


def test_transforms_make_one_tree(recording: Recording) -> None:
    """Every link of both URDFs hangs below odom, and each frame has one parent."""
    parents: dict[str, set[str]] = {}
    for topic in ("/tf", "/tf_static"):
        for message in recording.messages[topic]:
            for transform in message.transforms:
                known = parents.setdefault(transform.child_frame_id, set())
                known.add(transform.header.frame_id)
    assert all(len(known) == 1 for known in parents.values())
    for topic in ("/robot_description", "/door_description"):
        for link in ET.fromstring(recording.messages[topic][0].data).findall("link"):
            frame = link.attrib["name"]
            while frame != "odom":
                (frame,) = parents[frame]


def layout() -> dict[str, Any]:
    """Foxglove's panels by their ids."""
    return json.loads((SHARE / "foxglove" / "door_impact.json").read_text())


def test_rviz_shows_topics_of_the_right_type(recording: Recording) -> None:
    """Robot, door, footsteps, support polygon, ZMP and CoM, on topics that the displays take."""
    tree = yaml.safe_load((SHARE / "rviz" / "door_impact.rviz").read_text())
    shown = {}
    for display in tree["Visualization Manager"]["Displays"]:
        topic = display.get("Topic") or display.get("Description Topic")
        if topic is None:
            continue
        shown["/" + topic["Value"]] = RVIZ_TYPES[display["Class"].partition("/")[2]]
        latched = topic["Durability Policy"] == "Transient Local"
        assert latched == topic["Value"].endswith(("_description", "footstep_markers"))
    assert set(shown) == {"/robot_description", "/door_description", "/footstep_markers",
                          "/support_polygon", "/zmp", "/com"}
    assert shown == {topic: recording.types[topic] for topic in shown}


def test_foxgloves_scene_shows_topics_of_the_right_type(recording: Recording) -> None:
    """URDFs from latched strings; polygon and balls, for Foxglove draws no PointStamped."""
    scene = layout()["configById"]["3D!scene"]
    urdfs = [layer for layer in scene["layers"].values() if layer["layerId"] == "foxglove.Urdf"]
    assert {layer["topic"] for layer in urdfs} == {"/robot_description", "/door_description"}
    assert {recording.types[layer["topic"]] for layer in urdfs} == {"std_msgs/msg/String"}
    assert {recording.types[topic] for topic in scene["topics"]} == FOXGLOVE_3D_TYPES
    assert {ball.ns for ball in recording.messages["/balance_markers"][-1].markers} == {
        "zmp", "com"}


def test_foxgloves_plots_find_their_numbers(recording: Recording) -> None:
    """Each path of a plot leads to a number in a message of its topic."""
    paths = [path["value"] for name, panel in layout()["configById"].items()
             if name.startswith("Plot!") for path in panel["paths"]]
    assert {"/zmp.point.y", "/door_angle.position[0]"} <= set(paths)
    for path in paths:
        topic, _, fields = path.partition(".")
        assert np.isfinite(eval(f"message.{fields}", {"message": recording.messages[topic][0]}))


def test_the_replay_of_the_recording_shows_the_hit(demo: Any) -> None:
    """The replay of the topics has the simulation's contact to 20 ms, and its peak to 60 ms."""
    (run,) = read_runs(demo.out / "run.mcap")
    replay = replay_of(run)
    assert [phase.name for phase in replay.phases] == [
        "prepare", "shift", "step", "back", "cam", "post", "hold"]
    contact, peak = (event.time for event in replay.events)
    motion = simulation_log.load(demo.out / "simulation.npz", replay.phases[0].start).motion
    hit = evaluation.impact(motion, 1.0)
    assert contact == pytest.approx(motion.t[hit.contact.start], abs=0.02)
    assert peak == pytest.approx(motion.t[hit.peak], abs=0.06)
    assert replay.notes == ()
    assert {tree.scene.root for tree in replay.trees} == {"base_link", "door_frame"}
