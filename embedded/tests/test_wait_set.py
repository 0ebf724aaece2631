"""Waiting in Cyclone DDS: who else may do something meanwhile, and signals."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from rclpy.executors import SingleThreadedExecutor
from ros2_embedded.samples import samples_of
from ros2_embedded.wait_set import WaitSet
from spinning import make, spin_until
from std_msgs.msg import String

SOON = 20.0


@pytest.fixture
def wait_set(executor: SingleThreadedExecutor) -> WaitSet:
    """A wait set without sources."""
    return executor.context.new_wait_set()


@pytest.fixture
def waiting(wait_set: WaitSet) -> Iterator[Callable[[], int]]:
    """Has a thread wait again and again; gives the number of its waits that have ended."""
    ends: list[None] = []
    over = threading.Event()

    def wait_on() -> None:
        while not over.is_set():
            wait_set.wait(SOON, over.is_set)
            ends.append(None)

    thread = threading.Thread(target=wait_on)
    thread.start()
    yield lambda: len(ends)
    over.set()
    wait_set.wake()
    thread.join(SOON)
    assert not thread.is_alive()


def until(done: Callable[[], object]) -> bool:
    """Waits for something that another thread does."""
    deadline = time.monotonic() + SOON
    while not done() and time.monotonic() < deadline:
        time.sleep(0.001)
    return bool(done())


def test_each_wake_ends_a_wait(wait_set: WaitSet, waiting: Callable[[], int]) -> None:
    """None is lost, at whichever point the other thread is."""
    for _ in range(1000):
        before = waiting()
        wait_set.wake()
        while waiting() == before:
            wait_set.wake()
    assert waiting() >= 1000


def test_a_wait_ends_when_the_wait_set_is_closed(wait_set: WaitSet) -> None:
    """Later waits return at once, without an error."""
    thread = threading.Thread(target=wait_set.wait, args=(float("inf"),))
    thread.start()
    time.sleep(0.05)
    wait_set.close()
    thread.join(SOON)
    assert not thread.is_alive()
    wait_set.wait(float("inf"))


def test_sources_come_and_go_while_a_thread_waits(
    executor: SingleThreadedExecutor, wait_set: WaitSet, waiting: Callable[[], int]
) -> None:
    """What is there counts when a source is added; after `remove` nothing is handed over."""
    node = make(executor)
    publisher = node.create_publisher(String, "x", 100)
    subscription = node.create_subscription(String, "x", print, 100)
    executor.remove_node(node)  # its executor must not take what is published
    assert spin_until(executor, publisher.get_subscription_count)
    got: list[bytes] = []
    source = samples_of(subscription._reader, lambda s: got.extend(data for data, _ in s))
    for count in range(1, 51):
        publisher.publish(String(data="x"))
        wait_set.add(source)
        assert until(lambda count=count: len(got) == count)
        wait_set.remove(source[0])
    publisher.publish(String(data="x"))
    time.sleep(0.05)
    assert len(got) == 50


def test_an_error_of_a_source_comes_out_of_the_wait(
    executor: SingleThreadedExecutor, wait_set: WaitSet
) -> None:
    """The others have their turn, then or later."""
    node = make(executor)
    publisher = node.create_publisher(String, "x", 1)
    readers = [node.create_subscription(String, "x", print, 1)._reader for _ in range(2)]
    executor.remove_node(node)
    assert spin_until(executor, lambda: publisher.get_subscription_count() == 2)
    got: list[object] = []

    def fail(_: object) -> None:
        raise ZeroDivisionError

    wait_set.add(samples_of(readers[0], fail))
    wait_set.add(samples_of(readers[1], got.append))
    publisher.publish(String())
    errors = 0
    deadline = time.monotonic() + SOON
    while not (got and errors) and time.monotonic() < deadline:
        try:
            wait_set.wait(0.1)
        except ZeroDivisionError:
            errors += 1
    assert (len(got), errors) == (1, 1)


@pytest.fixture
def handled() -> Iterator[list[int]]:
    """The SIGUSR1 that Python has handled."""
    numbers: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, _: numbers.append(number))
    yield numbers
    signal.signal(signal.SIGUSR1, before)


def test_a_signal_ends_a_wait_of_the_main_thread(wait_set: WaitSet, handled: list[int]) -> None:
    """Python handles it then, not at the end of the time; whatever was between two waits."""
    other = WaitSet()
    between = [lambda: None, lambda: signal.set_wakeup_fd(-1), lambda: other.wait(0.001)]
    for count in range(1, 31):
        between[count % 3]()
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGUSR1)).start()
        began = time.monotonic()
        while len(handled) < count:
            wait_set.wait(SOON, lambda count=count: len(handled) == count)
        assert time.monotonic() - began < SOON
    other.close()


def test_others_that_listen_for_signals_hear_of_them(wait_set: WaitSet, handled: list[int]) -> None:
    """As asyncio's event loop: its descriptor is in force again after a wait."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing)
    try:
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGUSR1)).start()
        while not handled:
            wait_set.wait(SOON, handled.__len__)
        assert os.read(reading, 10) == bytes([signal.SIGUSR1])
    finally:
        assert signal.set_wakeup_fd(before) == writing
        os.close(reading)
        os.close(writing)
