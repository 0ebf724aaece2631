"""Futures and tasks: results, errors, cancelling, callbacks, awaiting."""

import asyncio
import gc
import threading
from typing import Any

import pytest
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.task import Future, Task
from spinning import make, result, spin_until
from std_srvs.srv import Trigger


def test_a_future_has_a_result_or_an_error() -> None:
    """Before there is none it gives None; an error is raised each time."""
    future = Future()
    assert (future.done(), future.cancelled()) == (False, False)
    assert future.result() is None
    assert future.exception() is None
    future.set_result(5)
    assert (future.done(), future.cancelled()) == (True, False)
    assert future.result() == 5
    failed = Future()
    failed.set_exception(ZeroDivisionError("x"))
    assert failed.done()
    assert isinstance(failed.exception(), ZeroDivisionError)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            failed.result()


def test_a_later_result_replaces_an_earlier_one() -> None:
    """Setting it again is no error."""
    future = Future()
    future.set_result(1)
    future.set_result(2)
    assert future.result() == 2


def test_cancelling_is_told_and_ends_with_a_result() -> None:
    """Done callbacks hear of it; what is done cannot be cancelled."""
    future, heard = Future(), []
    future.add_done_callback(heard.append)
    future.cancel()
    assert future.cancelled()
    assert heard == [future]
    assert future.result() is None
    future.set_result(1)
    assert (future.cancelled(), future.result()) == (False, 1)
    future.cancel()
    assert not future.cancelled()


def test_callbacks_of_a_future_without_an_executor_come_at_once() -> None:
    """In their order, in the thread that sets the result; a late one in its own."""
    future, heard = Future(), []
    for name in "ab":
        future.add_done_callback(
            lambda f, name=name: heard.append((name, f.result(), threading.current_thread()))
        )
    thread = threading.Thread(target=lambda: future.set_result(1))
    thread.start()
    thread.join()
    assert heard == [("a", 1, thread), ("b", 1, thread)]
    future.add_done_callback(lambda f: heard.append(threading.current_thread()))
    assert heard[-1] is threading.current_thread()
    future.set_result(2)
    assert len(heard) == 3


def test_an_error_in_a_callback_is_a_warning() -> None:
    """The other callbacks are called all the same."""
    future, heard = Future(), []

    def fail(_: Future) -> None:
        raise ZeroDivisionError("bad")

    future.add_done_callback(fail)
    future.add_done_callback(heard.append)
    with pytest.warns(UserWarning, match="Unhandled exception in done callback: bad"):
        future.set_result(1)
    assert heard == [future]
    with pytest.raises(ZeroDivisionError):
        future.add_done_callback(fail)


def test_callbacks_of_an_executors_future_are_its_tasks(executor: SingleThreadedExecutor) -> None:
    """They wait for it to spin, and their errors come out of it."""
    future, heard = Future(executor=executor), []
    future.add_done_callback(heard.append)
    future.set_result(1)
    assert heard == []
    assert spin_until(executor, lambda: heard == [future])
    future.add_done_callback(heard.append)
    assert len(heard) == 1
    assert spin_until(executor, lambda: len(heard) == 2)

    def fail(_: Future) -> None:
        raise ZeroDivisionError

    future.add_done_callback(fail)
    with pytest.raises(ZeroDivisionError):
        spin_until(executor, lambda: False)


def test_callbacks_of_a_call_are_tasks_too(executor: SingleThreadedExecutor) -> None:
    """When a response completes a call, its callbacks are called by the executor, later."""
    node, heard = make(executor), []
    node.create_service(Trigger, "ask", lambda _, response: response)
    client = node.create_client(Trigger, "ask")
    assert spin_until(executor, client.service_is_ready)
    future = client.call_async(Trigger.Request())
    future.add_done_callback(lambda _: heard.append(threading.current_thread()))
    result(executor, future)
    assert spin_until(executor, lambda: heard)
    assert heard == [threading.current_thread()]


def test_an_error_that_nobody_fetches_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """On stderr, when the future goes; not if it was asked for."""
    for fetch in (False, True):
        future = Future()
        future.set_exception(ZeroDivisionError(f"fetched {fetch}"))
        if fetch:
            future.exception()
        del future
        gc.collect()
    told = capfd.readouterr().err
    assert "The following exception was never retrieved: fetched False" in told
    assert "fetched True" not in told


