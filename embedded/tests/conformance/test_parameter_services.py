"""Parameters of another node, over the wire, and from files."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from spinning import make, result, spin_until
from type_description_interfaces.srv import GetTypeDescription

Ask = Callable[..., Any]


@pytest.fixture
def ask(executor: SingleThreadedExecutor) -> Ask:
    """Calls a method of a client of the node `server`, and waits for the response."""
    server = make(executor, "server", namespace="ns")
    server.declare_parameter("a", 1)
    server.declare_parameter("b.c", [1.0, 2.0])
    server.declare_parameter("b.d.e", "x", ParameterDescriptor(read_only=True, description="d"))
    server.declare_parameter("free", "", ParameterDescriptor(dynamic_typing=True))
    server.declare_parameter("unset", Parameter.Type.BOOL)
    client = AsyncParameterClient(make(executor, "asker"), "/ns/server")
    assert client.wait_for_services(20.0)
    assert client.services_are_ready()
    return lambda method, *arguments: result(executor, getattr(client, method)(*arguments))


def test_listing(ask: Ask) -> None:
    """By prefixes and depth, with the groups that there are."""
    everything = ask("list_parameters").result
    assert {"a", "b.c", "b.d.e", "unset", "use_sim_time"} <= set(everything.names)
    assert set(everything.prefixes) == {"b", "b.d"}
    assert list(ask("list_parameters", ["b"]).result.names) == ["b.c", "b.d.e"]
    assert list(ask("list_parameters", ["b"], 1).result.names) == ["b.c"]
    assert "b.c" not in ask("list_parameters", None, 1).result.names
    assert list(ask("list_parameters", ["no"]).result.names) == []


def test_reading(ask: Ask) -> None:
    """One name that is not known, or has no value, makes the whole answer empty."""
    values = ask("get_parameters", ["b.c", "a"]).values
    assert [parameter_value_to_python(value) for value in values] == [[1.0, 2.0], 1]
    assert list(ask("get_parameters", ["a", "no"]).values) == []
    assert list(ask("get_parameters", ["a", "unset"]).values) == []
    assert list(ask("get_parameter_types", ["a", "b.c", "unset"]).types) == [2, 8, 0]
    assert list(ask("get_parameter_types", ["a", "no"]).types) == []
    (found,) = ask("describe_parameters", ["b.d.e"]).descriptors
    assert (found.name, found.type, found.description) == ("b.d.e", 4, "d")
    assert found.read_only
    assert list(ask("describe_parameters", ["a", "no"]).descriptors) == []


def test_writing(ask: Ask) -> None:
    """Each has its own result; all or none has one."""
    good, bad = Parameter("a", value=2), Parameter("a", value="x")
    results = ask("set_parameters", [good, bad, Parameter("no", value=1)]).results
    assert [r.successful for r in results] == [True, False, False]
    assert results[1].reason == "Wrong parameter type, expected 'Type.INTEGER' got 'Type.STRING'"
    assert results[2].reason == "Invalid access to undeclared parameter(s): []"
    (fixed,) = ask("set_parameters", [Parameter("b.d.e", value="y").to_parameter_msg()]).results
    assert fixed.reason == "Trying to set a read-only parameter: b.d.e."
    both = [Parameter("a", value=3), Parameter("b.c", value=[True])]
    assert not ask("set_parameters_atomically", both).result.successful
    assert ask("get_parameters", ["a"]).values[0].integer_value == 2
    assert ask("set_parameters_atomically", both[:1]).result.successful
    assert ask("get_parameters", ["a"]).values[0].integer_value == 3
    assert ask("delete_parameters", ["free"]).results[0].successful
    assert list(ask("get_parameters", ["free"]).values) == []
    refused = ask("delete_parameters", ["a"]).results[0]
    assert refused.reason == "Static parameter cannot be undeclared"


def test_arrays_that_come_over_the_wire(ask: Ask) -> None:
    """They keep their type, also when they are empty."""
    for value, kind in (([3.0], 8), ([], 8)):
        parameter = Parameter("b.c", Parameter.Type.DOUBLE_ARRAY, value)
        assert ask("set_parameters", [parameter]).results[0].successful
        (found,) = ask("get_parameters", ["b.c"]).values
        assert (found.type, list(found.double_array_value)) == (kind, value)


def test_types_are_described(executor: SingleThreadedExecutor) -> None:
    """Each node describes the types that it uses, by their hash."""
    node = make(executor, "n")
    client = node.create_client(GetTypeDescription, "n/get_type_description")
    assert client.wait_for_service(20.0)
    assert spin_until(executor, lambda: node.get_publishers_info_by_topic("/parameter_events"))
    info = node.get_publishers_info_by_topic("/parameter_events")[0]

    def describe(text: str) -> Any:
        request = GetTypeDescription.Request(type_name=info.topic_type, type_hash=text)
        return result(executor, client.call_async(request))

    found = describe(str(info.topic_type_hash))
    assert found.successful
    described = found.type_description.type_description
    assert described.type_name == "rcl_interfaces/msg/ParameterEvent"
    assert [field.name for field in described.fields] == [
        "stamp", "node", "new_parameters", "changed_parameters", "deleted_parameters"
    ]  # fmt: skip
    referenced = [part.type_name for part in found.type_description.referenced_type_descriptions]
    assert referenced == [
        "builtin_interfaces/msg/Time", "rcl_interfaces/msg/Parameter",
        "rcl_interfaces/msg/ParameterValue",
    ]  # fmt: skip
    unused = describe("RIHS01_" + "00" * 32)
    assert unused.failure_reason == "Type not currently in use by this node"
    assert describe("nonsense").failure_reason == "Failed to parse type hash"


def test_the_description_service_can_be_left_out(executor: SingleThreadedExecutor) -> None:
    """By its parameter, which is read-only."""
    silent = Parameter("start_type_description_service", value=False)
    node = make(executor, "n", parameter_overrides=[silent])
    services = {name for name, _ in node.get_service_names_and_types_by_node("n", "/")}
    assert "/n/get_type_description" not in services
    refused = node.set_parameters([Parameter(silent.name, value=True)])[0]
    assert refused.reason == f"Trying to set a read-only parameter: {silent.name}."


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., None]]:
    """Initialises rclpy with parameter files of the given contents, and other ROS arguments."""

    def start(*texts: str, more: tuple[str, ...] = ()) -> None:
        arguments = ["--ros-args"]
        for number, text in enumerate(texts):
            path = tmp_path / f"{number}.yaml"
            path.write_text(text)
            arguments += ["--params-file", str(path)]
        rclpy.init(args=[*arguments, *more])

    yield start
    rclpy.try_shutdown()


def declared(node: Node, name: str) -> Any:
    """The value from the command line, None if there is none."""
    return node.declare_parameter(name, descriptor=ParameterDescriptor(dynamic_typing=True)).value


def test_types_in_files(started: Callable[..., None]) -> None:
    """rcl tells types apart by its own rules, which are not quite YAML's."""
    cases = {
        "i: 1": 1, "i: -0x1F": -31, "i: 010": 8, "i: '1'": "1", "i: !!str 1": "1",
        "d: 1.0": 1.0, "d: 1e3": 1000.0, "d: 1.": 1.0, "d: .5": 0.5, "d: .inf": float("inf"),
        "b: true": True, "b: Yes": True, "b: off": False, "b: y": True, "b: 'true'": "true",
        "s: text": "text", "s: ''": "", "s: a b": "a b", "s: 1_0": "1_0", "s: null": "null",
        "s: ~": "~", "l: [1, 2]": [1, 2], "l: [1.0, 2.0]": [1.0, 2.0],
        "l: [true, no]": [True, False],
        "l: [a, '1']": ["a", "1"], "l: []": None, "n: {m: {o: 1}}": None, "n.m.q: 2": 2,
    }  # fmt: skip
    lines = [f"    p{k}_{line}" for k, line in enumerate(cases)]
    started("/**:\n  ros__parameters:\n" + "\n".join(lines) + "\n")
    node = Node("n")
    for number, (line, value) in enumerate(cases.items()):
        found = declared(node, f"p{number}_{line.partition(':')[0]}")
        assert (found, type(found)) == (value, type(value)), line
    nested = list(cases).index("n: {m: {o: 1}}")
    assert declared(node, f"p{nested}_n.m.o") == 1


