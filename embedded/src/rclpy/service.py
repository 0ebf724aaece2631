"""Services and their clients.

A request and its reply are samples on two topics. Before the payload they have the client's
identity, which is the instance handle of its writer, and a running number (the convention of
rmw_cyclonedds_cpp).
"""

from __future__ import annotations

import inspect
import itertools
import struct
import threading
import time
from collections.abc import Callable
from types import new_class
from typing import Any, NamedTuple

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from ros2_embedded import naming
from ros2_embedded.cdr import HEADER, LITTLE_ENDIAN
from ros2_embedded.domain import parse_user_data
from ros2_embedded.fast_dds import is_fast_dds
from ros2_embedded.messages import dds_type_name, full_type_name
from ros2_embedded.samples import Sample, write
from ros2_embedded.thread_safety import described, make_topic, matched, matched_readers, once
from ros2_embedded.typehash import type_hash

from rclpy.callback_groups import CallbackGroup
from rclpy.entity import Entity
from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile
from rclpy.qos_dds import to_dds
from rclpy.task import Future

_POLL = 0.01
_CLIENT_PATIENCE = 0.5
"""Longest wait of a service for the reader of a new client [s]."""


_GUID, _NUMBER = "rmw_client_guid", "rmw_sequence_number"
_NUMBERS = 1 << 32
"""rmw_cyclonedds_cpp counts a process's requests in 32 bits (rmw_node.cpp, `rmw_send_request`)."""


_HEADER = struct.Struct("<Qq")
_BIG_HEADER = struct.Struct(">Qq")
_PAYLOAD = HEADER + _HEADER.size
"""Offset of the payload in a sample [bytes]."""


@once
def wire_class(payload: Any) -> Any:
    """The struct on the wire: header, then the payload's fields, under the payload's type name."""
    name = full_type_name(payload)
    annotations = {_GUID: idl.uint64, _NUMBER: idl.int64, **payload.__annotations__}
    return new_class(
        name.rsplit("/", 1)[1],
        (IdlStruct,),
        {"typename": dds_type_name(name)},
        lambda namespace: namespace.update(__annotations__=annotations),
    )


class RequestHeader(NamedTuple):
    """The identity of a request: the client, its number of the request, and its writer."""

    client: int
    number: int
    writer: int


Opened = tuple[RequestHeader, bytes]
"""The header, and the bytes of the payload with their own header."""


def _opened(sample: Sample) -> Opened:
    data, info = sample
    packed = _HEADER if data[1] & 1 else _BIG_HEADER
    client, number = packed.unpack_from(data, HEADER)
    return RequestHeader(client, number, info.publication_handle), data[:HEADER] + data[_PAYLOAD:]


class _Peer(Entity):
    """Base of services and clients: a writer and a reader with one identity."""

    def __init__(
        self,
        node: Any,
        role: str,
        full_name: str,
        ways: dict[str, tuple[str, Any]],
        qos: QoSProfile,
        group: Any,
    ) -> None:
        """`ways` gives topic and payload of the `write` and the `read` side."""
        super().__init__(node, group, 0)
        self._full_name = full_name
        participant = node.context.participant
        number = node.context.next_client_number().to_bytes(4, "big")
        identity = participant.guid.bytes[:12] + number
        own = f"{role}id={'.'.join(f'{byte:x}' for byte in identity)};"
        endpoints: dict[str, Any] = {}
        for way, (topic_name, payload) in ways.items():
            user_data = f"{own}typehash={type_hash(full_type_name(payload))};"
            topic = make_topic(participant, topic_name, wire_class(payload))
            kind = DataWriter if way == "write" else DataReader
            endpoints[way] = kind(participant, topic, to_dds(qos, user_data, way == "write"))
        self._writer: Any = endpoints["write"]
        self._reader: Any = endpoints["read"]
        self._guid = self._writer.get_instance_handle() & 0xFFFF_FFFF_FFFF_FFFF
        self._endpoints.add_writer(self._writer)
        self._endpoints.add_reader(self._reader, self.receive)

    @property
    def service_name(self) -> str:
        """Full name of the service; raises InvalidHandle if it was destroyed."""
        self._check()
        return self._full_name

    def _check(self) -> None:
        if self._writer is None:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")

    def _send(self, client: int, number: int, payload: Any) -> None:
        header = LITTLE_ENDIAN + _HEADER.pack(client, number)
        write(self._writer, header + payload.serialize()[HEADER:])

    def destroy(self) -> None:
        """Ends it."""
        if self._writer is not None:
            self._endpoints.release()
            self._writer = self._reader = None
            self._inbox.clear()


