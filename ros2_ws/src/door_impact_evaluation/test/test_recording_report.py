"""The command `report`: pages of recordings, whatever these lack, and sentences for broken ones."""

import base64
import json
import math
import re
from operator import itemgetter

import numpy as np
import pytest
import zstandard
from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.command import main
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
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


def joints(t, *positions, **named):
    named |= dict([positions] if positions else [])
    return make("sensor_msgs/msg/JointState", header=header(t), name=list(named),
                position=np.array(list(named.values())), velocity=np.zeros(0), effort=np.zeros(0))


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
            ("/support_polygon", t, polygon(t)), ("/left_foot/wrench", t, wrench(t, 300.0)),
            ("/left_wrist/wrench", t, wrench(t, 30.0)))),
    ]


def record(path, rows, pack=bytes, **options):
    """Writes a recording: topic, time of receipt [s] and message of each row, in this order."""
    path.parent.mkdir(exist_ok=True)
    with path.open("wb") as stream:
        writer, topics = Writer(stream, **options), {}
        writer.start("ros2")
        for topic, t, message in rows:
            kind = message.__msgtype__
            if topic not in topics:
                text = STORE.generate_msgdef(kind, ros_version=2)[0].encode()
                topics[topic] = writer.register_channel(
                    topic, "cdr", writer.register_schema(kind, "ros2msg", text))
            received = round(1e9 * t)
            data = pack(STORE.serialize_cdr(message, kind))
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
    np.testing.assert_allclose(plots["Force at the foot"], 300.0)
    np.testing.assert_allclose(plots["Force at the wrist"], 30.0)
    assert t[-1] == pytest.approx(1.99, abs=1e-3)
    assert data["events"] == data["phases"] == []


def test_a_part_can_be_chosen(tmp_path):
    """Times count from the recording's first joint angles."""
    data = report(record(tmp_path / "run.mcap", hardware()), "--start", "0.5", "--end", "1.5")
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
    rows = [(topic, t, makers[topic](t) if topic in topics and (
        all_of_them or t > EPOCH + 1.0) else message) for topic, t, message in hardware()]
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
        (angle,) = run.door.joints.values()
        np.testing.assert_allclose(angle.t, times(start), atol=1e-6)
        np.testing.assert_allclose(angle.values[:, 0], 0.1 * (angle.t - start), atol=1e-6)
        assert run.points["ZMP"].t[-1] < start + 2.0
        assert run.robot.base.t[-1] < start + 2.0


def moved(rows):
    """The description of the robot and joint states on `/joint_states`, each received when made."""
    return [("/robot_description", EPOCH, text(ROBOT)), *(
        ("/joint_states", t, joints(t, **named)) for t, named in rows)]


@pytest.mark.parametrize(("names", "moves", "said"), [
    (("elbow", "wrist"), True, ""),
    (("robot1/elbow", "robot1/wrist"), True, "have the prefix robot1/"),
    (("r_elbow", "r_elbow_2"), True, "have the prefix r_"),
    (("robot1/elbow", "robot2/elbow"), False, "there are robot1/elbow, robot2/elbow, but in the "
     "description elbow"),
    (("shoulder",), False, "No joint on /joint_states is in the description")])
def test_joints_of_other_names_than_the_descriptions_are_said(tmp_path, names, moves, said):
    """A prefix that is common to all, also of the base's frame, is left out."""
    root = f"{names[0].removesuffix('elbow') if moves else ''}trunk"
    rows = [row for row in hardware() if row[0] not in ("/joint_states", "/tf")]
    for t in times():
        rows += [("/joint_states", t, joints(t, **dict.fromkeys(names, t - EPOCH))),
                 ("/tf", t, transform(t, root, t - EPOCH, 0.0, 0.8))]
    record(tmp_path / "run.mcap", sorted(rows, key=itemgetter(1)))
    (run,) = read_runs(tmp_path / "run.mcap")
    assert ("elbow" in run.robot.joints) is moves
    assert len(run.robot.base.t) == len(times())
    assert said in " ".join(run.notes)
    assert bool(said) == bool(run.notes)


def test_a_joint_that_is_nan_is_named_and_the_others_move(tmp_path):
    """A sensor that is not there, in every message."""
    rows = moved((t, {"elbow": t - EPOCH, "wrist": math.nan}) for t in times())
    data = report(record(tmp_path / "run.mcap", rows))
    np.testing.assert_allclose(data["trees"][0]["positions"], data["stamps"], atol=1e-3)
    assert any("wrist (200 of 200)" in note for note in data["notes"])


