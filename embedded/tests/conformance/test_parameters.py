"""Parameters: declaring, types, ranges, callbacks and what is said when they are refused."""

import warnings
from typing import Any

import pytest
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterEvent,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from spinning import make, spin_until

Type = Parameter.Type
DYNAMIC = ParameterDescriptor(dynamic_typing=True)


@pytest.fixture
def node(executor: SingleThreadedExecutor) -> Node:
    """A node."""
    return make(executor)


def reason(node: Node, name: str, value: Any) -> str:
    """Why a value is refused, empty if it is not."""
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert result.successful == (not result.reason)
    return str(result.reason)


def test_declaring_gives_a_value_and_a_type(node: Node) -> None:
    """The type is kept; once declared, a name is taken."""
    assert node.declare_parameter("a.b", 1).value == 1
    assert node.has_parameter("a.b")
    assert not node.has_parameter("a")
    assert node.get_parameter("a.b").type_ is Type.INTEGER
    assert reason(node, "a.b", 1.0) == (
        "Wrong parameter type, expected 'Type.INTEGER' got 'Type.DOUBLE'"
    )
    assert reason(node, "a.b", None) == "Static parameter cannot be undeclared"
    with pytest.raises(ParameterAlreadyDeclaredException) as taken:
        node.declare_parameter("a.b", 2)
    assert str(taken.value) == "Parameter(s) already declared: ['a.b']"
    assert isinstance(taken.value, ParameterException)
    with pytest.raises(InvalidParameterException, match="Invalid parameter name: "):
        node.declare_parameter("", 1)
    with pytest.raises(TypeError, match="allowed types"):
        node.declare_parameter("x", {})
    assert node.get_parameter("a.b").value == 1


def test_declaring_a_type_only(node: Node) -> None:
    """Such a parameter has no value until one of its type is set."""
    assert node.declare_parameter("p", Type.DOUBLE).value is None
    with pytest.raises(ParameterUninitializedException) as unset:
        node.get_parameter("p")
    assert str(unset.value) == "The parameter 'p' is not initialized: p"
    alternative = Parameter("p", value=3.0)
    assert node.get_parameter_or("p", alternative) is alternative
    assert node.get_parameter_or("p").type_ is Type.NOT_SET
    assert "got 'Type.INTEGER'" in reason(node, "p", 1)
    assert reason(node, "p", 1.5) == ""
    assert node.get_parameter("p").value == 1.5
    assert node.get_parameter_or("p", alternative).value == 1.5
    with pytest.raises(ValueError, match="statically typed of type NOT_SET"):
        node.declare_parameter("q", Type.NOT_SET)
    with pytest.raises(ValueError, match="is not allowed when the parameter type is provided"):
        node.declare_parameter("q", Type.BOOL, ParameterDescriptor(dynamic_typing=True))
    with pytest.raises(ValueError, match="Cannot declare a statically typed parameter"):
        node.declare_parameter("q", None, ParameterDescriptor())


def test_dynamic_typing(node: Node) -> None:
    """Any type may be set; nothing undeclares it."""
    node.declare_parameter("p", None, ParameterDescriptor(dynamic_typing=True))
    assert node.get_parameter("p").value is None
    for value in (1, "x", [1.0]):
        assert reason(node, "p", value) == ""
        assert node.get_parameter("p").value == value
        assert node.describe_parameter("p").type == Type.from_parameter_value(value).value
    assert reason(node, "p", None) == ""
    assert not node.has_parameter("p")
    with pytest.warns(UserWarning, match="only providing its name is deprecated"):
        node.declare_parameter("q")
    assert node.describe_parameter("q").dynamic_typing


def test_declaring_several(node: Node) -> None:
    """With a namespace before the names; a wrong tuple is an error."""
    found = node.declare_parameters("ns", [("a", 1), ("b", "x", ParameterDescriptor())])
    assert [(p.name, p.value) for p in found] == [("ns.a", 1), ("ns.b", "x")]
    assert {k: p.value for k, p in node.get_parameters_by_prefix("ns").items()} == {
        "a": 1, "b": "x"
    }  # fmt: skip
    assert node.get_parameters_by_prefix("n") == {}
    assert "ns.a" in node.get_parameters_by_prefix("")
    for wrong in ([()], [(1, 2)], [("c", 1, 2)], [("c", 1, ParameterDescriptor(), 4)]):
        with pytest.raises(TypeError):
            node.declare_parameters("", wrong)
    with pytest.raises(ParameterAlreadyDeclaredException):
        node.declare_parameters("ns", [("new", 1), ("a", 1)])
    assert not node.has_parameter("ns.new")


