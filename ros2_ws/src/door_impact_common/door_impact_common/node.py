"""How every node of this project starts and ends, and what an exception in it does."""

import gc
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from functools import wraps
from inspect import iscoroutinefunction
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future

from door_impact_common.errors import DoorImpactError

try:  # it takes a third of the processor time
    from rclpy.experimental import EventsExecutor as NodeExecutor
except ImportError:
    from rclpy.executors import SingleThreadedExecutor as NodeExecutor

# Time after which every running node has been discovered [s]: Fast DDS announces itself every 3 s,
# and about half of the nodes miss the first announcements.
DISCOVERY_TIME = 3.5
_POLL = 0.05  # interval between two looks at the graph [s]
_THROTTLE = 5.0  # shortest time between two reports of callbacks that fail again [s]
_TURN = 0.5  # longest time for which `spin` lets the executor run at once [s]


class GuardedNode(Node):
    """A node that no exception in a callback ends.

    An unforeseen exception is a fault of the program. It must not end the graph with a robot in
    motion: the error is logged, with its traceback the first time that this callback fails so,
    and the node goes on. A service answers with the reason; if a callback for parameters fails,
    they stay as they are. rclpy itself guards the execution of an action; what accepts and cancels
    goals can be given to `guarded`.

    Attributes:
        failures: Number of exceptions by callback and type, such as "a timer failed, a fault of
            the program: KeyError".
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        self.failures: Counter[str] = Counter()
        super().__init__(*args, **options)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[..., Any], *args: Any, **options: Any
    ) -> Any:
        """Create a subscription; a message whose callback fails is lost."""
        guarded = self.guarded(callback, f"the subscription of {topic}")

        @wraps(callback)
        def safe(*given: Any) -> Any:
            # EventsExecutor of rclpy 7.1 passes message and info as one tuple.
            return guarded(*given[0]) if isinstance(given[0], tuple) else guarded(*given)

        return super().create_subscription(msg_type, topic, safe, *args, **options)

    def create_timer(
        self, timer_period_sec: float, callback: Callable[..., Any], *args: Any, **options: Any
    ) -> Any:
        """Create a timer; it goes on after a failure."""
        safe = self.guarded(callback, "a timer")
        return super().create_timer(timer_period_sec, safe, *args, **options)

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[..., Any], *args: Any, **options: Any
    ) -> Any:
        """Create a service; after a failure it answers with `success` false and a message.

        Its callback may be a coroutine, which EventsExecutor does not await by itself. The answer
        is sent when it has ended; meanwhile the node handles messages.
        """

        def failed(reason: str) -> Any:
            response = srv_type.Response()
            if hasattr(response, "success") and hasattr(response, "message"):
                response.success, response.message = False, reason
            return response

        safe = self.guarded(callback, f"the service {srv_name}", failed)
        if not iscoroutinefunction(callback):
            return super().create_service(srv_type, srv_name, safe, *args, **options)
        service: Any = super().create_service(
            srv_type, srv_name, lambda *asked: self._executor().create_task(callback, *asked),
            *args, **options)
        send = service.send_response
        service.send_response = lambda task, header: task.add_done_callback(
            lambda done: send(done.result(), header))
        return service

    def _executor(self) -> Executor:
        assert self.executor is not None, "its callbacks run"
        return self.executor

    def add_on_set_parameters_callback(self, callback: Callable[..., Any]) -> None:
        """Add a callback for parameters; after a failure they are refused."""

        def failed(reason: str) -> Any:
            return SetParametersResult(successful=False, reason=reason)

        super().add_on_set_parameters_callback(
            self.guarded(callback, "the check of parameters", failed))

    def guarded(
        self,
        callback: Callable[..., Any],
        what: str,
        failed: Callable[[str], Any] = lambda reason: None,
    ) -> Callable[..., Any]:
        """Return a callback that never raises.

        Args:
            callback: Function to call.
            what: What fails if it raises, for the log.
            failed: Function that makes the result then, from a sentence for users.
        """

        @wraps(callback)
        def safe(*args: Any) -> Any:
            try:
                return callback(*args)
            except Exception as error:
                text = f"{what} failed, a fault of the program: {type(error).__name__}"
                if not self.context.ok():  # a signal has ended the context: publishing fails then
                    return failed(text)
                self.failures[text] += 1
                if self.failures[text] == 1:
                    self.get_logger().error(f"{text}\n{traceback.format_exc()}")
                else:
                    self.get_logger().error(
                        f"{text}; failures until now: {self.failures[text]}",
                        throttle_duration_sec=_THROTTLE)
                return failed(text)

        return safe


class TwinError(DoorImpactError):
    """Another node of the same name is in the graph; `value` is the full name."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"another node named {name} is in the graph: end that node first (a killed node "
            "disappears after about 20 s), rename this node with --ros-args -r __node:=NAME, or "
            "set another ROS_DOMAIN_ID",
            quantity="name of the node",
            value=name,
        )


