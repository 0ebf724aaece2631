"""Messages: how they are made, what their fields take, what they say of themselves."""

import array
import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion
from rcl_interfaces.msg import Log, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from sensor_msgs.msg import Image, Imu, JointState, PointField
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import (
    Bool,
    Byte,
    Char,
    Float32,
    Float64,
    Float64MultiArray,
    Header,
    Int8,
    Int32,
    Int64,
    String,
    UInt8,
)
from std_srvs.srv import SetBool, Trigger


def test_defaults() -> None:
    """Nothing, or what the definition says; each message has its own."""
    joints = JointState()
    assert (joints.name, joints.position) == ([], array.array("d"))
    assert joints.header.stamp == Time(sec=0, nanosec=0)
    assert (Quaternion().w, Quaternion().x) == (1.0, 0.0)
    assert Byte().data == b"\0"
    assert Char().data == 0
    assert Bool().data is False
    joints.name.append("a")
    joints.position.append(1.0)
    assert JointState() == JointState(name=[], position=[])
    assert JointState().name == []
    assert list(JointState().position) == []
    assert Imu().orientation_covariance.dtype == np.float64
    assert Imu().orientation_covariance.tolist() == [0.0] * 9
    assert Image().data == array.array("B")


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: String(data=5), "The 'data' field must be of type 'str'"),
        (lambda: String(data=b"x"), "The 'data' field must be of type 'str'"),
        (lambda: String(data=None), "The 'data' field must be of type 'str'"),
        (lambda: Int32(data=1.0), "The 'data' field must be of type 'int'"),
        (lambda: Char(data="a"), "The 'data' field must be of type 'int'"),
        (lambda: Int8(data=128), r"The 'data' field must be an integer in \[-128, 127\]"),
        (lambda: UInt8(data=-1), r"The 'data' field must be an .*integer in \[0, 255\]"),
        (lambda: Int64(data=1 << 63), "The 'data' field must be an integer in"),
        (lambda: Float64(data=1), "The 'data' field must be of type 'float'"),
        (lambda: Float64(data=np.float32(1)), "The 'data' field must be of type 'float'"),
        (lambda: Float32(data=1e40), r"The 'data' field must be a float in \[-3.402823466e\+38, 3"),
        (lambda: Bool(data=1), "The 'data' field must be of type 'bool'"),
        (lambda: Byte(data=1), "The 'data' field must be of type 'bytes' or 'ByteString' with len"),
        (lambda: Byte(data=b"ab"), "The 'data' field must be of type 'bytes' or 'ByteString' with"),
        (lambda: Header(stamp=1), "The 'stamp' field must be a sub message of type 'Time'"),
        (lambda: Header(stamp=Header()), "The 'stamp' field must be a sub message of type 'Time'"),
        (lambda: JointState(name="ab"),
         "The 'name' field must be a set or sequence and each value of type 'str'"),
        (lambda: JointState(name=["a", 1]),
         "The 'name' field must be a set or sequence and each value of type 'str'"),
        (lambda: SetParameters.Request(parameters=[1]),
         "The 'parameters' field must be a set or sequence and each value of type 'Parameter'"),
        (lambda: ParameterValue(byte_array_value=[1]),
         "The 'byte_array_value' field must be a set or sequence and each value of type 'bytes'"),
        (lambda: Imu(orientation_covariance=[1.0]), "orientation_covariance"),
        (lambda: SolidPrimitive(dimensions=[1.0] * 4), "dimensions"),
        (lambda: String(dat="x"), "Invalid arguments passed to constructor: dat"),
        (lambda: Header(a=1, frame_id="x", c=2), "Invalid arguments passed to constructor: a, c"),
    ],
)  # fmt: skip
def test_wrong_values(make: Callable[[], Any], text: str) -> None:
    """The error names the field and what it takes."""
    with pytest.raises(AssertionError, match=text):
        make()


def test_rows_of_numbers() -> None:
    """The constructor makes an array of any row of numbers; setting takes the exact type only."""
    for row in ([1.0, 2.0], (1.0, 2.0), array.array("d", [1, 2]), np.ones(2) * [1, 2], [1, 2],
                array.array("i", [1, 2])):  # fmt: skip
        assert JointState(position=row).position == array.array("d", [1.0, 2.0])
    assert Float64MultiArray(data={1.0}).data == array.array("d", [1.0])
    assert Image(data=b"ab").data == Image(data=bytearray(b"ab")).data == array.array("B", b"ab")
    for wrong, error in (("ab", TypeError), (1.0, TypeError), (["a"], TypeError)):
        with pytest.raises(error):
            JointState(position=wrong)
    with pytest.raises(OverflowError):
        Image(data=[256])
    joints = JointState()
    for good in ([1.0, 2.0], (1.0, 2.0), array.array("d", [1.0, 2.0])):
        joints.position = good
        assert joints.position == array.array("d", [1.0, 2.0])
    for bad in ([1], "ab", 1.0, ["a"], None):
        with pytest.raises(AssertionError, match="position"):
            joints.position = bad
    imu = Imu(orientation_covariance=[float(i) for i in range(9)])
    assert imu.orientation_covariance[8] == 8.0
    imu.orientation_covariance[0] = 5.0
    assert imu.orientation_covariance[0] == 5.0
    for bad in (np.zeros(8), [1.0] * 10, [1] * 9, "123456789"):
        with pytest.raises(AssertionError, match="orientation_covariance"):
            imu.orientation_covariance = bad