def test_undeclared_parameters(node: Node) -> None:
    """They are neither read nor set nor described."""
    for attempt in (
        node.get_parameter, node.describe_parameter, node.undeclare_parameter,
        node.get_parameter_type, lambda name: node.set_descriptor(name, ParameterDescriptor()),
    ):  # fmt: skip
        with pytest.raises(ParameterNotDeclaredException) as missing:
            attempt("no")
        assert str(missing.value) == "Invalid access to undeclared parameter(s): no"
    with pytest.raises(ParameterNotDeclaredException):
        node.set_parameters([Parameter("no", value=1)])
    with pytest.raises(ParameterNotDeclaredException):
        node.get_parameters(["use_sim_time", "no"])
    with pytest.raises(TypeError, match="All names must be instances of type str"):
        node.get_parameters([1])
    assert node.get_parameter_or("no").value is None
    with pytest.raises(TypeError, match="parameter must be instance of type"):
        node.set_parameters([1])


def test_undeclared_parameters_may_be_allowed(executor: SingleThreadedExecutor) -> None:
    """They read as not set; setting declares them with dynamic typing."""
    node = make(executor, allow_undeclared_parameters=True)
    assert node.get_parameter("p").type_ is Type.NOT_SET
    assert node.describe_parameter("p") == ParameterDescriptor()
    assert not node.has_parameter("p")
    assert reason(node, "p", 1) == ""
    assert node.has_parameter("p")
    assert reason(node, "p", "text") == ""
    assert reason(node, "p", None) == ""
    assert not node.has_parameter("p")
    node.undeclare_parameter("use_sim_time")
    assert not node.has_parameter("use_sim_time")


def test_read_only_parameters(node: Node) -> None:
    """Neither set nor undeclared nor described anew."""
    node.declare_parameter("p", 1, ParameterDescriptor(read_only=True))
    assert reason(node, "p", 2) == "Trying to set a read-only parameter: p."
    for attempt in (
        lambda: node.undeclare_parameter("p"),
        lambda: node.set_descriptor("p", ParameterDescriptor()),
    ):
        with pytest.raises(ParameterImmutableException) as fixed:
            attempt()
        assert str(fixed.value) == "Attempted to modify read-only parameter: p"
    node.declare_parameter("q", 1)
    node.undeclare_parameter("q")
    assert not node.has_parameter("q")


INTEGERS = ParameterDescriptor(integer_range=[IntegerRange(from_value=-4, to_value=7, step=3)])
FLOATS = ParameterDescriptor(
    floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0, step=0.3)]
)


def test_integer_ranges(node: Node) -> None:
    """The ends are always allowed, in between only steps from the lower end."""
    node.declare_parameter("p", -4, INTEGERS)
    for good in (-1, 5, 7, -4):
        assert reason(node, "p", good) == ""
    assert reason(node, "p", 8) == "Parameter p out of range. Min: -4, Max: 7, value: 8"
    assert reason(node, "p", 0) == (
        "The parameter value for p is not a valid step. Min: -4, max: 7, value: 0, step: 3"
    )
    with pytest.raises(InvalidParameterValueException) as refused:
        node.declare_parameter("q", 9, ParameterDescriptor(integer_range=INTEGERS.integer_range))
    assert str(refused.value) == (
        "Invalid parameter value (9) for parameter. "
        "Reason: Parameter q out of range. Min: -4, Max: 7, value: 9: q"
    )
    assert not node.has_parameter("q")


def test_float_ranges(node: Node) -> None:
    """The same with a tolerance; ends in the other order mean the same."""
    node.declare_parameter("p", 0.0, FLOATS)
    for good in (0.3, 0.6 + 1e-8, 1.0, 1.0 + 1e-8):
        assert reason(node, "p", good) == ""
    assert reason(node, "p", 1.1) == "Parameter p out of range Min: 0.0, Max: 1.0, value: 1.1"
    assert reason(node, "p", 0.5) == (
        "The parameter value for p is not close enough to a valid step. "
        "Min: 0.0, max: 1.0, value: 0.5, step: 0.3"
    )
    turned = FloatingPointRange(from_value=2.0, to_value=-2.0)
    node.declare_parameter("q", 1.0, ParameterDescriptor(floating_point_range=[turned]))
    assert reason(node, "q", -1.9) == ""
    assert "Min: -2.0, Max: 2.0, value: 3.0" in reason(node, "q", 3.0)


