"""Messages: fields, checks, bytes, hashes."""

import array
import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cyclonedds.idl import IdlStruct
from diagnostic_msgs.msg import DiagnosticStatus
from door_impact_msgs.msg import CloserParameters
from door_impact_msgs.srv import PlanDoorImpact
from geometry_msgs.msg import Pose, PoseWithCovariance, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from ros2_embedded import cdr, jazzy
from ros2_embedded.catalogue import KINDS, list_interfaces, message_spec
from ros2_embedded.cdr import CdrError
from ros2_embedded.messages import message_class
from ros2_embedded.specs import FieldType, InterfaceError, parse_message
from ros2_embedded.typehash import type_hash
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger

JAZZY = get_typestore(Stores.ROS2_JAZZY)
TYPES = [
    "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu", "trajectory_msgs/msg/JointTrajectory",
    "diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/ParameterEvent",
    "tf2_msgs/msg/TFMessage", "std_msgs/msg/Empty", "shape_msgs/msg/SolidPrimitive",
]  # fmt: skip
FLOATS = st.floats(allow_nan=False, width=32)
NUMBERS = {
    "bool": st.booleans(), "byte": st.integers(0, 255).map(lambda n: bytes([n])),
    "char": st.integers(0, 255), "float32": FLOATS, "float64": st.floats(allow_nan=False),
    **{f"int{b}": st.integers(-(2 ** (b - 1)), 2 ** (b - 1) - 1) for b in (8, 16, 32, 64)},
    **{f"uint{b}": st.integers(0, 2**b - 1) for b in (8, 16, 32, 64)},
}  # fmt: skip
NUMBERS["string"] = st.text(
    st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9
)


def values_of(kind: FieldType) -> st.SearchStrategy[Any]:
    """Values of a field."""
    scalar = NUMBERS[kind.base] if kind.primitive else messages_of(kind.base)
    if kind.container == "array":
        return st.lists(scalar, min_size=kind.size, max_size=kind.size)
    if kind.container == "sequence":
        return st.lists(scalar, max_size=min(kind.size or 4, 4))
    return scalar


def messages_of(name: str) -> st.SearchStrategy[Any]:
    """Random messages of a type."""
    fields = {f.name: values_of(f.type) for f in message_spec(name).fields}
    return st.builds(message_class(name), **fields)


def to_rosbags(message: Any) -> Any:
    """The same message as rosbags has it."""
    store = JAZZY
    fields = {}
    for field in message._spec.wire_fields:
        value, kind = getattr(message, field.name), field.type
        if not kind.primitive:
            value = [to_rosbags(v) for v in value] if kind.container else to_rosbags(value)
        elif kind.base == "byte":
            signed = np.frombuffer(b"".join(value) if kind.container else value, np.int8)
            value = signed if kind.container else signed[0]
        elif kind.container and kind.base != "string":
            value = np.array(value, np.bool_ if kind.base == "bool" else None)
            if not value.size:
                value = value.astype(np.float64)
        fields[field.name] = value
    return store.types[message._spec.name](**fields)


@pytest.mark.parametrize("name", TYPES)
def test_bytes_equal_those_of_rosbags(name: str) -> None:
    """The CDR of random messages is the same as an independent implementation's, and reads back."""

    @given(messages_of(name))
    def check(message: Any) -> None:
        ours = message.serialize()
        assert ours == bytes(JAZZY.serialize_cdr(to_rosbags(message), name))
        assert type(message).deserialize(ours) == message
        big = JAZZY.serialize_cdr(to_rosbags(message), name, little_endian=False)
        assert type(message).deserialize(bytes(big)) == message

    check()


@pytest.mark.parametrize("name", TYPES)
def test_bytes_that_end_too_early_are_refused(name: str) -> None:
    """Wherever a message is cut off, in both byte orders; it is told how long it must be."""

    @given(messages_of(name), st.data())
    def check(message: Any, data: st.DataObject) -> None:
        ours = message.serialize()
        big = bytes(JAZZY.serialize_cdr(to_rosbags(message), name, little_endian=False))
        cut = data.draw(st.integers(0, len(ours) - 1))
        for whole in (ours, big):
            with pytest.raises(CdrError) as caught:
                type(message).deserialize(whole[:cut])
            assert caught.value.size < caught.value.end <= len(ours)

    check()


@given(st.lists(st.lists(st.sampled_from(["", "a", "ab", "aba", "joint"])), min_size=2))
def test_rows_of_strings_are_each_their_own(rows: list[list[str]]) -> None:
    """The last row is kept for the next message: neither its reader nor a like one spoils that."""
    for row in rows:
        data = JointState(name=row).serialize()
        for _ in range(2):
            message = JointState.deserialize(data)
            assert message.name == row
            message.name.append("added")
        for end in range(len(data)):
            with pytest.raises(CdrError):
                JointState.deserialize(data[:end])