def test_a_row_is_copied_at_first() -> None:
    """What the program does to its array later does not change the message."""
    row = array.array("d", [1.0])
    joints = JointState(position=row)
    row[0] = 2.0
    assert joints.position[0] == 1.0


def test_setting_fields() -> None:
    """A field is checked whenever it is set; others do not exist."""
    header = Header()
    header.frame_id = "x"
    header.stamp.sec = 3
    assert header == Header(stamp=Time(sec=3), frame_id="x")
    with pytest.raises(AssertionError, match="frame_id"):
        header.frame_id = 5
    with pytest.raises(AssertionError, match="sec"):
        header.stamp.sec = 1.0
    assert header.frame_id == "x"
    with pytest.raises(AttributeError):
        header.nonsense = 1
    with pytest.raises(TypeError):
        String("x")
    assert UInt8(data=True).data == 1


def test_equality() -> None:
    """By type and all fields."""
    assert String() == String(data="")
    assert String(data="a") != String(data="b")
    assert String() != Header()
    assert String() != ""
    assert Imu() == Imu()
    other = Imu()
    other.angular_velocity_covariance[:] = 1.0  # ROS 2 takes one number alone for equal
    assert Imu() != other
    assert JointState(position=[1.0]) != JointState(position=[1.0, 2.0])
    with pytest.raises(TypeError):
        hash(String())


def test_copies() -> None:
    """A copy shares what can be changed, a deep copy and a pickle do not."""
    joints = JointState(name=["a"], position=[1.0])
    shallow, deep = copy.copy(joints), copy.deepcopy(joints)
    again = pickle.loads(pickle.dumps(joints))
    assert joints == shallow == deep == again
    joints.name.append("b")
    joints.header.frame_id = "x"
    assert shallow == joints
    assert deep == again == JointState(name=["a"], position=[1.0])
    assert copy.deepcopy(Imu()) == Imu()


def test_what_they_look_like() -> None:
    """With their package and all fields."""
    assert repr(Header(frame_id="x")) == (
        "std_msgs.msg.Header(stamp=builtin_interfaces.msg.Time(sec=0, nanosec=0), frame_id='x')"
    )
    assert str(String(data="a")) == repr(String(data="a")) == "std_msgs.msg.String(data='a')"
    assert repr(JointState(position=[1.0])).endswith(
        "name=[], position=[1.0], velocity=[], effort=[])"
    )
    assert "orientation_covariance=array([0., 0., 0., 0., 0., 0., 0., 0., 0.])" in repr(Imu())
    assert repr(Byte(data=b"\1")) == "std_msgs.msg.Byte(data=b'\\x01')"
    assert repr(Trigger.Response(success=True, message="x")) == (
        "std_srvs.srv.Trigger_Response(success=True, message='x')"
    )
    assert repr(Trigger.Request()) == "std_srvs.srv.Trigger_Request()"


def test_constants() -> None:
    """On the class and on a message; they cannot be changed on a message."""
    assert (Log.WARN, Log.DEBUG) == (30, 10)
    assert PointField.FLOAT32 == PointField().FLOAT32 == 7
    assert ParameterType.PARAMETER_STRING_ARRAY == 9
    assert SolidPrimitive.BOX == 1
    with pytest.raises(AttributeError):
        PointField().FLOAT32 = 8


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        (String, {"data": "string"}),
        (JointState, {"header": "std_msgs/Header", "name": "sequence<string>",
                      "position": "sequence<double>", "velocity": "sequence<double>",
                      "effort": "sequence<double>"}),
        (Imu, {"header": "std_msgs/Header", "orientation": "geometry_msgs/Quaternion",
               "orientation_covariance": "double[9]",
               "angular_velocity": "geometry_msgs/Vector3",
               "angular_velocity_covariance": "double[9]",
               "linear_acceleration": "geometry_msgs/Vector3",
               "linear_acceleration_covariance": "double[9]"}),
        (SolidPrimitive, {"type": "uint8", "dimensions": "sequence<double, 3>",
                          "polygon": "geometry_msgs/Polygon"}),
        (ParameterDescriptor, {
            "name": "string", "type": "uint8", "description": "string",
            "additional_constraints": "string", "read_only": "boolean",
            "dynamic_typing": "boolean",
            "floating_point_range": "sequence<rcl_interfaces/FloatingPointRange, 1>",
            "integer_range": "sequence<rcl_interfaces/IntegerRange, 1>"}),
        (Byte, {"data": "octet"}), (Bool, {"data": "boolean"}), (Float32, {"data": "float"}),
        (SetBool.Request, {"data": "boolean"}), (Trigger.Request, {}),
    ],
)  # fmt: skip
def test_fields_are_described(kind: Any, fields: dict[str, str]) -> None:
    """Names and types, as IDL writes them; the caller gets a dictionary of its own."""
    assert kind.get_fields_and_field_types() == fields
    kind.get_fields_and_field_types()["more"] = ""
    assert "more" not in kind.get_fields_and_field_types()
    assert kind().get_fields_and_field_types() == fields


def test_services() -> None:
    """A service has the classes of its parts, and cannot be made itself."""
    assert SetBool.Request(data=True).data is True
    assert SetBool.Response.__name__ == "SetBool_Response"
    with pytest.raises(NotImplementedError, match="Service classes can not be instantiated"):
        SetBool()
