"""The command `report`: pages of recordings, whatever these lack, and sentences for broken ones."""

import base64
import json
import math
import re

import numpy as np
import pytest
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.command import main
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
ROBOT = """<robot name="arm"><link name="trunk"/><link name="tip"><visual><geometry>
<box size="0.1 0.2 0.3"/></geometry></visual></link><joint name="elbow" type="revolute">
<parent link="trunk"/><child link="tip"/><axis xyz="0 0 1"/></joint></robot>"""
DOOR = """<robot name="door"><link name="frame"/><link name="leaf"><visual><geometry>
<box size="0.9 0.04 2"/></geometry></visual></link><joint name="door_hinge" type="revolute">
<parent link="frame"/><child link="leaf"/><axis xyz="0 0 -1"/></joint></robot>"""
EPOCH = 1.7e9  # a hardware's clock
SLOW = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=6)


def make(kind, *values, **fields):
    """A message; values go to the fields x, y and z."""
    return STORE.types[kind](**dict(zip("xyz", values, strict=False)), **fields)


def header(t):
    time = make("builtin_interfaces/msg/Time", sec=int(t), nanosec=round(1e9 * (t % 1.0)))
    return make("std_msgs/msg/Header", stamp=time, frame_id="odom")


def text(data):
    return make("std_msgs/msg/String", data=data)


def joints(t, name, position):
    return make("sensor_msgs/msg/JointState", header=header(t), name=[name],
                position=np.array([position]), velocity=np.zeros(0), effort=np.zeros(0))


def place(t, *values):
    return make("geometry_msgs/msg/PointStamped", header=header(t),
                point=make("geometry_msgs/msg/Point", *values))


