"""The wire format of commands and results: MessagePack in length-prefixed frames, arrays as raw buffers.

    frame     4 bytes, big endian: length of the body; then the body
    hello     ["roboyard", protocol version], first frame of either side; a client of a server with a token
              adds the token
    request   [number, command name, [arguments...]]
    answer    [number, "ok", result] or [number, "error" or "type", message, [notes...]]

Arrays are extension 1: [dtype, shape, bytes]. Decoding creates plain data only; it never runs code.
"""

from __future__ import annotations

import hmac
import re
from collections.abc import Iterable, Mapping
from math import prod
from reprlib import Repr
from struct import Struct
from typing import Any

import msgspec
import numpy as np

from roboyard.errors import RoboyardError
from roboyard.pybullet.face.wire_bounds import is_array_head, is_too_much

VERSION = 1
MAX_BODY = 256 * 1024 * 1024
"""Size of the largest body that is accepted (bytes)."""
HELLO = ["roboyard", VERSION]
HELLO_BYTES = 256
"""Size of the largest first body of either side (bytes)."""
MAX_TOKEN = 200
"""Longest token (bytes in UTF-8)."""
PREFIX = Struct(">I")
_ARRAY = 1
_PLAIN_KINDS = "biuf"
_DTYPE = re.compile(r"[<>|=]?[biuf][0-9]{1,2}")


class WireError(RoboyardError):
    """Data received that is not a message of this protocol."""


def encode(message: object) -> bytes:
    """Return the body of a message.

    Raises:
        TypeError: the message contains something that cannot be sent.
    """
    try:
        return _ENCODER.encode(message)
    except (OverflowError, ValueError, RecursionError) as problem:
        raise TypeError(f"cannot be sent to a server: {problem}") from None


def frame(message: object) -> bytes:
    """Return a message as a frame: its length, then its body.

    Raises:
        TypeError: the message contains something that cannot be sent.
    """
    body = encode(message)
    return PREFIX.pack(len(body)) + body


def decode(body: bytes | bytearray | memoryview) -> Any:
    """Return the message in a body.

    Raises:
        WireError: the body is not a message.
    """
    if is_too_much(body):
        raise WireError("not a message: it has too many values; send NumPy arrays instead of long lists")
    try:
        return _DECODER.decode(body)
    except (msgspec.MsgspecError, ValueError, TypeError, RecursionError) as problem:
        raise WireError(f"not a message: {problem}") from None


def body_length(prefix: bytes, largest: int = MAX_BODY) -> int:
    """Return the length of the body that follows a prefix.

    Args:
        prefix: the first bytes of a frame.
        largest: longest body that is accepted (bytes).

    Raises:
        WireError: the body is too long.
    """
    (length,) = PREFIX.unpack(prefix)
    if length > largest:
        raise WireError(f"a frame of {length} bytes is too long; the limit is {largest}")
    return length


def hello(token: str = "") -> list[object]:
    """Return the first message of a client.

    Args:
        token: the server's token; "" for a server without one.
    """
    return [*HELLO, token] if token else list(HELLO)


def check_hello(message: object, token: str = "") -> None:
    """Check the first message of the other side.

    Args:
        message: it, decoded.
        token: the token that it has to bring; "" for none.

    Raises:
        WireError: it is not the greeting of this protocol version, or brings another token.
    """
    match message:
        case [*plain] if plain == HELLO and not token:
            return
        case [*plain, str(given)] if plain == HELLO:
            if token and not hmac.compare_digest(given.encode(), token.encode()):
                raise WireError("the token is wrong; give the one that the server printed")
            return
        case [*plain] if plain == HELLO:
            raise WireError('the server requires its token; connect(..., options="--token=TOKEN")')
    raise WireError(f"expected {HELLO}, got {shortened(message)}; both sides need the same Roboyard")


def shortened(value: object) -> str:
    """Return the beginning of what `repr` says, without forming all of it."""
    return _SHORT.repr(value)[:60]


def tupled(value: Any) -> Any:
    """Return `value` with every list as a tuple, as the functions of the API return them."""
    if isinstance(value, list):
        return tuple(tupled(item) for item in value)
    if isinstance(value, Mapping):
        return {key: tupled(item) for key, item in value.items()}
    return value


def _to_wire(value: object) -> object:
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in _PLAIN_KINDS:
            raise TypeError(f"arrays of {value.dtype} cannot be sent to a server")
        array = np.ascontiguousarray(value)
        return msgspec.msgpack.Ext(
            _ARRAY,
            msgspec.msgpack.encode([array.dtype.str, value.shape, array.reshape(-1).view(np.uint8).data]),
        )
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Iterable):
        return list(value)
    raise TypeError(f"a {type(value).__name__} cannot be sent to a server")


def _from_wire(code: int, data: memoryview) -> object:
    if code != _ARRAY:
        raise ValueError(f"unknown extension {code}")
    if not is_array_head(data):
        raise ValueError("an array is [dtype, shape, bytes]")
    name, shape, raw = _ARRAY_DECODER.decode(data)
    if not _DTYPE.fullmatch(name):  # NumPy reads longer ones as Python
        raise ValueError(f"unknown kind of array {name!r}")
    dtype = np.dtype(name)
    if (
        dtype.kind not in _PLAIN_KINDS
        or min(shape, default=0) < 0
        or prod(shape) * dtype.itemsize != len(raw)
    ):
        raise ValueError(f"an array of {name} and shape {shape} does not have {len(raw)} bytes")
    return np.frombuffer(bytearray(raw), dtype=dtype).reshape(shape)


_SHORT = Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 2, 40, 40
_ENCODER = msgspec.msgpack.Encoder(enc_hook=_to_wire)
_DECODER = msgspec.msgpack.Decoder(ext_hook=_from_wire)
_ARRAY_DECODER = msgspec.msgpack.Decoder(tuple[str, list[int], bytes])