def test_descriptors(node: Node) -> None:
    """Name and type are rclpy's; a new descriptor must fit the value or the alternative."""
    descriptor = ParameterDescriptor(name="other", type=9, description="d")
    node.declare_parameter("p", 5, descriptor)
    found = node.describe_parameter("p")
    assert (found.name, found.type, found.description) == ("p", 2, "d")
    assert [d.name for d in node.describe_parameters(["p", "use_sim_time"])] == [
        "p", "use_sim_time"
    ]  # fmt: skip
    narrow = ParameterDescriptor(
        type=ParameterType.PARAMETER_INTEGER,
        integer_range=[IntegerRange(from_value=0, to_value=3)],
    )
    with pytest.raises(InvalidParameterValueException, match="out of range"):
        node.set_descriptor("p", narrow)
    alternative = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=2)
    assert node.set_descriptor("p", narrow, alternative).integer_value == 2
    assert node.get_parameter("p").value == 2
    assert "out of range" in reason(node, "p", 4)


def test_types_and_lists_of_names(node: Node) -> None:
    """Types by number; names by prefix and depth."""
    for name in ("a", "b.c", "b.d.e", "b.d.f", "bc"):
        node.declare_parameter(name, 1)
    assert node.get_parameter_types(["a", "use_sim_time"]) == [2, 1]

    def names(prefixes: list[str], depth: int) -> set[str]:
        return set(node.list_parameters(prefixes, depth).names)

    assert {"a", "b.c", "b.d.e", "use_sim_time"} <= names([], 0)
    assert names([], 1) & {"a", "b.c", "b.d.e", "bc"} == {"a", "bc"}
    assert "b.c" in names([], 2)
    assert "b.d.e" not in names([], 2)
    assert names(["b"], 0) == {"b.c", "b.d.e", "b.d.f"}
    assert names(["b"], 1) == {"b.c"}
    assert names(["b.d", "a"], 1) == {"b.d.e", "b.d.f", "a"}
    assert names(["nothing"], 0) == set()
    assert list(node.list_parameters(["b"], 0).prefixes) == ["b", "b.d"]
    for wrong in (("b", 0), ([1], 0), ([], "1")):
        with pytest.raises(TypeError):
            node.list_parameters(*wrong)
    with pytest.raises(ValueError, match="greater than or equal to zero"):
        node.list_parameters([], -1)


def test_callbacks_and_their_order(node: Node) -> None:
    """Before, asked, after; of each kind the last one that was added is called first."""
    node.declare_parameter("p", 1)
    node.declare_parameter("q", 1)
    calls: list[tuple[str, list[Any]]] = []

    def note(name: str, answer: Any) -> Any:
        def callback(parameters: list[Parameter]) -> Any:
            calls.append((name, [(p.name, p.value, node.get_parameter("p").value)
                                 for p in parameters]))  # fmt: skip
            return answer(parameters) if callable(answer) else answer

        return callback

    accept = SetParametersResult(successful=True)
    more = note("pre", lambda parameters: [*parameters, Parameter("q", value=7)])
    asked, first, after = note("on", accept), note("on first", accept), note("post", None)
    node.add_pre_set_parameters_callback(more)
    node.add_on_set_parameters_callback(asked)
    node.add_on_set_parameters_callback(first)
    node.add_post_set_parameters_callback(after)
    assert reason(node, "p", 2) == ""
    assert calls == [
        ("pre", [("p", 2, 1)]),
        ("on first", [("p", 2, 1), ("q", 7, 1)]),
        ("on", [("p", 2, 1), ("q", 7, 1)]),
        ("post", [("p", 2, 2), ("q", 7, 2)]),
    ]
    assert node.get_parameter("q").value == 7
    calls.clear()
    node.declare_parameter("r", 1)  # does not ask those before
    assert [name for name, _ in calls] == ["on first", "on", "post"]
    calls.clear()
    node.remove_pre_set_parameters_callback(more)
    node.remove_on_set_parameters_callback(first)
    node.remove_post_set_parameters_callback(after)
    assert reason(node, "p", 3) == ""
    assert [name for name, _ in calls] == ["on"]
    with pytest.raises(ValueError, match=r"not in list"):
        node.remove_on_set_parameters_callback(first)