def test_nodes_in_files(started: Callable[..., None]) -> None:
    """By name, by namespace, by wildcards; others' values do not count."""
    started(
        "/**:\n  ros__parameters: {a: 1, b: 1, c: 1, d: 1}\n"
        "/ns/*:\n  ros__parameters: {b: 2, e: 2}\n"
        "/ns/n:\n  ros__parameters: {c: 3}\n"
        "ns:\n  n:\n    ros__parameters: {d: 4}\n"
        "n:\n  ros__parameters: {a: 5}\n"
        "/other/**:\n  ros__parameters: {a: 6}\n"
        "/**/n:\n  ros__parameters: {f: 7}\n"
        "/*:\n  ros__parameters: {a: 8}\n"
    )
    node, other = Node("n", namespace="ns"), Node("m", namespace="other/deep")
    assert [declared(node, name) for name in "abcdef"] == [1, 2, 3, 4, 2, 7]
    assert [declared(other, name) for name in "abcdef"] == [6, 1, 1, 1, None, None]


def test_repeated_keys_in_files(started: Callable[..., None]) -> None:
    """Blocks of the same node, namespace or group of parameters add up; of values the last wins."""
    started(
        "/**:\n  ros__parameters: {a: 1, b: 1}\n"
        "n:\n  ros__parameters: {c: 1, g: {x: 1, y: 1}}\n"
        "n:\n  ros__parameters: {d: 2, g: {y: 2}, g: {z: 3}}\n"
        "/**:\n  ros__parameters: {b: 2, e: 5, f: 1, f: 6}\n"
        "ns:\n  n:\n    ros__parameters: {a: 7}\n"
        "ns:\n  m:\n    ros__parameters: {a: 8}\n"
    )
    node, other = Node("n"), Node("n", namespace="ns")
    names = ("a", "b", "c", "d", "e", "f", "g.x", "g.y", "g.z")
    assert [declared(node, name) for name in names] == [1, 2, 1, 2, 5, 6, 1, 2, 3]
    assert [declared(other, name) for name in "abcd"] == [7, 2, None, None]


