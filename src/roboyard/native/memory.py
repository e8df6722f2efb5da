"""Images in the memory of the process."""

from __future__ import annotations

import ctypes
import mmap
import os
import sys
from functools import cache
from struct import pack_into
from typing import TYPE_CHECKING, Any
from zlib import crc32

if TYPE_CHECKING:
    from roboyard.native.images import Image

StoredImage = tuple[int, int, int, int, tuple[tuple[int, int], ...], tuple[tuple[int, str], ...]]
"""Where the code of an image is in its file, its size and CRC-32, and the image's other values."""

_loaded: list[Any] = []  # the memory of images, which stays
_offered: list[Any] = []
"""Libraries whose functions images may call."""


def offer(library: Any) -> None:
    """Let images call functions of a library, a `ctypes.CDLL`."""
    if library not in _offered:
        _offered.append(library)
        function_address.cache_clear()


@cache
def images_can_be_loaded() -> bool:
    """Return whether this process executes images: x86-64 Linux."""
    return sys.platform == "linux" and os.uname().machine == "x86_64" and ctypes.sizeof(ctypes.c_void_p) == 8


def load_image(image: Image) -> int:
    """Return the address of an image's function; 0 where the system does not execute it."""
    memory = _memory(len(image.code))
    if memory is None:
        return 0
    memory[:] = image.code
    return _entered(memory, image.entry, image.own, image.others)


def stored_image(image: Image, file_size: int) -> StoredImage:
    """Return what `load_stored` needs of an image, whose code is the end of a file."""
    size = len(image.code)
    return file_size - size, size, crc32(image.code), image.entry, image.own, image.others


def load_stored(path: str, image: StoredImage) -> int:
    """Return the address of the function of an image in a file; 0 where it cannot be read or executed."""
    start, size, sum_of_bytes, entry, own, others = image
    memory = _memory(size)
    if memory is None:
        return 0
    try:
        file = os.open(path, os.O_RDONLY)
        try:
            is_whole = os.preadv(file, [memory], start) == size and os.fstat(file).st_size == start + size
        finally:
            os.close(file)
    except OSError:
        return 0
    return _entered(memory, entry, own, others) if is_whole and crc32(memory) == sum_of_bytes else 0


def _memory(size: int) -> mmap.mmap | None:
    try:
        return mmap.mmap(-1, size, mmap.MAP_PRIVATE, mmap.PROT_READ | mmap.PROT_WRITE)
    except OSError:
        return None


def _entered(
    memory: mmap.mmap, entry: int, own: tuple[tuple[int, int], ...], others: tuple[tuple[int, str], ...]
) -> int:
    """Return the address of the function of an image in memory; 0 where the system does not execute it."""
    addresses = [(place, function_address(name)) for place, name in others]
    if not all(address for _, address in addresses):
        return 0
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for place, address in (*addresses, *((place, base + target) for place, target in own)):
        pack_into("<Q", memory, place, address)
    if _protect()(base, len(memory), mmap.PROT_READ | mmap.PROT_EXEC):
        return 0
    _loaded.append(memory)
    return base + entry


def missing_functions(image: Image) -> list[str]:
    """Return the names of functions that an image calls and that a process without numba does not have."""
    return sorted({name for _, name in image.others if not function_address(name)})


@cache
def function_address(name: str) -> int:
    """Return the address of a function of the process, or of mathematics or offered ones; 0 for none."""
    for library in (ctypes.pythonapi, _mathematics(), *_offered):
        function = getattr(library, name, None)
        if function is not None:
            return ctypes.cast(function, ctypes.c_void_p).value or 0
    return 0


@cache
def _mathematics() -> Any:
    try:
        return ctypes.CDLL("libm.so.6")
    except OSError:
        return None


@cache
def _protect() -> Any:
    function = ctypes.CDLL(None).mprotect
    function.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    return function
