"""The server of requests over UDP, which loses, repeats and reorders datagrams (see `datagram`).

A request is executed once, however often its pieces arrive: each session keeps its latest response until the
client has it or sends its next request. A sender is unknown until a single datagram brings a valid greeting;
until then nothing is kept of it.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any, cast

from roboyard.pybullet.face import wire
from roboyard.pybullet.remote.byte_budget import ByteBudget, give_back
from roboyard.pybullet.remote.datagram import (
    BYE,
    DONE,
    GOT,
    PART,
    PAYLOAD,
    REFUSED,
    REQUEST,
    Datagram,
)
from roboyard.untrusted.repeated import RepeatedNotices

if TYPE_CHECKING:
    from roboyard.pybullet.remote.dispatch import Dispatcher

WINDOW = 32
"""Pieces of a response that are sent unasked or for one request."""
MAX_SESSIONS = 64
IDLE_SECONDS = 600.0
"""A session that was silent for longer gives way to a new one when there are MAX_SESSIONS."""
KEPT_SECONDS = 60.0
"""Time for which requests and responses of a silent session are kept (s)."""


@dataclass(slots=True)
class _Session:
    message: int
    body: bytes
    """The latest response."""
    arrived: dict[int, bytes] = field(default_factory=dict)
    is_answered: bool = True
    heard: float = field(default_factory=monotonic)


class DatagramServer(asyncio.DatagramProtocol):
    """Server of up to MAX_SESSIONS sessions."""

    def __init__(
        self,
        dispatcher: Dispatcher,
        *,
        token: str = "",
        budget: ByteBudget | None = None,
        notices: RepeatedNotices | None = None,
    ) -> None:
        """Serve the world of a dispatcher.

        Args:
            dispatcher: the world.
            token: what a greeting has to bring; "" for nothing.
            budget: memory for messages that are arriving.
            notices: prints refusals.
        """
        self._dispatcher, self._token = dispatcher, token
        self._budget = budget or ByteBudget()
        self._notices = notices or RepeatedNotices("roboyard serve")
        self.sessions: dict[tuple[Any, int], _Session] = {}
        """Sessions by address and number."""
        self._transport: asyncio.DatagramTransport | None = None
        self._swept = monotonic()

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
        self.sweep()
        key = addr, got.session
        session = self.sessions.get(key)
        if session is None:
            if got.kind == PART:
                self._greet(key, got, addr)
            return
        session.heard = monotonic()
        if got.kind == PART:
            self._receive_piece(session, got, addr)
        elif got.kind == REQUEST and got.message == session.message:
            self._send_answer(session, got, got.index, min(got.count, WINDOW), addr)
        elif got.kind == DONE and got.message == session.message:
            self._forget(session)
        elif got.kind == BYE:
            self._forget(session)
            del self.sessions[key]

    def sweep(self) -> None:
        """Free what sessions left behind that have been silent for KEPT_SECONDS."""
        now = monotonic()
        if now - self._swept < KEPT_SECONDS / 4:
            return
        self._swept = now
        for session in self.sessions.values():
            if now - session.heard > KEPT_SECONDS:
                self._forget(session)

    def _forget(self, session: _Session) -> None:
        """Free a session's response and the pieces of a request."""
        size = len(session.body) + self._drop_pieces(session)
        session.body = b""
        give_back(size)

    def _drop_pieces(self, session: _Session) -> int:
        size = sum(map(len, session.arrived.values()))
        session.arrived = {}
        self._budget.release(size)
        return size

    def _greet(self, key: tuple[Any, int], got: Datagram, addr: Any) -> None:
        """Open a session for a valid greeting; anything else is refused, and nothing is kept."""
        try:
            if got.count != 1 or got.index or len(got.payload) > wire.HELLO_BYTES:
                raise wire.WireError("the first message is no greeting")
            wire.check_hello(wire.decode(got.payload), self._token)
            self._make_room()
        except wire.WireError as problem:
            self._refuse(got, problem, addr)
            return
        session = self.sessions[key] = _Session(got.message, wire.encode(wire.HELLO))
        self._send(Datagram(GOT, got.session, got.message, 0, 1), addr)
        self._send_answer(session, got, 0, 1, addr)

    def _make_room(self) -> None:
        """Drop the session that was silent for longest, if that is long; else there is no room.

        Raises:
            WireError: all sessions are in use.
        """
        if len(self.sessions) < MAX_SESSIONS:
            return
        oldest = min(self.sessions, key=lambda key: self.sessions[key].heard)
        if monotonic() - self.sessions[oldest].heard < IDLE_SECONDS:
            raise wire.WireError(f"there are already {MAX_SESSIONS} sessions, the limit")
        self._forget(self.sessions.pop(oldest))

    def _receive_piece(self, session: _Session, got: Datagram, addr: Any) -> None:
        if got.message < session.message or got.index >= got.count:
            return
        if got.message > session.message:
            self._forget(session)
            session.message, session.is_answered = got.message, False
        if not session.is_answered and got.index not in session.arrived:
            try:
                self._budget.reserve(len(got.payload))
            except wire.WireError:
                return  # not confirmed: the client sends it again
            session.arrived[got.index] = got.payload
        self._send(Datagram(GOT, got.session, got.message, got.index, got.count), addr)
        if session.is_answered or len(session.arrived) < got.count:
            return
        try:
            body = b"".join(session.arrived[i] for i in range(got.count))
            self._drop_pieces(session)
            session.is_answered = True
            session.body = self._dispatcher.answer(wire.decode(body))
            give_back(len(body))
        except (wire.WireError, KeyError) as problem:
            self._drop_pieces(session)
            self._refuse(got, problem, addr)
            return
        self._send_answer(session, got, 0, WINDOW, addr)

    def _refuse(self, got: Datagram, problem: Exception, addr: Any) -> None:
        self._notices.say("a datagram was refused", str(problem))
        reason = str(problem).encode()[:100]  # short: the sender may be another than the address says
        self._send(Datagram(REFUSED, got.session, got.message, 0, 0, reason), addr)

    def _send_answer(self, session: _Session, got: Datagram, first: int, count: int, addr: Any) -> None:
        body = session.body
        total = -(-len(body) // PAYLOAD)
        for index in range(first, min(first + count, total)):
            piece = body[index * PAYLOAD : (index + 1) * PAYLOAD]
            self._send(Datagram(PART, got.session, got.message, index, total, piece), addr)

    def _send(self, datagram: Datagram, addr: Any) -> None:
        assert self._transport is not None
        self._transport.sendto(datagram.packed(), addr)
