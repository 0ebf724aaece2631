"""The class Parameter: values, their types, and messages of them."""

import array
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterValue
from rclpy.parameter import Parameter, get_parameter_value, parameter_value_to_python

Type = Parameter.Type


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (None, "NOT_SET"), (True, "BOOL"), (1, "INTEGER"), (1.0, "DOUBLE"), ("x", "STRING"),
        ([b"\1"], "BYTE_ARRAY"), ([True], "BOOL_ARRAY"), ([1], "INTEGER_ARRAY"),
        ((1.0,), "DOUBLE_ARRAY"), (["x"], "STRING_ARRAY"), ([], "BYTE_ARRAY"),
        ([True, 1], "INTEGER_ARRAY"), (array.array("q", [1]), "INTEGER_ARRAY"),
        (array.array("d", [1]), "DOUBLE_ARRAY"),
    ],
)  # fmt: skip
def test_types_of_values(value: Any, kind: str) -> None:
    """The type follows from the value; a message carries both."""
    parameter = Parameter("p", value=value)
    assert parameter.type_ is Type[kind]
    assert Type.from_parameter_value(value) is Type[kind]
    assert Type[kind].check(value)
    message = parameter.to_parameter_msg()
    assert (message.name, message.value.type) == ("p", Type[kind].value)
    again = Parameter.from_parameter_msg(message)
    assert (again.name, again.type_) == ("p", Type[kind])
    python = parameter_value_to_python(message.value)
    assert python == (list(value) if isinstance(value, (list, tuple, array.array)) else value)


def test_what_is_no_parameter() -> None:
    """A wrong value, a type that does not fit it, and what is no type."""
    for wrong in (1j, [1, "a"], [None], {}, b"x"):
        with pytest.raises(TypeError, match="allowed types"):
            Parameter("p", value=wrong)
    with pytest.raises(ValueError, match=r"Type 'Type.INTEGER' and value '1.0' do not agree"):
        Parameter("p", Type.INTEGER, 1.0)
    with pytest.raises(ValueError, match="do not agree"):
        Parameter("p", Type.BYTE_ARRAY, [b"ab"])
    with pytest.raises(TypeError, match="type must be an instance of"):
        Parameter("p", 2, 1)
    with pytest.raises(RuntimeError, match="unexpected parameter type 77"):
        parameter_value_to_python(ParameterValue(type=77))
    with pytest.raises(AttributeError):
        Parameter("p", value=1).value = 2
    assert not isinstance(Type.BOOL, int)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("true", True), ("1", 1), ("1.5", 1.5), ("abc", "abc"), ("[1, 2]", [1, 2]),
        ("[1.0]", [1.0]), ("[true]", [True]), ("[a, b]", ["a", "b"]), ("[1, a]", "[1, a]"),
        ("", ""), ("'1'", "1"), ("1e3", "1e3"),
    ],
)  # fmt: skip
def test_values_from_text(text: str, value: Any) -> None:
    """As YAML reads it; what is no value stays text."""
    assert parameter_value_to_python(get_parameter_value(text)) == value