def angle(t):
    return t - EPOCH


EVEN = list(enumerate(times()))


@pytest.mark.parametrize("rows", [
    [(t, {"elbow": angle(t), "wrist": 0.1} if k % 2 else {"elbow": angle(t)}) for k, t in EVEN],
    [(t, {"elbow": angle(t), "wrist": 0.1} if k % 3 else {"wrist": 0.1, "elbow": angle(t)})
     for k, t in EVEN],
    [row for t in times() for row in ((t, {"elbow": angle(t)}), (t, {"other/elbow": -9.0}))],
    [(t, {"elbow": angle(t)}) for t in times()[np.arange(200) ^ 1]],
], ids=["missing in some", "another order", "two robots", "stamps go back by 10 ms"])
def test_every_sample_of_a_joint_counts_whatever_stands_beside_it(tmp_path, rows):
    """The names in a message, and their order, are the publisher's choice."""
    (run,) = read_runs(record(tmp_path / "run.mcap", moved(rows)))
    elbow = run.robot.joints["elbow"]
    np.testing.assert_allclose(elbow.t, times(), atol=1e-6)
    np.testing.assert_allclose(elbow.values[:, 0], angle(elbow.t), atol=1e-6)
    assert run.notes[0].startswith("The recording has no /tf")
    assert len(run.notes) == 2  # and no door


def test_a_topic_without_messages_is_as_one_that_is_not_there(tmp_path):
    """Channels that were registered alone are not listed among those with messages."""
    path = tmp_path / "run.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        writer.register_channel("/joint_states", "cdr", schema)
        writer.finish()
    with pytest.raises(RecordingError, match="topics with messages: none"):
        read_runs(path)


def test_two_publishers_are_told(tmp_path):
    """Their positions contradict each other, or their clocks do, which no picture could show."""
    rows = [row for t in times() for row in ((t, {"elbow": 0.5}), (t, {"elbow": 0.0}))]
    (run,) = read_runs(record(tmp_path / "zeros.mcap", moved(rows)))
    assert any("two publishers; the first counts: elbow." in note for note in run.notes)
    rows = [row for t in times(duration=5.0) for row in (
        (t, {"elbow": 0.5}), (t - EPOCH, {"wrist": 0.0}))]
    with pytest.raises(RecordingError, match="different clocks"):
        read_runs(record(tmp_path / "clocks.mcap", moved(rows)))


@pytest.mark.parametrize("whole", [bytes, zstandard.compress])
@pytest.mark.parametrize("each", [bytes, zstandard.compress])
def test_compressed_and_bare_recordings_are_read(tmp_path, each, whole):
    """From the file alone and from a folder without metadata.yaml; `ros2 bag record` makes each."""
    (wanted,) = read_runs(record(tmp_path / "plain.mcap", hardware()))
    made = record(tmp_path / "bag" / "bag_0.mcap", hardware(), each)
    if whole is not bytes:
        packed = made.with_name("bag_0.mcap.zstd")
        packed.write_bytes(whole(made.read_bytes()))
        made.unlink()
        made = packed
    for path in (made, made.parent):
        (found,) = read_runs(path)
        np.testing.assert_array_equal(found.robot.base.values, wanted.robot.base.values)
        assert found.notes == wanted.notes == ()


@pytest.mark.parametrize("options", [{"chunk_size": 4000}, {"compression": CompressionType.NONE}])
def test_a_recording_that_was_cut_off_is_read_up_to_there_and_says_so(tmp_path, options):
    """In one of its chunks, or in the only one."""
    path = record(tmp_path / "run.mcap", hardware(), **options)
    path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])
    data = report(path)
    assert 0.5 < data["stamps"][-1] < 1.98
    assert "run.mcap was cut off, what followed is missing." in data["notes"]


@pytest.mark.parametrize(("content", "said"), [
    (b"this is no recording", "is no MCAP file"), (None, "bad.mcap was cut off")])
def test_what_cannot_be_read_is_one_sentence(tmp_path, capsys, content, said):
    """Status 1, nothing on the disk, no traceback; of the last one the header is left."""
    path = tmp_path / "bad.mcap"
    path.write_bytes(content or record(path, hardware()).read_bytes()[:60])
    assert main([str(path)]) == 1
    error = capsys.readouterr().err
    assert "bad.mcap" in error
    assert said in error
    assert error.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["bad.mcap"]
