"""Requests and responses over UDP, which loses, repeats and reorders datagrams.

A datagram is a header and up to PAYLOAD bytes of a body:

    magic 2 | kind 1 | session 8 | message 4 | index 4 | count 4

PART carries piece `index` of `count` of a request or response; GOT confirms a piece of a request; REQUEST
requests pieces `index` to `index` + `count` of a response. The client has at most WINDOW pieces in flight in
either direction and repeats lost ones. A request is executed once, however often its pieces arrive: the
server keeps each session's latest response until the next request.
"""

from __future__ import annotations

import asyncio
import os
import socket
import sys
from collections import OrderedDict
from dataclasses import dataclass, field
from struct import Struct
from time import monotonic
from typing import TYPE_CHECKING, Any, cast

from roboyard.pybullet.face import wire

if TYPE_CHECKING:
    from roboyard.pybullet.remote.dispatch import Dispatcher

PAYLOAD = 1200
WINDOW = 32
MAX_SESSIONS = 64
REPEAT_SECONDS = 0.05
CONNECT_SECONDS = 5.0
_HEADER = Struct(">2sBQIII")
_MAGIC = b"RY"
_PART, _GOT, _REQUEST, _REFUSED = 1, 2, 3, 4
_MAX_PIECES = wire.MAX_BODY // PAYLOAD + 1


@dataclass(frozen=True, slots=True)
class Datagram:
    """One datagram; see the module's docstring for the fields."""

    kind: int
    session: int
    message: int
    index: int
    count: int
    payload: bytes = b""

    def packed(self) -> bytes:
        """Return the bytes to send."""
        head = _HEADER.pack(_MAGIC, self.kind, self.session, self.message, self.index, self.count)
        return head + self.payload

    @classmethod
    def read(cls, data: bytes) -> Datagram | None:
        """Return the datagram in received bytes, or None if they are not of this protocol."""
        if len(data) < _HEADER.size or len(data) > _HEADER.size + PAYLOAD:
            return None
        magic, kind, session, message, index, count = _HEADER.unpack_from(data)
        if magic != _MAGIC or kind not in (_PART, _GOT, _REQUEST, _REFUSED) or count > _MAX_PIECES:
            return None
        return cls(kind, session, message, index, count, data[_HEADER.size :])


def pieces_of(body: bytes) -> list[bytes]:
    """Return a body cut into pieces of at most PAYLOAD bytes."""
    return [body[start : start + PAYLOAD] for start in range(0, max(1, len(body)), PAYLOAD)]


@dataclass(slots=True)
class _Session:
    message: int = -1
    arrived: dict[int, bytes] = field(default_factory=dict)
    answer: list[bytes] = field(default_factory=list)
    greeted: bool = False