class Service(_Peer):
    """Answers requests with what its callback returns."""

    def __init__(
        self,
        node: Any,
        srv_type: Any,
        name: str,
        callback: Callable[[Any, Any], Any],
        qos: QoSProfile,
        group: CallbackGroup | None,
    ) -> None:
        """Made by `Node.create_service`."""
        self.srv_type, self.srv_name, self.callback = srv_type, name, callback
        self.qos_profile = qos
        self._headed: set[int] = set()
        self._known: set[int] = set()
        full = node.resolve_service_name(name)
        ways = {
            "read": (naming.request_name(full), srv_type.Request),
            "write": (naming.reply_name(full), srv_type.Response),
        }
        super().__init__(node, "service", full, ways, qos, group)

    def receive(self, samples: list[Sample]) -> None:
        """Ignores samples without a header."""
        super().receive([one for one in map(_opened, samples) if self._is_request(one[0])])

    def _is_request(self, header: RequestHeader) -> bool:
        handle = header.writer
        if handle not in self._headed:
            client = described(self._reader.get_matched_publication_data, handle)
            # The writer may be gone already: its last request counts.
            if client is not None and is_fast_dds(client.key.bytes):
                return False
            self._headed.add(handle)
        return 0 <= header.number < _NUMBERS

    def handle(self, sample: Opened) -> Any:
        """Answers a request."""
        header, data = sample
        return self.answer(self.srv_type.Request.deserialize(data), header)

    def answer(self, request: Any, header: RequestHeader) -> Any:
        """Calls the callback and replies."""
        response = self.callback(request, self.srv_type.Response())
        if inspect.iscoroutine(response):
            return self._reply_later(header, response)
        self.send_response(response, header)
        return None

    async def _reply_later(self, header: RequestHeader, coroutine: Any) -> None:
        self.send_response(await coroutine, header)

    def send_response(self, response: Any, header: RequestHeader) -> None:
        """Replies to the request with this `header`.

        Raises:
            TypeError: a response of another type.
            InvalidHandle: the service was destroyed.
        """
        if not isinstance(response, self.srv_type.Response):
            raise TypeError(
                f"The callback of the service {self.srv_name} returned "
                f"{type(response).__name__}, not {self.srv_type.Response.__name__}"
            )
        self._check()
        self._await_reader(header.writer)
        self._send(header.client, header.number, response)

    def _await_reader(self, request_writer: int) -> None:
        """Waits until the client's reader is discovered: it would miss the reply otherwise."""
        if request_writer in self._known:
            return
        deadline = time.monotonic() + _CLIENT_PATIENCE
        while time.monotonic() < deadline:
            client = described(self._reader.get_matched_publication_data, request_writer)
            wanted = parse_user_data(client.qos).get("clientid") if client else None
            if wanted is None or wanted in self._client_ids():
                self._known.add(request_writer)
                return
            time.sleep(_POLL)

    def _client_ids(self) -> set[str | None]:
        readers = matched_readers(self._writer)
        return {parse_user_data(reader.qos).get("clientid") for reader in readers}


class Client(_Peer):
    """Calls a service."""

    def __init__(
        self, node: Any, srv_type: Any, name: str, qos: QoSProfile, group: CallbackGroup | None
    ) -> None:
        """Made by `Node.create_client`."""
        self.srv_type, self.srv_name, self.qos_profile = srv_type, name, qos
        self._pending: dict[int, Future] = {}
        self._numbers = itertools.count(1)
        full = node.resolve_service_name(name)
        ways = {
            "write": (naming.request_name(full), srv_type.Request),
            "read": (naming.reply_name(full), srv_type.Response),
        }
        super().__init__(node, "client", full, ways, qos, group)

    def receive(self, samples: list[Sample]) -> None:
        """Ignores replies to other clients."""
        super().receive([one for one in map(_opened, samples) if one[0].client == self._guid])

    def handle(self, sample: Opened) -> None:
        """Completes the future of the call; its done callbacks are tasks of the executor."""
        header, data = sample
        future = self._pending.pop(header.number, None)
        if future is not None:
            future._set_executor(self.node.executor)
            future.set_result(self.srv_type.Response.deserialize(data))

    def call_async(self, request: Any) -> Future:
        """Sends a request; the future gets the response.

        Raises:
            TypeError: a request of another type.
            InvalidHandle: the client was destroyed.
        """
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(
                f"Expected {self.srv_type.Request.__name__}, got {type(request).__name__}"
            )
        self._check()
        future = Future()
        number = next(self._numbers)
        self._pending[number] = future
        future._add_waker(lambda: self._pending.pop(number, None))  # as after a cancellation
        self._send(self._guid, number, request)
        return future

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Calls and waits; None after the timeout. Another thread must spin the node.

        Raises:
            TypeError: a request of another type.
            InvalidHandle: the client was destroyed.
        """
        event = threading.Event()
        future = self.call_async(request)
        future._add_waker(event.set)
        if not event.wait(timeout_sec):
            self.remove_pending_request(future)
        return future.result()

    def get_pending_request(self, sequence_number: int) -> Future:
        """The future of a call; raises KeyError if no call has this number."""
        return self._pending[sequence_number]

    def remove_pending_request(self, future: Future) -> None:
        """Removes a call: its response will be ignored."""
        for number in [n for n, f in self._pending.copy().items() if f is future]:
            self._pending.pop(number, None)

    def service_is_ready(self) -> bool:
        """Whether a compatible server has been discovered, with both its reader and its writer.

        Raises:
            InvalidHandle: the client was destroyed.
        """
        self._check()
        if not matched(self._reader.get_matched_publications):
            return False
        return any(not is_fast_dds(server.key.bytes) for server in matched_readers(self._writer))

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Waits for a server; False after the timeout or a shutdown of the context."""
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        while self.node.context.ok() and not self.service_is_ready():
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(_POLL)
        return self.service_is_ready()
