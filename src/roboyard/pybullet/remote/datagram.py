"""The pieces in which messages cross UDP.

A datagram is a header and up to PAYLOAD bytes of a body:

    magic 2 | kind 1 | session 8 | message 4 | index 4 | count 4

PART carries piece `index` of `count` of a request or response; GOT confirms a piece of a request; REQUEST
requests pieces `index` to `index` + `count` of a response; DONE says that all of a response arrived; BYE ends
the session; REFUSED rejects a message.
"""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct

from roboyard.pybullet.face import wire

PAYLOAD = 1200
"""Bytes of a body in one datagram."""
MAX_PIECES = wire.MAX_BODY // PAYLOAD + 1
HEADER = Struct(">2sBQIII")
PART, GOT, REQUEST, REFUSED, DONE, BYE = 1, 2, 3, 4, 5, 6
_MAGIC = b"RY"


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
        head = HEADER.pack(_MAGIC, self.kind, self.session, self.message, self.index, self.count)
        return head + self.payload

    @classmethod
    def read(cls, data: bytes) -> Datagram | None:
        """Return the datagram in received bytes, or None if they are not of this protocol."""
        if len(data) < HEADER.size or len(data) > HEADER.size + PAYLOAD:
            return None
        magic, kind, session, message, index, count = HEADER.unpack_from(data)
        if magic != _MAGIC or not PART <= kind <= BYE or count > MAX_PIECES:
            return None
        return cls(kind, session, message, index, count, data[HEADER.size :])


def pieces_of(body: bytes) -> list[bytes]:
    """Return a body cut into pieces of at most PAYLOAD bytes."""
    return [body[start : start + PAYLOAD] for start in range(0, max(1, len(body)), PAYLOAD)]
