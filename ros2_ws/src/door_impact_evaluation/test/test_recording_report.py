"""The command `report`: pages of recordings, whatever these lack, and sentences for broken ones."""

import base64
import json
import math
import re

import numpy as np
import pytest
from door_impact_bringup.mcap_file import McapFile
from door_impact_bringup.message_definitions import MessageDefinitions
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.bag_replay import replay_of
from door_impact_evaluation.report.command import main
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

STORE = MessageDefinitions().store
QOS = Qos(QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.VOLATILE, QosTime(1, 0),
          QosTime(1, 0), QosLiveliness.AUTOMATIC, QosTime(1, 0), False)
ROBOT = """<robot name="arm"><link name="trunk"/><link name="tip"><visual><geometry>
<box size="0.1 0.2 0.3"/></geometry></visual></link><joint name="elbow" type="revolute">
<parent link="trunk"/><child link="tip"/><axis xyz="0 0 1"/></joint></robot>"""
DOOR = """<robot name="door"><link name="frame"/><link name="leaf"><visual><geometry>
<box size="0.9 0.04 2"/></geometry></visual></link><joint name="door_hinge" type="revolute">
<parent link="frame"/><child link="leaf"/><axis xyz="0 0 -1"/></joint></robot>"""
EPOCH = 1.7e9  # a hardware's clock


def make(kind, **fields):
    return STORE.types[kind](**fields)


def header(t, frame="odom"):
    time = make("builtin_interfaces/msg/Time", sec=int(t), nanosec=round(1e9 * (t % 1.0)))
    return make("std_msgs/msg/Header", stamp=time, frame_id=frame)


def text(data):
    return make("std_msgs/msg/String", data=data)


def joints(t, names, positions):
    empty = np.zeros(0)
    return make("sensor_msgs/msg/JointState", header=header(t), name=list(names),
                position=np.array(positions, dtype=float), velocity=empty, effort=empty)


def xyz(kind, *values):
    return make(f"geometry_msgs/msg/{kind}", **dict(zip("xyz", values, strict=True)))


def place(t, *values):
    return make("geometry_msgs/msg/PointStamped", header=header(t), point=xyz("Point", *values))


def transform(t, child, *values):
    turn = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    moved = make("geometry_msgs/msg/Transform", translation=xyz("Vector3", *values), rotation=turn)
    return make("tf2_msgs/msg/TFMessage", transforms=[make(
        "geometry_msgs/msg/TransformStamped", header=header(t), child_frame_id=child,
        transform=moved)])


