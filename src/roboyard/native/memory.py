"""Images in the memory of the process."""

from __future__ import annotations

import ctypes
import mmap
import os
import sys
from functools import cache
from struct import pack_into
from typing import Any

from roboyard.native.images import Image

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
    addresses = [(place, function_address(name)) for place, name in image.others]
    if not all(address for _, address in addresses):
        return 0
    try:
        memory = mmap.mmap(-1, len(image.code), mmap.MAP_PRIVATE, mmap.PROT_READ | mmap.PROT_WRITE)
    except OSError:
        return 0
    memory[:] = image.code
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for place, address in (*addresses, *((place, base + target) for place, target in image.own)):
        pack_into("<Q", memory, place, address)
    if _protect()(base, len(image.code), mmap.PROT_READ | mmap.PROT_EXEC):
        return 0
    _loaded.append(memory)
    return base + image.entry


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
