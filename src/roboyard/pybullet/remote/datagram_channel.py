"""The client of a server over UDP: requests and responses in pieces (see `datagram`).

The client has at most WINDOW pieces in flight in either direction and repeats lost ones.
"""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from time import monotonic

from roboyard.pybullet.face import wire
from roboyard.pybullet.remote.datagram import (
    BYE,
    DONE,
    GOT,
    HEADER,
    PART,
    PAYLOAD,
    REFUSED,
    REQUEST,
    Datagram,
    pieces_of,
)
from roboyard.untrusted.text import one_line

WINDOW = 32
"""Pieces in flight."""
REPEAT_SECONDS = 0.05
CONNECT_SECONDS = 5.0


class DatagramChannel:
    """The client's side of a session."""

    def __init__(self, host: str, port: int, token: str = "") -> None:
        """Open a session and exchange greetings.

        Args:
            host: name or address of the server.
            port: its port.
            token: its token; "" for none.

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
        try:
            wire.check_hello(wire.decode(self.exchange(wire.encode(wire.hello(token)))))
        except BaseException:
            self._socket.close()
            raise
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
            self._send(REQUEST, missing, WINDOW)
            total = self._collect(arrived, total, upto=missing + WINDOW)
        with suppress(OSError):
            self._send(DONE, 0, 0)
        return b"".join(arrived[i] for i in range(total))

    def close(self) -> None:
        """End the session and close the socket."""
        with suppress(OSError):
            self._send(BYE, 0, 0)
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
                self._send(PART, index, len(pieces), pieces[index])
            outstanding = set(window)
            while outstanding and total is None:
                got = self._receive()
                if got is None:
                    break
                if got.kind == GOT:
                    outstanding.discard(got.index)
                    waiting.discard(got.index)
                elif got.kind == PART and got.index < got.count:
                    arrived[got.index] = got.payload
                    total = got.count
        return self._collect(arrived, total, upto=WINDOW)

    def _collect(self, arrived: dict[int, bytes], total: int | None, *, upto: int) -> int | None:
        """Receive pieces of the response until those before `upto` are complete or no more arrive."""
        while total is None or any(i not in arrived for i in range(min(upto, total))):
            got = self._receive()
            if got is None:
                break
            if got.kind == PART and got.index < got.count and total in (None, got.count):
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
                got = Datagram.read(self._socket.recv(HEADER.size + PAYLOAD))
            except TimeoutError:
                return None
            if got is None or got.session != self._session or got.message != self._message:
                continue
            if got.kind == REFUSED:
                reason = one_line(got.payload.decode("utf-8", "replace"))
                raise wire.WireError(f"the server refused the message{': ' if reason else ''}{reason}")
            return got
        return None
