"""The class ParameterEventHandler: callbacks for changes of parameters."""

from typing import Any

import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_event_handler import ParameterEventHandler
from spinning import make, spin_until


def test_changes_call_back(executor: SingleThreadedExecutor) -> None:
    """A parameter's callbacks come first, those of all events later, the last one before others."""
    node, other = make(executor, "n", namespace="ns"), make(executor, "m", namespace="ns")
    node.declare_parameter("a", 1)
    other.declare_parameter("a", 1)
    handler = ParameterEventHandler(node)
    heard: list[Any] = []

    def hear(name: str) -> Any:
        return lambda message: heard.append((name, message))

    own = handler.add_parameter_callback("a", "", hear("own"))
    handler.add_parameter_callback("a", "n", hear("relative"))
    event = handler.add_parameter_event_callback(hear("event"))
    handler.add_parameter_callback("a", "/ns/m", hear("other"))
    assert (own.parameter_name, own.node_name) == ("a", "/ns/n")
    assert spin_until(executor, lambda: node.count_publishers("/parameter_events") == 2)

    def change(owner: Any, value: int, count: int) -> list[str]:
        heard.clear()
        owner.set_parameters([Parameter("a", value=value)])
        assert spin_until(executor, lambda: len(heard) >= count)
        executor.spin_once(timeout_sec=0.02)
        return [name for name, _ in heard]

    assert spin_until(executor, lambda: change(node, 2, 0) == ["relative", "own", "event"])
    assert heard[0][1].value.integer_value == 2
    assert heard[2][1].node == "/ns/n"
    assert change(other, 3, 2) == ["other", "event"]
    handler.remove_parameter_callback(own)
    handler.remove_parameter_event_callback(event)
    assert change(node, 4, 1) == ["relative"]
    with pytest.raises(RuntimeError, match="Callback doesn't exist"):
        handler.remove_parameter_callback(own)
    with pytest.raises(RuntimeError, match="Callback doesn't exist"):
        handler.remove_parameter_event_callback(event)
    handler.destroy()
    assert handler.parameter_event_subscription not in node.subscriptions


def test_parameters_of_an_event() -> None:
    """New and changed ones, not deleted ones; one of them by its name and its node's."""
    new, changed, gone = (
        ParameterMessage(name=name, value=ParameterValue(type=2, integer_value=1))
        for name in ("new", "changed", "gone")
    )
    event = ParameterEvent(
        node="/n", new_parameters=[new], changed_parameters=[changed], deleted_parameters=[gone]
    )
    assert list(ParameterEventHandler.get_parameters_from_event(event)) == [new, changed]
    find = ParameterEventHandler.get_parameter_from_event
    assert find(event, "changed", "/n") == changed
    assert find(event, "gone", "/n") is None
    assert find(event, "new", "/m") is None