def polygon(t):
    corners = [make("geometry_msgs/msg/Point32", x=x, y=y, z=0.0)
               for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
    return make("geometry_msgs/msg/PolygonStamped", header=header(t),
                polygon=make("geometry_msgs/msg/Polygon", points=corners))


def wrench(t, force):
    return make("geometry_msgs/msg/WrenchStamped", header=header(t), wrench=make(
        "geometry_msgs/msg/Wrench", force=xyz("Vector3", 0.0, 0.0, force),
        torque=xyz("Vector3", 0.0, 0.0, 0.0)))


def times(start=EPOCH, duration=2.0):
    return start + np.arange(0.0, duration, 0.01)


def hardware(start=EPOCH):
    """What a robot's own recording has: no clock, no plan, no simulation; two seconds."""
    return [
        ("/robot_description", start, text(ROBOT)), ("/door_description", start, text(DOOR)),
        ("/tf_static", start, transform(start, "frame", -0.4, -0.7, 0.0)),
        *(row for t in times(start) for row in (
            ("/joint_states", t, joints(t, ["elbow"], [t - start])),
            ("/tf", t, transform(t, "trunk", t - start, 0.0, 0.8)),
            ("/door_angle", t, joints(t, ["door_hinge"], [0.1 * (t - start)])),
            ("/zmp", t, place(t, 0.04, 0.0, 0.0)), ("/com", t, place(t, 0.0, 0.0, 0.7)),
            ("/support_polygon", t, polygon(t)), ("/left_foot/wrench", t, wrench(t, 300.0)))),
    ]


def record(path, rows):
    """Writes a recording: topic, time of receipt [s] and message of each row, in this order."""
    file = McapFile(path)
    topics = {}
    for topic, t, message in rows:
        kind = message.__msgtype__
        if topic not in topics:
            topics[topic] = file.add_topic(topic, kind, STORE, [QOS])
        file.write(topics[topic], round(1e9 * t), bytes(STORE.serialize_cdr(message, kind)))
    file.close()
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return record(tmp_path_factory.mktemp("bag") / "run.mcap", hardware())


def only_run(path):
    (run,) = read_runs(path)
    return run


def page_of(path):
    """Everything that the page at a path knows."""
    found = re.search(r'id="replay-data">(.*?)</script>', path.read_text("utf-8"), re.DOTALL)
    return json.loads(found[1], object_hook=lambda node: np.frombuffer(
        base64.b64decode(node["float32"]), dtype="<f4") if "float32" in node else node)


def data_of(path):
    """The only run in the page at a path."""
    (run,) = page_of(path)["runs"]
    return run


def test_a_recording_of_hardware_becomes_a_page(recording, tmp_path, capsys):
    """Robot and door move as recorded; the ZMP margin is that of its place in the polygon."""
    out = tmp_path / "page.html"
    assert main([str(recording), "--out", str(out)]) == 0
    assert str(out) in capsys.readouterr().out
    data = data_of(out)
    robot, door = data["trees"]
    t = data["stamps"]
    np.testing.assert_allclose(robot["positions"], t, atol=1e-3)
    np.testing.assert_allclose(robot["base"].reshape(-1, 7)[:, 0], t, atol=1e-3)
    np.testing.assert_allclose(door["positions"], 0.1 * t, atol=1e-3)
    np.testing.assert_allclose(door["base"][:3], [-0.4, -0.7, 0.0], atol=1e-6)
    plots = {plot["title"]: plot["curves"][0]["values"] for plot in data["plots"]}
    np.testing.assert_allclose(plots["ZMP margin"], 60.0, atol=1e-3)
    np.testing.assert_allclose(plots["Force on feet and hands"], 300.0)
    assert t[-1] == pytest.approx(1.99, abs=1e-3)
    assert data["events"] == data["phases"] == []


def test_a_folder_of_ros2_bag_record_is_a_recording(tmp_path):
    """With metadata.yaml and its file, as `ros2 bag record -s mcap` leaves it."""
    folder = tmp_path / "bag"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {}
        for topic, t, message in hardware():
            kind = message.__msgtype__
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(topics[topic], round(1e9 * t), STORE.serialize_cdr(message, kind))
    assert main([str(folder)]) == 0
    assert len(data_of(tmp_path / "bag.html")["trees"]) == 2


def test_a_part_can_be_chosen(recording, tmp_path):
    """Times count from the recording's first joint angles."""
    out = tmp_path / "page.html"
    assert main([str(recording), "--out", str(out), "--start", "0.5", "--end", "1.5"]) == 0
    data = data_of(out)
    assert data["stamps"][-1] == pytest.approx(1.0, abs=0.011)
    np.testing.assert_allclose(data["trees"][0]["positions"], 0.5 + data["stamps"], atol=0.011)


MOVING = ("/joint_states", "/tf", "/door_angle", "/zmp", "/left_foot/wrench")
TOPICS = sorted({topic for topic, _, _ in hardware()})


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=6)
@given(st.sets(st.sampled_from(TOPICS)))
def test_whatever_is_missing_the_rest_is_shown(tmp_path_factory, kept):
    """Any subset of the topics is a page, or one sentence; a page says what is missing."""
    folder = tmp_path_factory.mktemp("subset")
    path = record(folder / "run.mcap", [row for row in hardware() if row[0] in kept])
    status = main([str(path)])
    moving = kept & {"/joint_states", "/door_angle"}
    assert status == (0 if moving else 1)
    assert path.with_suffix(".html").exists() == bool(moving)
    if moving:
        text = path.with_suffix(".html").read_text("utf-8")
        assert ("no /robot_description" in text) == ("/robot_description" not in kept)
        door = {"/door_description", "/door_angle"} <= kept
        assert ("has no door" in text) == (not door)


def test_a_gap_is_said_and_drawn(tmp_path):
    """Without messages for half a second curves break, and a sentence names the times."""
    rows = [row for row in hardware() if not EPOCH + 1.0 < row[1] < EPOCH + 1.5]
    replay = replay_of(only_run(record(tmp_path / "run.mcap", rows)))
    assert any("between 1.00 and 1.50 s" in note for note in replay.notes)
    assert all(np.isnan(plot.curves[0].values).any() for plot in replay.plots)
    support = next(mark for mark in replay.marks if mark.name == "ZMP")
    within = (replay.stamps > EPOCH + 1.3) & (replay.stamps < EPOCH + 1.4)
    assert np.isnan(support.places[within]).all()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=6)