def transform(t, child, *values):
    moved = make("geometry_msgs/msg/Transform",
                 translation=make("geometry_msgs/msg/Vector3", *values),
                 rotation=make("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, w=1.0))
    return make("tf2_msgs/msg/TFMessage", transforms=[make(
        "geometry_msgs/msg/TransformStamped", header=header(t), child_frame_id=child,
        transform=moved)])


def polygon(t):
    corners = [make("geometry_msgs/msg/Point32", x, y, 0.0)
               for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
    return make("geometry_msgs/msg/PolygonStamped", header=header(t),
                polygon=make("geometry_msgs/msg/Polygon", points=corners))


def wrench(t, force):
    force, torque = (make("geometry_msgs/msg/Vector3", 0.0, 0.0, z) for z in (force, 0.0))
    return make("geometry_msgs/msg/WrenchStamped", header=header(t),
                wrench=make("geometry_msgs/msg/Wrench", force=force, torque=torque))


def times(start=EPOCH, duration=2.0):
    return start + np.arange(0.0, duration, 0.01)


def hardware(start=EPOCH):
    """What a robot's own recording has: no clock, no plan, no simulation; two seconds."""
    return [
        ("/robot_description", start, text(ROBOT)), ("/door_description", start, text(DOOR)),
        ("/tf_static", start, transform(start, "frame", -0.4, -0.7, 0.0)),
        *(row for t in times(start) for row in (
            ("/joint_states", t, joints(t, "elbow", t - start)),
            ("/tf", t, transform(t, "trunk", t - start, 0.0, 0.8)),
            ("/door_angle", t, joints(t, "door_hinge", 0.1 * (t - start))),
            ("/zmp", t, place(t, 0.04, 0.0, 0.0)), ("/com", t, place(t, 0.0, 0.0, 0.7)),
            ("/support_polygon", t, polygon(t)), ("/left_foot/wrench", t, wrench(t, 300.0)))),
    ]


def record(path, rows):
    """Writes a recording: topic, time of receipt [s] and message of each row, in this order."""
    path.parent.mkdir(exist_ok=True)
    with path.open("wb") as stream:
        writer, topics = Writer(stream), {}
        writer.start("ros2")
        for topic, t, message in rows:
            kind = message.__msgtype__
            if topic not in topics:
                text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
                topics[topic] = writer.register_channel(
                    topic, "cdr", writer.register_schema(kind, "ros2msg", text))
            received = round(1e9 * t)
            data = bytes(STORE.serialize_cdr(message, kind))
            writer.add_message(topics[topic], received, data, received)
        writer.finish()
    return path


def page_of(path):
    """Everything that the page at a path knows."""
    found = re.search(r'id="replay-data">(.*?)</script>', path.read_text("utf-8"), re.DOTALL)
    return json.loads(found[1], object_hook=lambda node: np.frombuffer(
        base64.b64decode(node["float32"]), dtype="<f4") if "float32" in node else node)


def report(recording, *options):
    """The only run in the page that the command makes of a recording."""
    assert main([str(recording), *options]) == 0
    (run,) = page_of(recording.with_suffix(".html"))["runs"]
    return run


def test_a_recording_of_hardware_becomes_a_page(tmp_path, capsys):
    """Robot and door move as recorded; the ZMP margin is that of its place in the polygon."""
    folder = tmp_path / "bag"  # as `ros2 bag record` leaves it
    record(folder / "bag_0.mcap", hardware())
    data = report(folder)
    assert str(tmp_path / "bag.html") in capsys.readouterr().out
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


def test_a_part_can_be_chosen(tmp_path):
    """Times count from the recording's first joint angles."""
    data = report(record(tmp_path / "run.mcap", hardware()), "--start", "0.5", "--end", "1.5")
    assert data["stamps"][-1] == pytest.approx(1.0, abs=0.011)
    np.testing.assert_allclose(data["trees"][0]["positions"], 0.5 + data["stamps"], atol=0.011)


@SLOW
@given(st.sets(st.sampled_from(sorted({topic for topic, _, _ in hardware()}))))
def test_whatever_is_missing_the_rest_is_shown(tmp_path_factory, kept):
    """Any subset of the topics is a page, or one sentence; a page says what is missing."""
    folder = tmp_path_factory.mktemp("subset")
    path = record(folder / "run.mcap", [row for row in hardware() if row[0] in kept])
    moving = kept & {"/joint_states", "/door_angle"}
    assert main([str(path)]) == (0 if moving else 1)
    assert path.with_suffix(".html").exists() == bool(moving)
    if moving:
        text = path.with_suffix(".html").read_text("utf-8")
        assert ("no /robot_description" in text) == ("/robot_description" not in kept)
        door = {"/door_description", "/door_angle"} <= kept
        assert ("has no door" in text) == (not door)


def test_a_gap_is_said_and_drawn(tmp_path):
    """Without messages for half a second curves break, and a sentence names the times."""
    rows = [row for row in hardware() if not EPOCH + 1.0 < row[1] < EPOCH + 1.5]
    data = report(record(tmp_path / "run.mcap", rows))
    assert any("between 1.00 and 1.50 s" in note for note in data["notes"])
    assert all(np.isnan(plot["curves"][0]["values"]).any() for plot in data["plots"])


@SLOW
@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.booleans(), st.sets(st.sampled_from(
    ("/joint_states", "/tf", "/door_angle", "/zmp", "/left_foot/wrench"))))
def test_samples_that_are_no_numbers_are_left_out(tmp_path_factory, wrong, all_of_them, topics):
    """A sensor that fails sends NaN: its samples are missing, and nothing else happens."""
    makers = {"/joint_states": lambda t: joints(t, "elbow", wrong),
              "/tf": lambda t: transform(t, "trunk", wrong, 0.0, 0.8),
              "/door_angle": lambda t: joints(t, "door_hinge", wrong),
              "/zmp": lambda t: place(t, wrong, 0.0, 0.0),
              "/left_foot/wrench": lambda t: wrench(t, wrong)}
    rows = [(topic, t, makers[topic](t)) if topic in topics and (all_of_them or t > EPOCH + 1.0)
            else (topic, t, message) for topic, t, message in hardware()]
    path = record(tmp_path_factory.mktemp("nan") / "run.mcap", rows)
    if all_of_them and {"/joint_states", "/door_angle"} <= topics:
        assert main([str(path)]) == 1
        return
    for tree in report(path)["trees"]:
        assert np.isfinite(tree["positions"]).all()
        assert np.isfinite(tree["base"]).all()


def test_after_a_reset_a_new_run_begins(tmp_path, capsys):
    """Two runs with the same stamps are not mixed: each can be chosen, and has the same robot."""
    second = [("/joint_states", t, joints(t, "elbow", -1.0)) for t in times(10.0, 1.0)]
    path = record(tmp_path / "run.mcap", [*hardware(10.0), *second])
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
@given(st.integers(0, 5), st.sampled_from(("/door_angle", "/zmp", "/tf")))
def test_a_message_that_comes_after_the_reset_belongs_before_it(tmp_path_factory, late, topic):
    """Topics of several nodes do not begin anew at the same message."""
    first, second = hardware(10.0), hardware(1.0)
    end = len(first) - 7 * late
    held = [row for row in first[end:] if row[0] == topic]
    rows = [*first[:end], *(row for row in first[end:] if row[0] != topic),
            *second[:13], *held, *second[13:]]
    path = record(tmp_path_factory.mktemp("late") / "run.mcap", rows)
    for run, start in zip(read_runs(path), (10.0, 1.0), strict=True):
        (_, angle), = run.door.joints
        np.testing.assert_allclose(angle.t, times(start), atol=1e-6)
        np.testing.assert_allclose(angle.values[:, 0], 0.1 * (angle.t - start), atol=1e-6)
        assert run.points["ZMP"].t[-1] < start + 2.0
        assert run.robot.base.t[-1] < start + 2.0


def test_a_broken_recording_is_one_sentence_and_no_page(tmp_path, capsys):
    """Status 1, nothing on the disk, no traceback."""
    path = tmp_path / "broken.mcap"
    path.write_bytes(b"this is no recording")
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert "broken.mcap" in said
    assert said.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["broken.mcap"]
