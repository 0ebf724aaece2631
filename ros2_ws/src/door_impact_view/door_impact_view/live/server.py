"""The web server of the page: viser on a socket of our own, for pages of this server alone.

viser by itself tries other ports without a word, waits for ever on an address that is not this
machine's, takes commands from any page that is open in the same browser, and offers a tunnel to
the internet.
"""

from __future__ import annotations

import contextlib
import errno
import http
import ipaddress
import logging
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from door_impact_view.errors import AddressError, ViewerMissingError

try:
    import rich
    import viser
    import websockets.asyncio.server
    from viser import _messages
except ImportError as missing:
    raise ViewerMissingError(missing.name or "viser") from missing

_TRIES = 20  # ports that are tried, from the wanted one on


@dataclass(frozen=True)
class Listening:
    """A socket that listens.

    Attributes:
        socket: The socket.
        host: Name or address that was asked for.
        address: Its address.
        port: Its port.
        taken: Ports before it that other programs had already.
    """

    socket: socket.socket
    host: str
    address: str
    port: int
    taken: tuple[int, ...]

    @property
    def local(self) -> bool:
        """Whether only programs on this machine can connect."""
        return ipaddress.ip_address(self.address).is_loopback

    @property
    def url(self) -> str:
        """What to enter in a browser, on this machine or, if it is not local, on another."""
        anywhere = ipaddress.ip_address(self.address).is_unspecified
        name = socket.gethostname() if anywhere else self.host
        return f"http://{f'[{name}]' if ':' in name else name}:{self.port}"


def listen(host: str, port: int) -> Listening:
    """Listen on the first free port from `port` on.

    Args:
        host: Name or address of this machine; `0.0.0.0` means every address of it.
        port: First port to try; 0 lets the system choose.

    Raises:
        AddressError: The address is not this machine's, the port is not allowed, or all are taken.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise AddressError("view_host", host, "no such name or address is known") from error
    family, *_, address = sorted(found)[0]  # IPv4 first
    taken = []
    for candidate in range(port, min(port + _TRIES, 65536)):
        try:
            made = socket.create_server((str(address[0]), candidate), family=family)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                taken.append(candidate)
                continue
            if error.errno == errno.EADDRNOTAVAIL:
                raise AddressError(
                    "view_host", host, "this is no address of this machine") from error
            raise AddressError("view_port", candidate, error.strerror or str(error)) from error
        found_address, found_port = made.getsockname()[:2]
        return Listening(made, host, found_address, found_port, tuple(taken))
    raise AddressError("view_port", port, f"this port and the next {len(taken) - 1} are taken")


def same_page(origin: str | None, host: str | None, names: frozenset[str]) -> bool:
    """Whether a connection comes from a page of this server, or from no browser at all.

    A page of another server has another Origin. A name that an attacker's name server gives this
    machine is not among the names, so that no such page can have an Origin equal to Host.

    Args:
        origin: Header Origin of the request, which every browser sends.
        host: Header Host.
        names: Names of this machine; its addresses are allowed anyway.
    """
    if origin is None:
        return True
    if host is None or origin.lower() != f"http://{host.lower()}":
        return False
    name = host.lower().rsplit(":", 1)[0] if not host.endswith("]") else host.lower()
    if name in names:
        return True
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name.strip("[]"))
        return True
    return False


def start_server(listening: Listening, label: str) -> viser.ViserServer:
    """Start viser on a socket; `stop_server` ends it.

    Args:
        listening: The socket.
        label: Title of the page.
    """
    names = frozenset(name.lower() for name in (
        "localhost", listening.host, socket.gethostname(), socket.getfqdn()))
    module: Any = websockets.asyncio.server
    serve = module.serve

    def guarded(request_file: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        def process(connection: Any, request: Any) -> Any:
            headers = request.headers
            try:
                allowed = same_page(headers.get("Origin"), headers.get("Host"), names)
            except LookupError:  # a header that is there twice
                allowed = False
            if not allowed:
                return connection.respond(
                    http.HTTPStatus.FORBIDDEN, "Only pages of this server may connect.\n")
            return request_file(connection, request)

        return process

    def serve_here(handler: Any, _host: str, _port: int, **options: Any) -> Any:
        options["process_request"] = guarded(options["process_request"])
        return serve(handler, sock=listening.socket, **options)

    # The library has no setting for any of these.
    module.serve = serve_here
    try:
        with _silent():
            server = viser.ViserServer(
                host=listening.address, port=listening.port, label=label, verbose=False)
    finally:
        module.serve = serve
    # Its reports of refused connections, with tracebacks, are of no use to who runs the graph.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    server.gui.configure_theme(show_share_button=False, show_logo=False)
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server


def stop_server(server: viser.ViserServer) -> None:
    """End the server and its threads, and close its socket."""
    with _silent():
        server.stop()


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from printing a banner or a farewell."""
    module: Any = rich
    printed = module.print
    module.print = lambda *_, **__: None
    try:
        yield
    finally:
        module.print = printed
