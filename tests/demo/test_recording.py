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
TYPES = {
    "/door_encoder/counts": "door_impact_msgs/msg/EncoderSamples",
    "/door_encoder/samples": "door_impact_msgs/msg/EncoderSamples",
    "/door_angle": "sensor_msgs/msg/JointState",
    "/closer_parameters": "door_impact_msgs/msg/CloserParameters",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/imu": "sensor_msgs/msg/Imu",
    "/left_foot/wrench": "geometry_msgs/msg/WrenchStamped",
    "/right_foot/wrench": "geometry_msgs/msg/WrenchStamped",
    "/left_wrist/wrench": "geometry_msgs/msg/WrenchStamped",
    "/right_wrist/wrench": "geometry_msgs/msg/WrenchStamped",
    "/joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
    "/zmp": "geometry_msgs/msg/PointStamped",
    "/com": "geometry_msgs/msg/PointStamped",
    "/support_polygon": "geometry_msgs/msg/PolygonStamped",
    "/balance_markers": "visualization_msgs/msg/MarkerArray",
    "/footsteps": "door_impact_msgs/msg/Footsteps",
    "/footstep_markers": "visualization_msgs/msg/MarkerArray",
    "/door_impact_plan": "door_impact_msgs/msg/ImpactPlan",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/robot_description": "std_msgs/msg/String",
    "/door_description": "std_msgs/msg/String",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/clock": "rosgraph_msgs/msg/Clock",
}
RATES = {"/joint_states": 200.0, "/imu": 200.0, "/left_foot/wrench": 200.0, "/clock": 50.0,
         "/right_foot/wrench": 200.0, "/left_wrist/wrench": 200.0, "/right_wrist/wrench": 200.0,
         "/zmp": 200.0, "/door_angle": 100.0, "/com": 50.0, "/support_polygon": 50.0,
         "/door_encoder/counts": 50.0}
RVIZ_TYPES = {
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
    "rviz_default_plugins/RobotModel": "std_msgs/msg/String",
    "rviz_default_plugins/Polygon": "geometry_msgs/msg/PolygonStamped",
    "rviz_default_plugins/PointStamped": "geometry_msgs/msg/PointStamped",
}
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


def test_nothing_unfinished_is_left_beside_it(demo: Any) -> None:
    assert [path.name for path in demo.out.glob("*.mcap*")] == ["run.mcap"]


@pytest.mark.parametrize("topic", sorted(TYPES))
def test_every_topic_of_the_graph_is_recorded(recording: Recording, topic: str) -> None:
    """With its type and at least one message that decodes."""
    assert recording.types[topic] == TYPES[topic]
    assert recording.messages[topic]


@pytest.mark.parametrize("topic", sorted(RATES))
def test_no_sample_is_lost(recording: Recording, topic: str) -> None:
    """Between its first and its last sample a topic has as many as its rate says, within 2 %."""
    times = recording.times["/clock"] if topic == "/clock" else recording.stamps(topic)
    assert len(times) == pytest.approx((times[-1] - times[0]) * RATES[topic], rel=0.02)
    assert times[-1] - times[0] > 20.0


@pytest.mark.parametrize("topic", sorted(set(RATES) - {"/clock"}))
def test_stamps_only_grow(recording: Recording, topic: str) -> None:
    """As a topic's messages were published, so they stand in the file."""
    assert (np.diff(recording.stamps(topic)) > 0.0).all()


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


def test_the_plan_in_the_file_is_the_one_that_was_run(recording: Recording, demo: Any) -> None:
    """A message of ours, with nested trajectories, comes back with its numbers."""
    summary = json.loads((demo.out / "summary.json").read_text())
    assert recording.messages["/door_impact_plan"][-1].omega_door == summary["plan"]["omega_door"]


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


def test_the_leaf_reaches_the_doors_peak(recording: Recording, demo: Any) -> None:
    """The leaf's transform turns to -z by the largest opening angle of the whole run."""
    turns = [2.0 * np.arctan2(-t.transform.rotation.z, t.transform.rotation.w)
             for m in recording.messages["/tf"] for t in m.transforms
             if t.child_frame_id == "door_leaf"]
    angles = [m.position[0] for m in recording.messages["/door_angle"]]
    assert max(turns) == pytest.approx(max(angles), abs=1e-6)


def test_the_report_names_the_recording(demo: Any) -> None:
    assert 'href="run.mcap"' in (demo.out / "report.html").read_text(encoding="utf-8")


# -- what the viewers ask for ---------------------------------------------------------------------


def displays() -> list[dict[str, Any]]:
    """RViz's displays that take a topic."""
    tree = yaml.safe_load((SHARE / "rviz" / "door_impact.rviz").read_text())
    manager = tree["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "odom"
    return [d for d in manager["Displays"] if "Topic" in d or "Description Topic" in d]


def layout() -> dict[str, Any]:
    """Foxglove's panels by their ids."""
    return json.loads((SHARE / "foxglove" / "door_impact.json").read_text())


def test_rviz_shows_topics_of_the_right_type(recording: Recording) -> None:
    """Robot, door, footsteps, support polygon, ZMP and CoM, on topics that the displays take."""
    shown = {}
    for display in displays():
        topic = display.get("Topic") or display["Description Topic"]
        shown[topic["Value"]] = RVIZ_TYPES[display["Class"]]
        latched = topic["Durability Policy"] == "Transient Local"
        assert latched == topic["Value"].endswith(("_description", "/footstep_markers"))
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
    plots = [c for name, c in layout()["configById"].items() if name.startswith("Plot!")]
    paths = [path["value"] for plot in plots for path in plot["paths"]]
    assert {"/zmp.point.y", "/door_angle.position[0]"} <= set(paths)
    for path in paths:
        topic, *fields = path.split(".")
        value = recording.messages[topic][0]
        for field in fields:
            name, _, index = field.partition("[")
            value = getattr(value, name)
            value = value[int(index.rstrip("]"))] if index else value
        assert np.isfinite(value)


def test_foxgloves_layout_places_every_panel(recording: Recording) -> None:
    """The tree of splits holds each configured panel once, diagnostics among them."""
    def leaves(node: Any) -> list[str]:
        return [node] if isinstance(node, str) else [
            *leaves(node["first"]), *leaves(node["second"])]

    tree = layout()
    assert sorted(leaves(tree["layout"])) == sorted(tree["configById"])
    topic = tree["configById"]["DiagnosticSummary!all"]["topicToRender"]
    assert recording.types[topic] == "diagnostic_msgs/msg/DiagnosticArray"


def test_the_report_of_the_recording_shows_the_hit(demo: Any, called: Any, tmp_path: Path) -> None:
    """The report of the topics has the simulation's contact to 20 ms, and its peak to 60 ms."""
    out = tmp_path / "run.html"
    done = called("door_impact_evaluation", "report", str(demo.out / "run.mcap"), "--out", str(out))
    assert done.status == 0, done.err
    assert "1 hit," in done.out
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
