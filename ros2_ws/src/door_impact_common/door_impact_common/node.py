"""How every node of this project starts and ends."""

import signal
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from door_impact_common.errors import DoorImpactError

DISCOVERY_TIME = 1.0  # until another node of the same name would be known [s]
_POLL = 0.05  # [s]


class TwinError(DoorImpactError):
    """Another node of the same name is in the graph; `value` is its full name."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"another node named {name} is in the graph: end it first (one that was killed is "
            "forgotten after about 10 s), rename this one with --ros-args -r __node:=NAME, or set "
            "another ROS_DOMAIN_ID",
            quantity="name of the node",
            value=name,
        )


def fixed() -> ParameterDescriptor:
    """Of a parameter that is read once; each needs its own, rclpy writes the name into it."""
    return ParameterDescriptor(read_only=True)


def refuse_twin(node: Node, until: float) -> None:
    """Wait until a twin would be known.

    Args:
        node: The node, not yet spinning.
        until: On the clock of `time.monotonic` [s].

    Raises:
        TwinError: There is another node of this name; two would answer and command at once.
    """
    me = (node.get_name(), node.get_namespace())
    while rclpy.ok():
        if list(node.get_node_names_and_namespaces()).count(me) > 1:
            raise TwinError(node.get_fully_qualified_name())
        left = until - time.monotonic()
        if left <= 0.0:
            return
        time.sleep(min(left, _POLL))


def run_node(
    make: Callable[[], Any],
    *,
    errors: tuple[type[Exception], ...] = (),
    args: Sequence[str] | None = None,
    spin: Callable[[Any], None] = rclpy.spin,
) -> int:
    """Run a node until it is told to end; in the main thread.

    Args:
        make: Makes the node.
        errors: What it may raise besides DoorImpactError to say what is wrong with its parameters;
            these are shown as one line.
        args: Command line; the process's own by default.
        spin: What it does.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 where the node cannot run.
    """
    node, began = None, False
    told: tuple[type[Exception], ...] = (DoorImpactError, ParameterException, *errors)
    ends: list[int] = []
    # rclpy's own handler ends spinning. A KeyboardInterrupt beside it could come in the middle of
    # anything, and twice: from the terminal and from the launcher.
    previous = signal.signal(signal.SIGINT, lambda number, _: ends.append(number))
    try:
        rclpy.init(args=args)
        began = True
        known = time.monotonic() + DISCOVERY_TIME
        node = make()
        refuse_twin(node, known)
        if not ends:  # it may have come before rclpy took notice
            spin(node)
    except ExternalShutdownException:
        pass
    except Exception as error:
        if not ends and (not began or isinstance(error, told)):
            name = node.get_name() if node is not None else make.__name__
            print(f"{name}: {error}", file=sys.stderr)
            return 1
        # A signal may end the context in the middle of a callback, whose publish then fails.
        if not ends and rclpy.ok():
            raise
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        if not ends:  # another one may come while Python ends
            signal.signal(signal.SIGINT, previous)
    return 0
