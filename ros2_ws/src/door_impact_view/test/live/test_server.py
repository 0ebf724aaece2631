"""Tests of the web server: ports, addresses, and which pages may connect."""

import base64
import errno
import http.client
import os
import socket
from collections.abc import Iterator

import pytest
import websockets.exceptions
from door_impact_view.errors import AddressError
from door_impact_view.live import server as module
from door_impact_view.live.orders import Answer, Push
from door_impact_view.live.page import Page
from door_impact_view.live.page_client import PageClient
from door_impact_view.live.server import Listening, listen, same_page
from door_impact_view.live.state import PlanSummary, State
from viser._messages import ShareUrlRequest

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


def test_when_all_ports_are_taken_it_says_so(monkeypatch):
    """After some tries, not after all 65535."""
    def taken(*_, **__):
        raise OSError(errno.EADDRINUSE, "in use")

    monkeypatch.setattr(module.socket, "create_server", taken)
    with pytest.raises(AddressError, match="view_port is 8080: this port and the next 19 are"):
        listen("localhost", 8080)
    with pytest.raises(AddressError, match="view_port is 65530: this port and the next 5 are"):
        listen("localhost", 65530)


@pytest.mark.parametrize(("host", "problem"), [
    ("192.0.2.1", "this is no address of this machine"),  # RFC 5737: of no machine
    ("no.such.name.invalid", "no such name"), ("a" * 70 + ".b", "no such name")])
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
    ("http://LOCALHOST:8080", "localhost:8080", True),
    ("http://robot:8080", "robot:8080", True),
    ("http://192.168.1.7:8080", "192.168.1.7:8080", True),
    ("http://[::1]:8080", "[::1]:8080", True),
    ("http://evil.example", "localhost:8080", False),
    ("http://localhost:8081", "localhost:8080", False),
    ("http://localhost:8080.evil.example", "localhost:8080", False),
    ("http://evil.example:8080", "evil.example:8080", False),  # its name server says 127.0.0.1
    ("https://localhost:8080", "localhost:8080", False),
    ("null", "localhost:8080", False),
    ("", "", False),
    ("http://localhost:8080", None, False),
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


def test_the_page_itself_is_served(page):
    """A browser gets HTML of this server alone, by name and by address."""
    for host in ("localhost", "127.0.0.1"):
        connection = http.client.HTTPConnection(host, page[1].port, timeout=60)
        connection.request("GET", "/")
        response = connection.getresponse()
        assert response.status == 200
        assert b"<html" in response.read()
        connection.close()


def test_no_page_can_open_a_tunnel(page):
    """The library's request for a public address is not handled."""
    handlers = page[0]._server._websock_server._incoming_handlers
    assert not handlers.get(ShareUrlRequest)


def test_nothing_is_printed(capfd):
    """Neither a banner nor a farewell comes between the lines of the nodes."""
    made = Page(listen("localhost", 0), "", lambda order, reply: None)
    made.stop()
    assert capfd.readouterr() == ("", "")


def test_the_socket_is_free_after_the_end():
    """A page that is started again gets its port back."""
    listening = listen("localhost", 0)
    made = Page(listening, "", lambda order, reply: None)
    made.stop()
    again = listen("localhost", listening.port)
    assert not again.taken
    again.socket.close()


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


def test_a_robot_that_changes_is_drawn_anew(page):
    """The links of the robot before are gone; a robot that cannot be drawn leaves the old one."""
    made, listening = page
    client = PageClient(listening.port)
    urdf = '<robot name="r"><link name="{}"/></robot>'
    for name in ("old", "new"):
        made.draw(State(robot=urdf.format(name)))
        client.until(lambda name=name: f"/robot/{name}" in client.nodes)
    assert "/robot/old" not in client.nodes
    made.draw(State(robot="<robot"))
    assert "cannot be drawn" in made.problem
    made.draw(State(robot=urdf.format("new")))
    assert made.problem == ""
    client.read()
    assert "/robot/new" in client.nodes
    client.close()


def test_a_browser_that_stops_reading_delays_nothing():
    """Drawing goes on while a full connection waits, another browser gets everything, and what is
    kept for the one that does not read does not grow."""
    listening = listen("localhost", 0)
    made = Page(listening, "", lambda order, reply: None, plot_every=1)
    stuck, client = PageClient(listening.port), PageClient(listening.port)
    for page in (stuck, client):
        page.until(lambda page=page: page.has("Plan"))

    def waiting() -> int:
        connections = made._server._websock_server._live_connections.values()
        return max(item.transport.get_write_buffer_size() for item in connections)

    count = 0
    while waiting() < 100_000:  # until the system's own buffers are full
        count += 1
        noise = base64.b64encode(os.urandom(300_000)).decode()
        made.draw(State(plan=PlanSummary(f"plan {count}", (("plan", f"no. {count}. {noise}"),))))
        # A drawing replaces one that was not sent yet: only those that were sent fill the buffers.
        client.until(lambda count=count: f"no. {count}." in client.text())
        assert count < 1000, "nothing had to wait"
    held, kept = waiting(), len(made._server._websock_server._broadcast_buffer.message_from_id)
    for _ in range(200):
        count += 1
        made.draw(State(plan=PlanSummary("", (("plan", f"no. {count}. {noise}"),))))
        client.read(timeout=0.001)
    client.until(lambda: f"no. {count}." in client.text())
    assert f"no. {count}." not in stuck.text()
    assert waiting() <= held + 2 * len(noise)
    assert len(made._server._websock_server._broadcast_buffer.message_from_id) <= kept + 2
    stuck._socket.socket.close()
    client.close()
    made.stop()
