"""The end: shutdown, signals, the order of destruction, several contexts."""

import signal
import subprocess
from collections.abc import Callable

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions, uninstall_signal_handlers
from spinning import ended, make, spin_until
from std_msgs.msg import String
from std_srvs.srv import Trigger

START = """
import gc, os, signal, sys, threading, time
import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

def tell(word):
    print(word, flush=True)
"""
"""What every program below begins with."""

FORK = f"""{START}
case = None
for case in CASES:
    if not os.fork():
        break
    pid, status = os.wait() if ONE_BY_ONE else (0, 0)
    if ONE_BY_ONE and status:
        print(case, "ended with", status)
else:
    while not ONE_BY_ONE:
        try:
            pid, status = os.wait()
        except ChildProcessError:
            break
        except KeyboardInterrupt:
            continue
        if status:
            print("a child ended with", status)
    sys.exit()
"""
"""Runs what follows once for each case, in processes that need not import all that again."""

SPINS = {
    "rclpy.spin": "rclpy.spin(node)",
    "rclpy.spin_once": "while rclpy.ok(): rclpy.spin_once(node)",
    "rclpy.spin_until": "rclpy.spin_until_future_complete(node, Future())",
    "single": "e = SingleThreadedExecutor(); e.add_node(node); e.spin()",
    "single_until": "e = SingleThreadedExecutor(); e.add_node(node)\n"
    "e.spin_until_future_complete(Future())",
    "multi": "e = MultiThreadedExecutor(2); e.add_node(node); e.spin()",
}
"""Ways to spin."""

Start = Callable[..., "subprocess.Popen[str]"]


def forked(cases: dict[str, str], program: str, *, one_by_one: bool) -> str:
    """A program that runs for each case, with the case's own text in CASES[case]."""
    return f"CASES = {cases!r}\nONE_BY_ONE = {one_by_one}\n{FORK}\n{program}"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_spinning(start: Start, number: signal.Signals) -> None:
    """SIGINT by KeyboardInterrupt; SIGTERM by ExternalShutdownException, a pool just returns."""
    program = f"""
rclpy.init()
node = Node("tester_" + str(os.getpid()))
main, over = threading.get_ident(), threading.Event()

def send():
    # ROS 2's executor may look just before the context ends, and miss a SIGTERM.
    while not over.wait(0.05):
        signal.pthread_kill(main, {int(number)})
        if {int(number)} == signal.SIGINT:
            break

thread = threading.Thread(target=send)
node.create_guard_condition(thread.start).trigger()
word = "returned"
try:
    exec(compile(CASES[case], case, "exec"))
except (KeyboardInterrupt, ExternalShutdownException) as error:
    word = type(error).__name__
over.set()
thread.join()
tell(f"{{case}}: {{word}}")
node.destroy_node()
rclpy.try_shutdown()
"""
    code, out = ended(start("-c", forked(SPINS, program, one_by_one=True)))
    word = "KeyboardInterrupt" if number == signal.SIGINT else "ExternalShutdownException"
    expected = {f"{spin}: {word}" for spin in SPINS}
    if number == signal.SIGTERM:
        expected = (expected - {f"multi: {word}"}) | {"multi: returned"}
    assert (code, set(out.splitlines())) == (0, expected)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_lets_a_callback_end(start: Start, number: signal.Signals) -> None:
    """SIGTERM leaves a callback that runs alone, SIGINT interrupts it."""
    program = f"""{START}
rclpy.init()
node = Node("tester_" + str(os.getpid()))
def work():
    try:
        tell("ready")
        for _ in range(1000):
            time.sleep(0.002)
            if not rclpy.ok():
                tell("ended")
                return
    except KeyboardInterrupt:
        tell("interrupted")
        raise

node.create_guard_condition(work).trigger()
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    time.sleep(0.2)  # ROS 2's thread for signals may be about to use what a shutdown destroys
rclpy.try_shutdown()
"""
    process = start("-c", program)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(number)
    code, out = ended(process)
    assert out in ({"interrupted\n", "ended\n"} if number == signal.SIGINT else {"ended\n"})
    assert code == 0


def test_without_handlers_signals_are_pythons(start: Start) -> None:
    """SignalHandlerOptions.NO: Ctrl-C interrupts, the context lives on; SIGTERM kills."""
    program = f"""{START}
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
try:
    signal.raise_signal(signal.SIGINT)
    time.sleep(20.0)
except KeyboardInterrupt:
    tell(rclpy.ok())
signal.raise_signal(signal.SIGTERM)
time.sleep(20.0)
"""
    assert ended(start("-c", program)) == (-signal.SIGTERM, "True\n")


ENDS = {
    "nothing": "",
    "shutdown": "rclpy.shutdown()",
    "node, shutdown": "node.destroy_node(); rclpy.shutdown()",
    "shutdown, node": "rclpy.shutdown(); node.destroy_node()",
    "parts, node, shutdown": "node.destroy_publisher(pub); node.destroy_subscription(sub)\n"
    "node.destroy_timer(timer); node.destroy_node(); rclpy.shutdown()",
    "node, parts": "node.destroy_node(); pub.destroy(); sub.destroy(); timer.destroy()\n"
    "node.destroy_publisher(pub); node.destroy_timer(timer)",
    "shutdown, parts": "rclpy.shutdown(); node.destroy_publisher(pub); node.destroy_timer(timer)",
    "names go first": "del pub, sub, timer, node; gc.collect(); rclpy.shutdown()",
    "exit": "sys.exit(0)",
    "in a thread": "t = threading.Thread(target=rclpy.shutdown); t.start(); t.join()",
    "executor last": "rclpy.shutdown(); e.shutdown()",
}
"""Ways to end."""


