"""Bounds of a message before it is decoded: lists of empty lists need many times their bytes of memory."""

from __future__ import annotations

PLAIN_BYTES = 8 * 1024 * 1024
"""A body of at most this size is decoded without being counted; the worst needs some 600 MB."""
MAX_ITEMS = 4_000_000
"""Values in a larger body; the bytes of arrays, texts and raw data count as one value each."""
_LENGTHS = {0xC4: 1, 0xC5: 2, 0xC6: 4, 0xD9: 1, 0xDA: 2, 0xDB: 4}
_EXTENSIONS = {0xC7: 1, 0xC8: 2, 0xC9: 4}
_FIXED = {
    0xCA: 4,
    0xCB: 8,
    0xCC: 1,
    0xCD: 2,
    0xCE: 4,
    0xCF: 8,
    0xD0: 1,
    0xD1: 2,
    0xD2: 4,
    0xD3: 8,
    0xD4: 2,
    0xD5: 3,
    0xD6: 5,
    0xD7: 9,
    0xD8: 17,
}


def is_too_much(body: bytes | bytearray | memoryview) -> bool:
    """Return whether a MessagePack body has more values than are decoded."""
    size = len(body)
    if size <= PLAIN_BYTES:
        return False
    at = 0
    for _ in range(MAX_ITEMS):
        if at >= size:
            return False
        code = body[at]
        at += 1
        if 0xA0 <= code <= 0xBF:
            at += code & 0x1F
        elif code in _FIXED:
            at += _FIXED[code]
        elif code in _LENGTHS:
            width = _LENGTHS[code]
            at += width + int.from_bytes(body[at : at + width], "big")
        elif code in _EXTENSIONS:
            width = _EXTENSIONS[code]
            at += width + 1 + int.from_bytes(body[at : at + width], "big")
        elif code in (0xDC, 0xDE):
            at += 2
        elif code in (0xDD, 0xDF):
            at += 4
    return True


def is_array_head(data: memoryview) -> bool:
    """Return whether an extension begins as [dtype, shape of at most 15 numbers, ...] does."""
    head = bytes(data[:40])
    if len(head) < 3 or head[0] != 0x93 or not 0xA0 <= head[1] <= 0xBF:
        return False
    at = 2 + (head[1] & 0x1F)
    return at < len(head) and 0x90 <= head[at] <= 0x9F