class DatagramServer(asyncio.DatagramProtocol):
    """Server of any number of sessions; the longest idle one is dropped for a new one."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        """Serve the world of a dispatcher."""
        self._dispatcher = dispatcher
        self._sessions: OrderedDict[tuple[Any, int], _Session] = OrderedDict()
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Store the transport."""
        self._transport = cast(asyncio.DatagramTransport, transport)

    def error_received(self, exc: Exception) -> None:
        """Ignore the error of one client; others continue."""

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Process a datagram; anything of another protocol is ignored."""
        got = Datagram.read(data)
        if got is None:
            return
        session = self._session((addr, got.session))
        if got.kind == _PART:
            self._receive_piece(session, got, addr)
        elif got.kind == _REQUEST and got.message == session.message:
            self._send_answer(session, got, got.index, min(got.count, WINDOW), addr)

    def _session(self, key: tuple[Any, int]) -> _Session:
        session = self._sessions.setdefault(key, _Session())
        self._sessions.move_to_end(key)
        while len(self._sessions) > MAX_SESSIONS:
            self._sessions.popitem(last=False)
        return session

    def _receive_piece(self, session: _Session, got: Datagram, addr: Any) -> None:
        if got.message < session.message or got.index >= got.count:
            return
        if got.message > session.message:
            session.message, session.arrived, session.answer = got.message, {}, []
        self._send(Datagram(_GOT, got.session, got.message, got.index, got.count), addr)
        if session.answer:
            return
        session.arrived[got.index] = got.payload
        if len(session.arrived) == got.count:
            body = b"".join(session.arrived[i] for i in range(got.count))
            session.arrived = {}
            try:
                session.answer = pieces_of(self._answer(session, body))
            except (wire.WireError, KeyError) as problem:
                print(f"roboyard serve: a datagram was refused: {problem}", file=sys.stderr)
                self._send(Datagram(_REFUSED, got.session, got.message, 0, 0), addr)
                return
            self._send_answer(session, got, 0, WINDOW, addr)

    def _answer(self, session: _Session, body: bytes) -> bytes:
        message = wire.decode(body)
        if not session.greeted:
            wire.check_hello(message)
            session.greeted = True
            return wire.encode(wire.HELLO)
        return self._dispatcher.answer(message)

    def _send_answer(self, session: _Session, got: Datagram, first: int, count: int, addr: Any) -> None:
        total = len(session.answer)
        for index in range(first, min(first + count, total)):
            self._send(Datagram(_PART, got.session, got.message, index, total, session.answer[index]), addr)

    def _send(self, datagram: Datagram, addr: Any) -> None:
        assert self._transport is not None
        self._transport.sendto(datagram.packed(), addr)


class DatagramChannel:
    """The client's side of a session."""

    def __init__(self, host: str, port: int) -> None:
        """Open a session and exchange greetings.

        Raises:
            OSError: there is no server.
            WireError: the server uses another protocol.
        """
        family, kind, proto, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, kind, proto)
        self._socket.connect(address)
        self._session = int.from_bytes(os.urandom(8), "big")
        self._message = 0
        self.timeout: float | None = CONNECT_SECONDS
        wire.check_hello(wire.decode(self.exchange(wire.encode(wire.HELLO))))
        self.timeout = None

    def exchange(self, body: bytes) -> bytes:
        """Return the response to a request.

        Raises:
            OSError: there is no response in time.
            WireError: the server refused the message.
        """
        self._message += 1
        deadline = None if self.timeout is None else monotonic() + self.timeout
        arrived: dict[int, bytes] = {}
        total = self._send_request(pieces_of(body), arrived, deadline)
        while total is None or len(arrived) < total:
            self._check_deadline(deadline)
            missing = 0 if total is None else next(i for i in range(total) if i not in arrived)
            self._send(_REQUEST, missing, WINDOW)
            total = self._collect(arrived, total, upto=missing + WINDOW)
        return b"".join(arrived[i] for i in range(total))

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _send_request(
        self, pieces: list[bytes], arrived: dict[int, bytes], deadline: float | None
    ) -> int | None:
        """Send all pieces; return the number of pieces of the response, if some arrived already."""
        waiting = set(range(len(pieces)))
        total: int | None = None
        while waiting and total is None:
            self._check_deadline(deadline)
            window = sorted(waiting)[:WINDOW]
            for index in window:
                self._send(_PART, index, len(pieces), pieces[index])
            outstanding = set(window)
            while outstanding and total is None:
                got = self._receive()
                if got is None:
                    break
                if got.kind == _GOT:
                    outstanding.discard(got.index)
                    waiting.discard(got.index)
                elif got.kind == _PART:
                    arrived[got.index] = got.payload
                    total = got.count
        return self._collect(arrived, total, upto=WINDOW)

    def _collect(self, arrived: dict[int, bytes], total: int | None, *, upto: int) -> int | None:
        """Receive pieces of the response until those before `upto` are complete or no more arrive."""
        while total is None or any(i not in arrived for i in range(min(upto, total))):
            got = self._receive()
            if got is None:
                break
            if got.kind == _PART:
                arrived[got.index] = got.payload
                total = got.count
        return total

    def _check_deadline(self, deadline: float | None) -> None:
        if deadline is not None and monotonic() > deadline:
            raise TimeoutError(f"no response within {self.timeout} s")

    def _send(self, kind: int, index: int, count: int, payload: bytes = b"") -> None:
        self._socket.send(Datagram(kind, self._session, self._message, index, count, payload).packed())

    def _receive(self) -> Datagram | None:
        """Return the next datagram of this exchange, or None if none arrives within REPEAT_SECONDS."""
        end = monotonic() + REPEAT_SECONDS
        while (left := end - monotonic()) > 0:
            self._socket.settimeout(left)
            try:
                got = Datagram.read(self._socket.recv(_HEADER.size + PAYLOAD))
            except TimeoutError:
                return None
            if got is None or got.session != self._session or got.message != self._message:
                continue
            if got.kind == _REFUSED:
                raise wire.WireError("the server refused the message")
            return got
        return None