@pytest.mark.parametrize("base", ["bool", "byte", "string", "std_msgs/msg/String"])
@pytest.mark.parametrize("count", [1, 3])
def test_an_array_of_another_length_is_not_written(base: str, count: int) -> None:
    """A list that was checked may have grown or shrunk since then."""
    write = cdr._writer(FieldType(base, "array", 2))
    with pytest.raises(ValueError, match=f"an array of 2 has {count} elements"):
        write([None] * count, bytearray())


@pytest.mark.parametrize("name", [
    *TYPES, "door_impact_msgs/msg/ImpactPlan", "door_impact_msgs/srv/PlanDoorImpact_Request",
    "door_impact_msgs/action/ExecuteDoorImpact_Goal",
    "sensor_msgs/msg/PointCloud2",
])  # fmt: skip
def test_bytes_equal_those_of_cyclone_dds(name: str) -> None:
    """What is written and read is what Cyclone DDS in Python writes and reads."""

    @given(messages_of(name))
    def check(message: Any) -> None:
        theirs = IdlStruct.serialize(message, use_version_2=False)
        assert message.serialize() == theirs
        assert type(message).deserialize(theirs) == message
        again = type(message).deserialize(theirs)
        assert {k: type(v) for k, v in vars(again).items()} == {
            k: type(v) for k, v in vars(message).items()
        }

    check()


def test_definitions_are_kept_and_made_again_when_they_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the file they are the same; a broken file or no home is no error."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    load = jazzy.definitions.__wrapped__
    assert load() == JAZZY.fielddefs
    (kept,) = (tmp_path / "ros2_embedded").iterdir()
    assert load() == JAZZY.fielddefs
    kept.write_bytes(kept.read_bytes()[:1000])
    assert load() == JAZZY.fielddefs
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert load() == JAZZY.fielddefs


def test_every_jazzy_hash_equals_that_of_rosbags() -> None:
    """All message hashes agree with rosbags', but where that errs with char."""
    definitions = JAZZY.fielddefs
    with_char = {n for n in definitions if "'char'" in str(definitions[n][1])}
    within = {n for n in definitions if any(c in str(definitions[n][1]) for c in with_char)}
    nested = {n for n in definitions if any(c in str(definitions[n][1]) for c in within)}
    left_out = with_char | within | nested
    names = [n for n in definitions if "wstring" not in str(definitions[n]) and n not in left_out]
    assert len(names) > 150
    assert [n for n in names if type_hash(n) != JAZZY.hash_rihs01(n)] == []


def test_hashes_are_those_of_a_jazzy_installation() -> None:
    """Every message, service and action here, with what they are made of, as rosidl hashed them."""
    listed = Path(__file__).with_name("jazzy_hashes.txt").read_text().splitlines()
    expected = dict(line.split() for line in listed)
    assert {name: type_hash(name) for name in expected} == expected
    packages = {name.split("/")[0] for name in expected}
    names = [n for p in packages for kind in KINDS for n in full_names(p, kind)]
    assert sorted(set(names) - set(expected)) == []


def full_names(package: str, kind: str) -> list[str]:
    return [f"{package}/{kind}/{short}" for short in list_interfaces(package, kind)]