def test_refusing_callbacks(node: Node) -> None:
    """What one refuses is not set, and the others are not asked."""
    node.declare_parameter("p", 1)
    never: list[Any] = []
    node.add_post_set_parameters_callback(never.append)
    node.add_on_set_parameters_callback(
        lambda _: SetParametersResult(successful=False, reason="because")
    )
    assert reason(node, "p", 2) == "because"
    assert node.get_parameter("p").value == 1
    with pytest.raises(InvalidParameterValueException, match="Reason: because: new"):
        node.declare_parameter("new", 1)
    assert never == []
    assert not node.has_parameter("new")
    node.add_pre_set_parameters_callback(lambda _: [])
    assert reason(node, "p", 2).startswith("parameter list cannot be empty, this might be due to")


def test_setting_all_or_none(node: Node) -> None:
    """One that is refused keeps all from being set; one after the other sets those before it."""
    node.declare_parameter("p", 1)
    node.declare_parameter("q", "x")
    both = [Parameter("p", value=2), Parameter("q", value=2)]
    assert not node.set_parameters_atomically(both).successful
    assert node.get_parameter("p").value == 1
    assert [r.successful for r in node.set_parameters(both)] == [True, False]
    assert node.get_parameter("p").value == 2
    with pytest.raises(ParameterNotDeclaredException):
        node.set_parameters_atomically([Parameter("p", value=3), Parameter("no", value=1)])
    assert node.get_parameter("p").value == 2


def test_overrides(executor: SingleThreadedExecutor) -> None:
    """They replace defaults, must have the type, and can be left aside."""
    given = [Parameter("a", value=1), Parameter("b", value="x"), Parameter("c", value=2)]
    node = make(executor, parameter_overrides=given)
    assert not node.has_parameter("a")
    assert node.declare_parameter("a", 5).value == 1
    assert node.declare_parameter("c", 5, ignore_override=True).value == 5
    with pytest.raises(InvalidParameterTypeException) as wrong:
        node.declare_parameter("b", 1.0)
    assert str(wrong.value) == (
        "Trying to set parameter 'b' to 'x' of type 'STRING', expecting type 'DOUBLE': b"
    )
    eager = make(
        executor, "eager", parameter_overrides=given,
        automatically_declare_parameters_from_overrides=True,
    )  # fmt: skip
    assert [eager.get_parameter(name).value for name in "abc"] == [1, "x", 2]


def test_every_node_has_some(node: Node) -> None:
    """Simulated time and the type descriptions' service."""
    assert node.get_parameter("use_sim_time").value is False
    assert node.get_parameter("start_type_description_service").value is True
    assert "should be bool" not in reason(node, "use_sim_time", True)
    assert node.get_clock().ros_time_is_active
    assert reason(node, "use_sim_time", False) == ""
    assert not node.get_clock().ros_time_is_active


def test_changes_are_published(executor: SingleThreadedExecutor) -> None:
    """What is new, changed and deleted, with the node's full name."""
    listener, node = make(executor, "listener"), make(executor, "n", namespace="/ns")
    events: list[Any] = []
    listener.create_subscription(ParameterEvent, "/parameter_events", events.append, 100)
    assert spin_until(
        executor,
        lambda: all(p.get_subscription_count() for p in node.publishers),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        node.declare_parameter("p", 1, ParameterDescriptor(dynamic_typing=True))
    node.set_parameters([Parameter("p", value="x")])
    node.set_parameters([Parameter("p")])

    def mine() -> list[Any]:
        return [e for e in events if e.node == "/ns/n"]

    assert spin_until(executor, lambda: len(mine()) >= 3)
    new, changed, deleted = mine()[-3:]
    assert [p.name for p in new.new_parameters] == ["p"]
    assert new.new_parameters[0].value.integer_value == 1
    assert changed.changed_parameters[0].value.string_value == "x"
    assert [p.name for p in deleted.deleted_parameters] == ["p"]
    assert not deleted.changed_parameters
    assert new.stamp.sec > 0
