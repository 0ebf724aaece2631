"""Tests of the web server: ports, addresses, and which pages may connect."""

import socket
from collections.abc import Iterator

import pytest
import websockets.exceptions
from door_impact_view.errors import AddressError
from door_impact_view.live.orders import Answer, Push
from door_impact_view.live.page import Page
from door_impact_view.live.page_client import PageClient
from door_impact_view.live.server import Listening, listen, same_page

NAMES = frozenset({"localhost", "robot"})


@pytest.fixture(scope="module")
def page() -> Iterator[tuple[Page, Listening]]:
    """A page on a free port whose orders are all refused."""
    listening = listen("localhost", 0)
    made = Page(listening, "", lambda order, reply: reply(Answer(False, f"no {order}")))
    yield made, listening
    made.stop()


def test_a_taken_port_is_named_and_the_next_one_is_used():
    """As many as are taken."""
    first = listen("localhost", 0)
    port = first.port
    second = listen("localhost", port)
    assert second.port not in (port, *second.taken)
    assert second.taken[0] == port
    assert second.port == port + len(second.taken)
    first.socket.close()
    second.socket.close()


@pytest.mark.parametrize(("host", "problem"), [
    ("192.0.2.1", "this is no address of this machine"),  # RFC 5737: of no machine
    ("a" * 70 + ".b", "no such name")])
def test_an_address_of_another_machine_is_refused(host, problem):
    """In one sentence that names the parameter, instead of waiting for ever."""
    with pytest.raises(AddressError, match=f"view_host is {host}: {problem}"):
        listen(host, 8080)


def test_only_a_loopback_address_is_local():
    """What decides whether buttons need a token."""
    for host, local in (("localhost", True), ("127.0.0.1", True), ("0.0.0.0", False)):
        listening = listen(host, 0)
        assert listening.local is local
        listening.socket.close()
    assert listening.url == f"http://{socket.gethostname()}:{listening.port}"


@pytest.mark.parametrize(("origin", "host", "allowed"), [
    (None, "localhost:8080", True),
    ("http://localhost:8080", "localhost:8080", True),
    ("http://192.168.1.7:8080", "192.168.1.7:8080", True),
    ("http://evil.example", "localhost:8080", False),
    ("http://localhost:8081", "localhost:8080", False),
    ("http://localhost:8080.evil.example", "localhost:8080", False),
    ("http://evil.example:8080", "evil.example:8080", False),  # its name server says 127.0.0.1
    ("null", "localhost:8080", False),
])
def test_only_pages_of_this_server_are_allowed(origin, host, allowed):
    """Foreign pages, other ports, and names that somebody else gave to this machine are not."""
    assert same_page(origin, host, NAMES) is allowed


def test_a_foreign_page_gets_403(page):
    """The handshake of a websocket from a page of another server is refused."""
    port = page[1].port
    with pytest.raises(websockets.exceptions.InvalidStatus) as refused:
        PageClient(port, origin="http://evil.example")
    assert refused.value.response.status_code == 403
    allowed = PageClient(port, origin=f"http://127.0.0.1:{port}")
    allowed.until(lambda: allowed.has("Push the door"))
    allowed.close()


def test_buttons_of_two_pages_and_an_answer_after_one_has_gone(recwarn):
    """An order reaches its taker; an answer for a closed page is no error, and stays for others."""
    given = []
    listening = listen("localhost", 0)
    made = Page(listening, "", lambda order, reply: given.append((order, reply)))
    first, second = PageClient(listening.port), PageClient(listening.port)
    for client in (first, second):
        client.until(lambda client=client: client.has("Push the door"))
    first.enter("impulse [N m s]", 9.5)
    first.press("Push the door")
    second.until(lambda: "Push the door with 9.5 N m s: waiting" in second.text())
    ((order, reply),) = given
    assert order == Push(9.5)
    first.close()
    second.until(lambda: len(made._server.get_clients()) == 1)
    reply(Answer(True, "pushed"))
    second.until(lambda: "done. pushed" in second.text())
    assert not second.notifications
    assert not recwarn.list
    second.close()
    made.stop()