def test_awaiting_gives_the_result_or_the_error(executor: SingleThreadedExecutor) -> None:
    """A coroutine waits for futures, done or not, for tasks, and for other coroutines."""
    done, later, failing = Future(), Future(), Future()
    done.set_result(1)

    async def inner() -> int:
        return await later

    async def outer() -> list[Any]:
        values = [await done, await inner(), await executor.create_task(lambda: 3)]
        try:
            await failing
        except KeyError as error:
            values.append(error.args[0])
        return values

    task = executor.create_task(outer)
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert not task.done()
    later.set_result(2)
    failing.set_exception(KeyError(4))
    assert result(executor, task) == [1, 2, 3, 4]


def test_a_result_of_another_thread_is_awaited(executor: SingleThreadedExecutor) -> None:
    """The thread that sets it wakes the executor, which has nothing else to do."""
    gate = Future()

    async def wait() -> int:
        return await gate

    def give() -> None:
        gate.set_result(5)
        executor.wake()

    task = executor.create_task(wait)
    threading.Timer(0.03, give).start()
    assert result(executor, task) == 5


def test_asyncio_awaits_futures(executor: SingleThreadedExecutor) -> None:
    """A coroutine of asyncio gets a result or an error that another thread sets."""
    done, later, failing = Future(), Future(), Future()
    done.set_result(1)

    async def main() -> list[Any]:
        threading.Timer(0.03, lambda: later.set_result(2)).start()
        threading.Timer(0.05, lambda: failing.set_exception(KeyError(3))).start()
        with pytest.raises(KeyError):
            await failing
        return [await done, *await asyncio.gather(wait(later), wait(later))]

    async def wait(future: Future) -> Any:
        return await future

    assert asyncio.run(main()) == [1, 2, 2]


def test_asyncio_may_give_up_waiting() -> None:
    """After a timeout of asyncio the future goes on, and can be awaited again."""
    future = Future()

    async def wait() -> Any:
        return await future

    async def main() -> Any:
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(wait(), 0.02)
        assert not future.cancelled()
        asyncio.get_running_loop().call_later(0.02, future.set_result, 5)
        return await wait()

    assert asyncio.run(main()) == 5


def test_an_executor_spins_within_asyncio(executor: SingleThreadedExecutor) -> None:
    """Coroutines of the executor and of asyncio await each other's futures."""
    node, later = make(executor), Future()
    node.create_service(Trigger, "ask", lambda _, response: response)
    client = node.create_client(Trigger, "ask")
    assert spin_until(executor, client.service_is_ready)

    async def relay() -> int:
        await client.call_async(Trigger.Request())
        later.set_result(7)
        return 8

    async def spin() -> None:
        while not later.done():
            executor.spin_once(timeout_sec=0.01)
            await asyncio.sleep(0)

    async def main() -> list[Any]:
        task = executor.create_task(relay)
        spinning = asyncio.create_task(spin())
        values = [await later, await task]
        await spinning
        return values

    assert asyncio.run(asyncio.wait_for(main(), 20.0)) == [7, 8]


def test_many_may_await_one_future(executor: SingleThreadedExecutor) -> None:
    """All get the result, also in a pool of threads."""
    pool, gate = MultiThreadedExecutor(3), Future()

    async def wait(number: int) -> int:
        return number + await gate

    tasks = [pool.create_task(wait, number) for number in range(20)]
    threading.Timer(0.01, lambda: gate.set_result(100)).start()
    assert spin_until(pool, lambda: all(task.done() for task in tasks))
    assert [task.result() for task in tasks] == list(range(100, 120))
    pool.shutdown()


def test_a_task_knows_whether_it_runs(executor: SingleThreadedExecutor) -> None:
    """Not before, not after, not while it waits; calling it again when done does nothing."""
    states, gate = [], Future()

    async def work() -> int:
        states.append(task.executing())
        await gate
        states.append(task.executing())
        return 1

    task = executor.create_task(work)
    assert isinstance(task, Task)
    assert not task.executing()
    assert spin_until(executor, lambda: states)
    assert not task.executing()
    gate.set_result(None)
    assert result(executor, task) == 1
    assert states == [True, True]
    assert not task.executing()
    task()
    assert task.result() == 1


def test_a_task_runs_without_an_executor() -> None:
    """Calling it is a step."""
    task = Task(lambda a, b: a + b, (1,), {"b": 2})
    assert not task.done()
    task()
    assert task.result() == 3


def test_the_callback_of_a_task_gets_the_task(executor: SingleThreadedExecutor) -> None:
    """The executor calls it, after the task."""
    order: list[Any] = []
    task = executor.create_task(lambda: order.append("task"))
    task.add_done_callback(order.append)
    assert spin_until(executor, lambda: len(order) == 2)
    assert order == ["task", task]
