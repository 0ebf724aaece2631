"""Peers that stop, are killed and come again: nobody else waits, and nothing is lost."""

import signal
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.executors import SingleThreadedExecutor
from spinning import make, result, spin_until
from std_msgs.msg import String
from std_srvs.srv import SetBool

COLLECTOR = str(Path(__file__).parent / "collector_node.py")
DEPTH = 50
LEASE = 10.0  # after which a participant that is silent is forgotten (RTPS 2.5, 8.5.3.2.1) [s]


class Collector:
    """The process of `collector_node.py`, and what it has printed."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process
        self.lines: list[str] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.strip())

    @property
    def numbers(self) -> list[int]:
        """What it has heard."""
        return [int(line) for line in self.lines if line.isdecimal()]

    @property
    def last(self) -> int:
        """What it has heard last, at first -1."""
        return int(self.lines[-1]) if self.lines and self.lines[-1].isdecimal() else -1


@pytest.fixture
def collect(start: Callable[..., "subprocess.Popen[str]"]) -> Callable[[str], Collector]:
    """Starts a collector; one that is stopped is ended too."""
    return lambda name: Collector(start(COLLECTOR, name, str(DEPTH)))


def publish_to(
    executor: Any, publish: Callable[[int], None], numbers: range, hearer: Collector
) -> None:
    """Publishes numbers no faster than a hearer, whose queue is limited, hears them."""
    for number in numbers:
        assert spin_until(executor, lambda number=number: number - hearer.last < DEPTH // 2)
        publish(number)
    assert spin_until(executor, lambda: hearer.last == numbers[-1])


def publisher_to(executor: Any, count: int) -> Callable[[int], None]:
    """What publishes a number, to so many subscriptions that are there."""
    node = make(executor, "counter")
    publisher = node.create_publisher(String, "counted", DEPTH)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == count)
    return lambda number: publisher.publish(String(data=str(number)))


def test_stopped_subscription_gets_what_the_depth_holds_and_delays_nobody(
    executor: SingleThreadedExecutor, collect: Callable[[str], Collector]
) -> None:
    """All messages up to the depth, then the last of more, in order; another hears all at once."""
    stopped, other = collect("stopped"), collect("other")
    publish = publisher_to(executor, 2)
    stopped.process.send_signal(signal.SIGSTOP)
    publish_to(executor, publish, range(DEPTH), other)
    assert stopped.numbers == []
    stopped.process.send_signal(signal.SIGCONT)
    assert spin_until(executor, lambda: stopped.numbers == list(range(DEPTH)))
    stopped.process.send_signal(signal.SIGSTOP)
    last = 10 * DEPTH
    publish_to(executor, publish, range(DEPTH, last), other)
    assert other.numbers == list(range(last))
    stopped.process.send_signal(signal.SIGCONT)
    assert spin_until(executor, lambda: stopped.numbers[-1] == last - 1)
    assert stopped.numbers[-DEPTH:] == list(range(last - DEPTH, last))
    assert stopped.numbers == sorted(set(stopped.numbers))


def test_killed_subscription_delays_nobody_and_its_successor_is_heard(
    executor: SingleThreadedExecutor, collect: Callable[[str], Collector]
) -> None:
    """The other one hears all, and one of the same name that comes is served at once."""
    killed, other = collect("killed"), collect("other")
    publish = publisher_to(executor, 2)
    publish(0)
    assert spin_until(executor, lambda: killed.numbers == [0])
    killed.process.kill()
    publish_to(executor, publish, range(1, 10 * DEPTH), other)
    assert other.numbers == list(range(10 * DEPTH))
    successor = collect("killed")
    numbers = iter(range(10 * DEPTH, 100 * DEPTH))

    def heard() -> bool:
        publish(next(numbers))
        return bool(successor.numbers)

    assert spin_until(executor, heard)


def test_killed_server_is_replaced_by_a_new_one(
    executor: SingleThreadedExecutor, collect: Callable[[str], Collector]
) -> None:
    """Calls that nobody answered can be given up; a client needs no restart."""
    node = make(executor)
    client = node.create_client(SetBool, "server/flip")
    for _ in range(2):
        server = collect("server")
        assert spin_until(executor, lambda server=server: "ready" in server.lines)
        assert client.wait_for_service(20.0)

        def answered() -> bool:
            future = client.call_async(SetBool.Request(data=False))
            executor.spin_until_future_complete(future, timeout_sec=0.5)
            client.remove_pending_request(future)
            return future.done() and future.result().success

        assert spin_until(executor, answered)
        server.process.kill()


def test_peer_that_was_silent_longer_than_its_lease_is_found_again(
    executor: SingleThreadedExecutor, collect: Callable[[str], Collector]
) -> None:
    """It is forgotten meanwhile, and hears and answers again when it goes on."""
    sleeper = collect("sleeper")
    publish = publisher_to(executor, 1)
    node = make(executor, "caller")
    client = node.create_client(SetBool, "sleeper/flip")
    assert client.wait_for_service(20.0)
    sleeper.process.send_signal(signal.SIGSTOP)
    future = client.call_async(SetBool.Request(data=False))
    assert spin_until(executor, lambda: not node.count_subscribers("counted"), 3.0 * LEASE)
    assert not client.service_is_ready()
    assert not future.done()
    sleeper.process.send_signal(signal.SIGCONT)
    assert spin_until(executor, lambda: node.count_subscribers("counted"))
    numbers = iter(range(100 * DEPTH))

    def heard() -> bool:
        publish(next(numbers))
        return bool(sleeper.numbers)

    assert spin_until(executor, heard)
    assert client.wait_for_service(20.0)
    assert result(executor, client.call_async(SetBool.Request(data=False))).success