def test_a_process_may_end_in_any_order(start: Start) -> None:
    """It ends well, and says nothing."""
    program = """
rclpy.init()
node = Node("tester_" + str(os.getpid()))
pub = node.create_publisher(String, "x", 10)
sub = node.create_subscription(String, "x", lambda _: None, 10)
timer = node.create_timer(0.001, lambda: pub.publish(String()))
e = SingleThreadedExecutor()
e.add_node(node)
for _ in range(20):
    e.spin_once(timeout_sec=0.01)
e.remove_node(node)
exec(compile(CASES[case], case, "exec"))
"""
    assert ended(start("-c", forked(ENDS, program, one_by_one=False))) == (0, "")


def test_what_is_done_in_a_callback_ends_there(executor: SingleThreadedExecutor) -> None:
    """A node may be destroyed by its own callback; others go on."""
    node, other, calls = make(executor), make(executor, "other"), []

    def end() -> None:
        calls.append("end")
        node.destroy_node()

    node.create_guard_condition(end).trigger()
    node.create_timer(0.0, lambda: calls.append("node"))
    assert spin_until(executor, lambda: "end" in calls)
    calls.clear()
    other.create_timer(0.001, lambda: calls.append("other"))
    assert spin_until(executor, lambda: len(calls) > 2)
    assert set(calls) == {"other"}


def test_the_shutdown_calls_no_method_of_a_node() -> None:
    """A destroy_node of the program's own is called by the program only."""
    calls: list[int] = []

    class Mine(Node):
        def destroy_node(self) -> None:
            calls.append(1)
            super().destroy_node()

    rclpy.init(args=[])
    node = Mine("tester")
    rclpy.shutdown()
    assert calls == []
    node.destroy_node()
    assert calls == [1]


def test_the_response_to_a_last_request_arrives(start: Start) -> None:
    """A service whose callback calls rclpy.shutdown() still answers."""
    program = f"""{START}
rclpy.init()
node = Node("stopped_" + str(os.getpid()))

def stop(request, response):
    rclpy.shutdown()
    response.success = True
    return response

node.create_service(Trigger, "stop", stop)
node.create_guard_condition(lambda: tell("ready")).trigger()
rclpy.spin(node)
time.sleep(0.2)
"""
    process = start("-c", program)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    rclpy.init(args=[])
    try:
        executor = SingleThreadedExecutor()
        client = make(executor).create_client(Trigger, "stop")
        assert client.wait_for_service(20.0)
        future = client.call_async(Trigger.Request())
        executor.spin_until_future_complete(future, timeout_sec=20.0)
        assert future.done()
        assert future.result().success
    finally:
        rclpy.try_shutdown()
    assert ended(process) == (0, "")


def test_callbacks_hear_of_the_shutdown() -> None:
    """Each once, when the context is not ok any more; too late is at once."""
    context, heard = Context(), []
    rclpy.init(args=[], context=context)
    context.on_shutdown(lambda: heard.append("first"))
    context.on_shutdown(lambda: heard.append("second"))
    with pytest.raises(TypeError):
        context.on_shutdown("no function")
    assert heard == []
    rclpy.shutdown(context=context)
    assert heard == ["first", "second"]
    rclpy.try_shutdown(context=context)
    assert len(heard) == 2
    context.on_shutdown(lambda: heard.append("late"))
    assert heard[-1] == "late"


def test_contexts_are_apart() -> None:
    """Two in one process: each with its domain, its nodes and its end; also of one domain."""
    contexts = [Context() for _ in range(3)]
    for context, domain in zip(contexts, (101, 102, 101), strict=True):
        rclpy.init(args=[], context=context, domain_id=domain)
    assert [context.get_domain_id() for context in contexts] == [101, 102, 101]
    executors = [SingleThreadedExecutor(context=context) for context in contexts]
    nodes = [Node(f"node_{i}", context=context) for i, context in enumerate(contexts)]
    got: list[int] = []
    for i, (executor, node) in enumerate(zip(executors, nodes, strict=True)):
        executor.add_node(node)
        node.create_subscription(String, "x", lambda _, i=i: got.append(i), 10)
    publisher = nodes[0].create_publisher(String, "x", 10)
    assert spin_until(executors[0], lambda: publisher.get_subscription_count() == 2)
    publisher.publish(String())
    assert spin_until(executors[0], lambda: 0 in got)
    assert spin_until(executors[2], lambda: 2 in got)
    contexts[0].shutdown()
    assert [context.ok() for context in contexts] == [False, True, True]
    more = nodes[2].create_publisher(String, "x", 10)
    assert spin_until(executors[2], more.get_subscription_count)
    more.publish(String())
    assert spin_until(executors[2], lambda: got.count(2) == 2)
    executors[1].spin_once(timeout_sec=0.01)
    assert 1 not in got
    for context in contexts[1:]:
        context.shutdown()


def test_the_handlers_of_signals_can_be_chosen() -> None:
    """The options are four; what was there before comes back with the shutdown."""
    uninstall_signal_handlers()  # of a context that an earlier test has not shut down
    before = signal.getsignal(signal.SIGINT)
    for option in ("NO", "SIGINT", "SIGTERM", "ALL"):
        rclpy.init(args=[], signal_handler_options=getattr(SignalHandlerOptions, option))
        rclpy.shutdown()
        assert signal.getsignal(signal.SIGINT) is before