def refuse_twin(node: Node, until: float) -> None:
    """Wait until another node of the same name would have been discovered.

    Two such nodes would both answer requests and send commands.

    Args:
        node: The node, not yet spinning.
        until: Time at which the wait ends, on the clock of `time.monotonic` [s].

    Raises:
        TwinError: There is another node of this name.
    """
    me = (node.get_name(), node.get_namespace())
    while rclpy.ok():
        if list(node.get_node_names_and_namespaces()).count(me) > 1:
            raise TwinError(node.get_fully_qualified_name())
        left = until - time.monotonic()
        if left <= 0.0:
            return
        time.sleep(min(left, _POLL))


def executor_of(node: Node) -> Executor:
    """Return an executor that runs the callbacks of a node, by `spin_for` alone."""
    executor = NodeExecutor()
    executor.add_node(node)
    return executor


def spin_for(executor: Executor, duration: float) -> None:
    """Run callbacks for a duration [s]; 0 runs what has work now.

    Raises:
        ExternalShutdownException: The context has ended.
    """
    # Without a time limit the EventsExecutor of rclpy 7.1 calls nothing.
    executor.spin_until_future_complete(Future(), timeout_sec=duration)


def spin(node: Node) -> None:
    """Run the callbacks of a node until the context ends.

    Raises:
        ExternalShutdownException: The context has ended.
    """
    with executor_of(node) as executor:
        while rclpy.ok():
            spin_for(executor, _TURN)


def run_node(
    make: Callable[[], Any],
    *,
    errors: tuple[type[Exception], ...] = (),
    args: list[str] | None = None,
    spin: Callable[[Any], None] = spin,
) -> int:
    """Run a node until Ctrl-C or SIGTERM; must be called in the main thread.

    Args:
        make: Function that makes the node.
        errors: Errors besides DoorImpactError that the node may raise because of its parameters;
            they are shown in one line, without a traceback.
        args: Command line; by default that of the process.
        spin: Function that runs the node until it ends.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 if the node cannot run; the error is then on stderr.
    """
    node, began = None, False
    shown: tuple[type[Exception], ...] = (DoorImpactError, ParameterException, *errors)
    ends: list[int] = []  # signals that asked the node to end
    # rclpy's own handler ends spinning. Python's KeyboardInterrupt in addition could interrupt any
    # statement, and twice: once from the terminal and once from the launcher.
    previous = signal.signal(signal.SIGINT, lambda number, _: ends.append(number))
    try:
        rclpy.init(args=args)
        began = True
        known = time.monotonic() + DISCOVERY_TIME
        node = make()
        refuse_twin(node, known)
        if not ends:  # the signal may have come before rclpy installed its handler
            spin(node)
    except ExternalShutdownException:
        pass
    except Exception as error:
        if not ends and (not began or isinstance(error, shown)):
            name = node.get_name() if node is not None else make.__name__
            print(f"{name}: {error}", file=sys.stderr)
            return 1
        # A signal may end the context during a callback, in which publishing then fails.
        if not ends and rclpy.ok():
            raise
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        gc.collect()  # a node that could not be made would stay in the graph
        if not ends:  # otherwise another signal may come while Python ends
            signal.signal(signal.SIGINT, previous)
    return 0
