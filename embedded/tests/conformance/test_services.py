"""Services and their clients."""

import itertools
import threading
import time
from functools import partial
from typing import Any

import pytest
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_services_default
from rclpy.task import Future
from spinning import make, result, spin_until
from std_msgs.msg import String
from std_srvs.srv import Empty, SetBool, Trigger


def flip(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    """Answers with the opposite."""
    response.success = not request.data
    return response


_numbers = itertools.count()


def fresh() -> str:
    """A name that no service of this process has had: ROS 2 may keep them for a while."""
    return f"ask_{next(_numbers)}"


def pair(executor: Any, callback: Any = flip, kind: Any = SetBool, **options: Any) -> Any:
    """A node with a service, and a client that knows it."""
    node, name = make(executor), fresh()
    node.create_service(kind, name, callback, **options)
    client = node.create_client(kind, name)
    assert spin_until(executor, client.service_is_ready)
    return node, client


def test_each_call_gets_its_response(executor: SingleThreadedExecutor) -> None:
    """Of several clients with several calls under way each."""
    node, client = pair(executor)
    clients = [client, node.create_client(SetBool, client.srv_name)]
    assert spin_until(executor, clients[1].service_is_ready)
    asked = [True, False, False, True, False]
    futures = [c.call_async(SetBool.Request(data=data)) for data in asked for c in clients]
    answers = [result(executor, future).success for future in futures]
    assert answers == [not data for data in asked for _ in clients]


def test_requests_and_responses_have_a_type(executor: SingleThreadedExecutor) -> None:
    """Another one is a TypeError: of a call at once, of a service's callback out of spin."""
    _, client = pair(executor, lambda request, _: None if request.data else String())
    for wrong in (None, String(), SetBool.Response(), SetBool, Trigger.Request()):
        with pytest.raises(TypeError):
            client.call_async(wrong)
        with pytest.raises(TypeError):
            client.call(wrong)
    for data in (True, False):
        future = client.call_async(SetBool.Request(data=data))
        with pytest.raises(TypeError):
            spin_until(executor, lambda: False)
        assert not future.done()


def test_an_error_in_a_service_comes_out_of_spin(executor: SingleThreadedExecutor) -> None:
    """The call stays without a response, the next one has one."""

    def moody(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            raise ZeroDivisionError
        return response

    _, client = pair(executor, moody)
    lost = client.call_async(SetBool.Request(data=True))
    with pytest.raises(ZeroDivisionError):
        spin_until(executor, lambda: False)
    assert result(executor, client.call_async(SetBool.Request())) == SetBool.Response()
    assert not lost.done()


def test_a_service_may_be_a_coroutine(executor: SingleThreadedExecutor) -> None:
    """It responds when it is done; in a reentrant group others are served meanwhile."""
    gate = Future()

    async def later(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            await gate
        response.message = "late" if request.data else "soon"
        return response

    _, client = pair(executor, later, callback_group=ReentrantCallbackGroup())
    late = client.call_async(SetBool.Request(data=True))
    soon = client.call_async(SetBool.Request())
    assert result(executor, soon).message == "soon"
    assert not late.done()
    gate.set_result(None)
    executor.wake()
    assert result(executor, late).message == "late"


def test_names_are_full(executor: SingleThreadedExecutor) -> None:
    """service_name is, srv_name is what was given; the type is there too."""
    node = Node("tester", namespace="/space")
    for name, full in (("ask", "/space/ask"), ("~/ask", "/space/tester/ask"), ("/ask", "/ask")):
        service = node.create_service(SetBool, name, flip)
        client = node.create_client(SetBool, name)
        assert service.service_name == client.service_name == full
        assert service.srv_name == client.srv_name == name
        assert service.srv_type is client.srv_type is SetBool
        assert service in list(node.services)
        assert client in list(node.clients)


def test_readiness_is_found_out(executor: SingleThreadedExecutor) -> None:
    """Without a server there is none, whatever the time; with one there is, until it goes."""
    node, name = make(executor), fresh()
    client = node.create_client(SetBool, name)
    assert not client.service_is_ready()
    for limit in (0.0, -1.0, 0.01):
        assert not client.wait_for_service(limit)
        assert not client.wait_for_service(timeout_sec=limit)
    service = node.create_service(SetBool, name, flip)
    assert client.wait_for_service(20.0)
    assert client.wait_for_service()
    assert client.service_is_ready()
    assert node.destroy_service(service)
    assert spin_until(executor, lambda: not client.service_is_ready())


def test_a_call_waits_while_another_thread_spins(executor: SingleThreadedExecutor) -> None:
    """It returns the response."""
    _, client = pair(executor)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    assert client.call(SetBool.Request(data=False)).success
    assert not client.call(SetBool.Request(data=True), timeout_sec=20.0).success
    executor.shutdown()
    thread.join(20.0)


def test_a_call_gives_up_after_its_time(executor: SingleThreadedExecutor) -> None:
    """It returns None; a response that comes later disturbs nobody."""
    _, client = pair(executor)
    assert client.call(SetBool.Request(), timeout_sec=0.02) is None
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert result(executor, client.call_async(SetBool.Request())).success


def test_a_pending_request_can_be_forgotten(executor: SingleThreadedExecutor) -> None:
    """Its future is never done; forgetting it twice, or after the end, does nothing."""
    _, client = pair(executor)
    forgotten, kept = (client.call_async(SetBool.Request()) for _ in range(2))
    client.remove_pending_request(forgotten)
    client.remove_pending_request(forgotten)
    assert result(executor, kept).success
    for _ in range(3):
        executor.spin_once(timeout_sec=0.01)
    assert not forgotten.done()
    client.remove_pending_request(kept)
    with pytest.raises(KeyError):
        client.get_pending_request(1 << 40)


def test_a_server_keeps_the_last_requests_of_its_depth(executor: SingleThreadedExecutor) -> None:
    """Of twice as many that came while it was busy, it answers those in their order."""
    _, client = pair(executor, qos_profile=QoSProfile(depth=5))
    calls = [client.call_async(SetBool.Request()) for _ in range(10)]
    for call in calls[5:]:
        result(executor, call)
    assert [call.done() for call in calls] == [False] * 5 + [True] * 5


def test_two_servers_answer_both(executor: SingleThreadedExecutor) -> None:
    """The client takes one of the responses, and is ready for the next call."""
    node, client = pair(executor, lambda _, r: r, Trigger)
    asked: list[str] = []

    def second(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        asked.append("second")
        return response

    node.create_service(Trigger, client.srv_name, second)
    assert spin_until(executor, lambda: node.count_services(client.srv_name) == 2)
    for _ in range(50):
        result(executor, client.call_async(Trigger.Request()))
        if asked:
            break
    assert asked


def test_a_message_may_be_empty(executor: SingleThreadedExecutor) -> None:
    """A service without fields."""
    _, client = pair(executor, lambda _, response: response, Empty)
    assert result(executor, client.call_async(Empty.Request())) == Empty.Response()


def test_quality_of_service_can_be_chosen(executor: SingleThreadedExecutor) -> None:
    """It is what was given, by default that of services."""
    node, chosen = Node("tester"), QoSProfile(depth=3)
    assert node.create_client(SetBool, "a").qos_profile == qos_profile_services_default
    assert node.create_service(SetBool, "b", flip).qos_profile == qos_profile_services_default
    assert node.create_client(SetBool, "c", qos_profile=chosen).qos_profile == chosen
    assert node.create_service(SetBool, "d", flip, qos_profile=chosen).qos_profile == chosen


def test_destroyed_things_cannot_be_used(executor: SingleThreadedExecutor) -> None:
    """Of a service and a client the node knows once that they were its own."""
    node, client = pair(executor)
    (service,) = (s for s in node.services if s.srv_name == client.srv_name)
    for destroy, thing in ((node.destroy_client, client), (node.destroy_service, service)):
        assert destroy(thing)
        assert not destroy(thing)
        thing.destroy()
        with pytest.raises(InvalidHandle):
            thing.service_name
    for use in (client.service_is_ready, client.wait_for_service,
                partial(client.call_async, SetBool.Request())):  # fmt: skip
        with pytest.raises(InvalidHandle):
            use()


def test_a_client_may_be_destroyed_while_it_calls(executor: SingleThreadedExecutor) -> None:
    """The response finds nobody."""
    node, client = pair(executor)
    future = client.call_async(SetBool.Request())
    assert node.destroy_client(client)
    for _ in range(5):
        executor.spin_once(timeout_sec=0.01)
    assert not future.done()


def test_a_service_that_ends_itself_cannot_respond(executor: SingleThreadedExecutor) -> None:
    """The error comes out of spin."""
    node, name = make(executor), fresh()

    def once(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        node.destroy_service(service)
        return response

    service = node.create_service(Trigger, name, once)
    client = node.create_client(Trigger, name)
    assert spin_until(executor, client.service_is_ready)
    client.call_async(Trigger.Request())
    with pytest.raises(InvalidHandle):
        spin_until(executor, lambda: False)


def test_calls_run_in_parallel_in_a_pool(executor: SingleThreadedExecutor) -> None:
    """A reentrant service serves a second call while the first waits for it."""
    pool, met = MultiThreadedExecutor(3), threading.Barrier(2)

    def meet(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        met.wait(20.0)
        return response

    _, client = pair(pool, meet, Trigger, callback_group=ReentrantCallbackGroup())
    futures = [client.call_async(Trigger.Request()) for _ in range(2)]
    assert spin_until(pool, lambda: all(future.done() for future in futures))
    pool.shutdown()


def test_waiting_for_a_service_ends_with_the_context(executor: SingleThreadedExecutor) -> None:
    """It does not wait for ever after a shutdown."""
    client, outcomes = Node("tester").create_client(SetBool, "nobody"), []

    def wait() -> None:
        try:
            outcomes.append(client.wait_for_service())
        except RuntimeError:  # of ROS 2: the context is not valid any more
            outcomes.append(False)

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    time.sleep(0.03)
    rclpy.shutdown()
    thread.join(20.0)
    assert outcomes == [False]