def test_what_comes_later_wins(started: Callable[..., None]) -> None:
    """Among files and values; but a pattern counts where it was mentioned first."""
    started(
        "/**:\n  ros__parameters: {a: 1, b: 1, g.h: 1}\n",
        "n:\n  ros__parameters: {a: 2}\n",
        "/**:\n  ros__parameters: {a: 3, b: 3}\n",
        more=("-p", "b:=4", "-p", "n:c:=[x, z]", "-p", "m:d:=1", "-p", "g.h:=true", "-p", "s:=a b"),
    )
    node = Node("n")
    found = [declared(node, name) for name in ("a", "b", "c", "d", "g.h", "s")]
    assert found == [2, 4, ["x", "z"], None, True, "a b"]


@pytest.mark.parametrize(
    "text",
    ["/**:\n  ros__parameters:\n    a: [1, 2.0]\n", "/**:\n  ros__parameters:\n    a: [1, b]\n",
     "/**:\n  ros__parameters:\n    a:\n", "- a\n", "{"],
)  # fmt: skip
def test_bad_files(started: Callable[..., None], text: str) -> None:
    """Mixed lists, missing values, what is no parameter file."""
    with pytest.raises(RuntimeError, match="Couldn't parse params file"):
        started(text)
    assert not rclpy.ok()


def test_files_as_dictionaries(tmp_path: Path) -> None:
    """Messages by name, of the nodes that are wanted."""
    path = tmp_path / "p.yaml"
    path.write_text(
        "/**:\n  ros__parameters: {a: 1, w: 1}\n"
        "/n:\n  ros__parameters: {a: 2, deep: {x: 1.5, y: [a, b]}, t: text}\n"
        "m:\n  ros__parameters: {z: true}\n"
    )

    def read(*arguments: Any, **options: Any) -> dict[str, Any]:
        found = parameter_dict_from_yaml_file(str(path), *arguments, **options)
        assert all(message.name == name for name, message in found.items())
        return {name: parameter_value_to_python(m.value) for name, m in found.items()}

    assert read() == {"a": 2, "deep.x": 1.5, "deep.y": ["a", "b"], "t": "text", "z": True}
    assert read(True)["w"] == 1
    assert read(True)["a"] == 2
    assert read(target_nodes=["m"], namespace="p.") == {"p.z": True}
    with pytest.raises(RuntimeError, match="Param file does not contain parameters for x"):
        read(target_nodes=["x"])
    path.write_text("n: {a: 1}\n")
    with pytest.raises(RuntimeError, match="not a valid ROS parameter file for node n"):
        read()
    assert ParameterType.PARAMETER_STRING_ARRAY == 9