def test_hash_leaves_defaults_constants_and_comments_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A default changes no hash, another field name does."""
    import ros2_embedded.typehash as module

    texts = {
        "p/msg/A": "float64 x -1.0 # why\nuint8 C=1",
        "p/msg/B": "float64 x",
        "p/msg/C": "float64 y",
    }
    monkeypatch.setattr(module, "message_spec", lambda n: parse_message("p/msg/A", texts[n]))
    bodies = []
    for name in texts:
        described: dict[str, Any] = {}
        module._describe(name, described)
        bodies.append(described[name]["fields"])
    assert bodies[0] == bodies[1] != bodies[2]


@pytest.mark.parametrize(
    ("cls", "field", "value"),
    [
        (JointState, "name", "abc"), (JointState, "name", [1]),
        (JointState, "header", None), (Header, "frame_id", b"odom"), (Header, "frame_id", 3),
        (Quaternion, "w", 1), (Quaternion, "w", True), (Quaternion, "w", "1.0"),
        (Quaternion, "w", None), (PoseWithCovariance, "covariance", [0.0] * 35),
        (Imu, "orientation", Pose()), (DiagnosticStatus, "level", 1),
        (Trigger.Response, "success", 1), (Trigger.Response, "success", np.True_),
        (PlanDoorImpact.Response, "error_code", 256), (PlanDoorImpact.Response, "error_code", -1),
        (PlanDoorImpact.Response, "error_code", 1.0), (PlanDoorImpact.Response, "error_code", "1"),
    ],
)  # fmt: skip
def test_wrong_values_are_refused(cls: Any, field: str, value: Any) -> None:
    """A value of the wrong type, length or range is an error wherever it is given."""
    message = cls()
    before = copy.deepcopy(message)
    with pytest.raises(AssertionError, match=field):
        setattr(message, field, value)
    with pytest.raises(AssertionError, match=field):
        cls(**{field: value})
    assert message == before


def test_unknown_fields_are_refused() -> None:
    """A misspelt field is an error, not a new attribute."""
    with pytest.raises(AttributeError, match="positon"):
        JointState().positon = [1.0]
    with pytest.raises(AssertionError, match="positon"):
        JointState(positon=[1.0])


@pytest.mark.parametrize(
    "value", [[1.0, 2.0], (1.0, 2.0), np.array([1.0, 2.0]), array.array("d", [1, 2])]
)
def test_rows_of_numbers_take_what_holds_numbers(value: Any) -> None:
    """Lists, tuples and arrays become array.array, which numpy reads."""
    message = JointState(position=value)
    assert isinstance(message.position, array.array)
    assert np.asarray(message.position).tolist() == [1.0, 2.0]


def test_fixed_rows_are_numpy_arrays_of_their_own() -> None:
    """A float64[36] is a numpy array that shares nothing with what it was made from."""
    source = np.arange(36.0)
    message = PoseWithCovariance(covariance=source)
    source[0] = 9.0
    assert isinstance(message.covariance, np.ndarray)
    assert message.covariance[0] == 0.0


def test_defaults_come_from_the_definition() -> None:
    """Defaults of the interface files hold, and each message has its own lists."""
    assert PlanDoorImpact.Request().initial_angle == -1.0
    assert Quaternion().w == 1.0
    first, second = JointState(), JointState()
    first.name.append("a")
    first.header.frame_id = "odom"
    assert second == JointState()


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("string s Hello world!  # comment", "Hello world!"), ('string s " it\'s "', " it's "),
        (r"string s 'Hello\'world!'", "Hello'world!"), ("string s 'Hello\"world!'", 'Hello"world!'),
        (r'string s "Hello\"world!"', 'Hello"world!'), ("string s it's", "it's"),
        ("string s 'no # comment'", "'no"), ("string s [a: {", "[a: {"), ('string s ""', ""),
        (r"string s \t\x41\\", "\tA\\"), ("string<=3 s abc", "abc"), ("int32 s 010", 10),
        ("int32 s 0x1F", 31), ("byte s 7", b"\7"), ("bool s 1", True),
        ("string[] s []", []), ("string[] s ['a, b', c d , \"e\"]", ["a, b", "c d", "e"]),
        (r"""string[2] s ['it\'s', 'say "x"']""", ["it's", 'say "x"']),
        ("string[] s [1, '']", ["1", ""]),
        ("bool[<=3] s [true, 0]", [True, False]), ("float64[2] s [1, -2.5e1]", [1.0, -25.0]),
        ("byte[] s [1,2]", [b"\1", b"\2"]),
    ],
)  # fmt: skip
def test_defaults_are_read_as_in_ros(line: str, value: Any) -> None:
    """A default has the value that the same line has in a package built by ROS 2."""
    (field,) = parse_message("p/msg/A", line).fields
    assert field.default == value
    if " s " in line and "[" not in line.split(" s ")[0]:
        (constant,) = parse_message("p/msg/A", line.replace(" s ", " S=")).constants
        assert constant.value == value


@pytest.mark.parametrize(
    "line",
    ["string s 'it's'", "string<=2 s abc", "string[] s [a", "string[] s [a, ]", "string[] s ['a]",
     "string[2] s [a]", "string[<=1] s [a, b]", "string[<=2][] s", "bool s yes", "int8 s x",
     "string<=2[] s [abc]"],
)  # fmt: skip
def test_defaults_that_make_no_sense_are_errors(line: str) -> None:
    """A default that ROS 2 refuses is an error that names the line."""
    with pytest.raises(InterfaceError, match=r"p/msg/A, line 1"):
        parse_message("p/msg/A", line)


def test_constants_types_and_text() -> None:
    """Constants, field types and repr are those of rclpy."""
    assert DiagnosticStatus.WARN == b"\x01"
    assert PlanDoorImpact.Response.NO_DOOR == 2
    assert JointState.get_fields_and_field_types()["position"] == "sequence<double>"
    assert PoseWithCovariance.get_fields_and_field_types()["covariance"] == "double[36]"
    assert repr(Header()) == (
        "std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=0, nanosec=0), frame_id='')"
    )


def test_equality_tells_types_and_nan_apart() -> None:
    """Only messages of one type with the same values are equal; NaN equals nothing."""
    assert Trigger.Request() != Header()
    assert Quaternion(x=math.nan) != Quaternion(x=math.nan)
    assert CloserParameters(covariance=[1.0] * 16) != CloserParameters()


def test_broken_definitions_are_named() -> None:
    """A line that is neither field nor constant is an error with its number."""
    with pytest.raises(InterfaceError, match="line 2"):
        parse_message("p/msg/A", "float64 x\nfloat64")
    with pytest.raises(InterfaceError, match="Unknown"):
        message_class("std_msgs/msg/Nothing")
    with pytest.raises(ImportError):
        from std_msgs.msg import Nothing  # noqa: F401