@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.sets(st.sampled_from(MOVING)),
       st.booleans())
def test_samples_that_are_no_numbers_are_left_out(tmp_path_factory, wrong, topics, all_of_them):
    """A sensor that fails sends NaN: its samples are missing, and nothing else happens."""
    makers = {"/joint_states": lambda t: joints(t, ["elbow"], [wrong]),
              "/tf": lambda t: transform(t, "trunk", wrong, 0.0, 0.8),
              "/door_angle": lambda t: joints(t, ["door_hinge"], [wrong]),
              "/zmp": lambda t: place(t, wrong, 0.0, 0.0),
              "/left_foot/wrench": lambda t: wrench(t, wrong)}
    rows = [(topic, t, makers[topic](t)) if topic in topics and (all_of_them or t > EPOCH + 1.0)
            else (topic, t, message) for topic, t, message in hardware()]
    path = record(tmp_path_factory.mktemp("nan") / "run.mcap", rows)
    shown = not (all_of_them and {"/joint_states", "/door_angle"} <= topics)
    assert main([str(path)]) == (0 if shown else 1)
    if shown:
        data = data_of(path.with_suffix(".html"))
        for tree in data["trees"]:
            assert np.isfinite(tree["positions"]).all()
            assert np.isfinite(tree["base"]).all()


def test_after_a_reset_a_new_run_begins(tmp_path, capsys):
    """Two runs with the same stamps are not mixed: each can be chosen, the later one is shown."""
    first = [(topic, t, message) for topic, t, message in hardware(10.0)]
    second = [("/joint_states", t, joints(t, ["elbow"], [-1.0])) for t in times(10.0, 1.0)]
    path = record(tmp_path / "run.mcap", [*first, *second])
    assert main([str(path)]) == 0
    assert "2 runs between resets (2.0 s, 0 hits; 1.0 s, 0 hits)" in capsys.readouterr().out
    page = page_of(path.with_suffix(".html"))
    assert page["first"] == 1
    assert [run["name"] for run in page["runs"]] == [
        "1 of 2: 2.0 s, 0 hits", "2 of 2: 1.0 s, 0 hits"]
    before, after = page["runs"]
    np.testing.assert_allclose(before["trees"][0]["positions"], before["stamps"], atol=1e-3)
    assert (before["stamps"][-1], after["stamps"][-1]) == pytest.approx((1.99, 0.99), abs=1e-3)
    np.testing.assert_allclose(after["trees"][0]["positions"], -1.0)
    assert before["notes"] == []
    assert any("has no door" in note for note in after["notes"])


@settings(max_examples=4)
@given(st.integers(0, 5), st.integers(0, 2))
def test_a_message_that_comes_after_the_reset_belongs_before_it(tmp_path_factory, late, which):
    """Topics of several nodes do not begin anew at the same message."""
    first = hardware(10.0)
    end = len(first) - 7 * late
    held = [row for row in first[end:] if row[0] == ("/door_angle", "/zmp", "/tf")[which]]
    kept = [row for row in first if not any(row is other for other in held)]
    second = hardware(1.0)
    path = record(tmp_path_factory.mktemp("late") / "run.mcap",
                  [*kept, *second[:13], *held, *second[13:]])
    for run, start in zip(read_runs(path), (10.0, 1.0), strict=True):
        t = run.door.positions.t
        np.testing.assert_allclose(t, times(start), atol=1e-6)
        np.testing.assert_allclose(run.door.positions.values[:, 0], 0.1 * (t - start), atol=1e-6)
        assert run.points["/zmp"].t[-1] < start + 2.0
        assert run.poses["trunk"].t[-1] < start + 2.0


def test_a_broken_recording_is_one_sentence_and_no_page(recording, tmp_path, capsys):
    """Status 1, nothing on the disk, no traceback."""
    path = tmp_path / "broken.mcap"
    path.write_bytes(recording.read_bytes()[:3000])
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert "broken.mcap" in said
    assert said.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["broken.mcap"]
