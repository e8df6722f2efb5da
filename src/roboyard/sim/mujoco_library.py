"""MuJoCo's library for what its Python module does not offer."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Sequence
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any
from zlib import crc32

from roboyard._bootstrap import user_cache
from roboyard._bytecode import private_lines, write_for_the_user
from roboyard._mujoco import mujoco

_FORMAT = "roboyard 1"


@cache
def mujoco_library() -> Any:
    """Return MuJoCo's library as this process has it, a `ctypes.CDLL`; None where it is not found."""
    files = sorted(Path(mujoco.__file__).parent.glob("libmujoco.so*"))
    if len(files) != 1:
        return None
    try:
        return ctypes.CDLL(str(files[0]))
    except OSError:
        return None


@cache
def stop_timers() -> bool:
    """Let MuJoCo not ask for the time, a dozen times in a step, to fill `MjData.timer`.

    Returns:
        Whether its timers stand still in this process from now on, where no program has set a clock.
    """
    library = mujoco_library()
    if library is None or mujoco.get_mjcb_time() is not None:
        return False
    try:
        ctypes.c_void_p.in_dll(library, "mjcb_time").value = None
    except ValueError:
        return False
    return True


def stored_numbers(name: str, find: Callable[[], Sequence[int]]) -> list[int]:
    """Return whole numbers that depend on MuJoCo's files alone, from the user's cache or found now.

    Args:
        name: of the numbers; another one where others are looked for.
        find: returns them, to be stored; empty where they cannot be found.
    """
    key = _state_of_files()
    path = f"{user_cache()}/mujoco/numbers-{name}-{crc32(os.fsencode(str(mujoco.__file__))):08x}"
    lines = private_lines(path)
    if key and len(lines) == 3 and (lines[0], lines[2]) == (key, _FORMAT):
        return [int(word) for word in lines[1].split()]
    found = [int(number) for number in find()]
    if key and found:
        text = f"{key}\n{' '.join(map(str, found))}\n{_FORMAT}"
        write_for_the_user(path, [text.encode()])
    return found


def _state_of_files() -> str:
    """Return the place, sizes and times of MuJoCo's files; an empty text where they are not known."""
    folder = os.path.dirname(str(mujoco.__file__))  # noqa: PTH120
    names = f"_structs{EXTENSION_SUFFIXES[0]}", f"libmujoco.so.{mujoco.mj_versionString()}"
    try:
        files = [os.stat(f"{folder}/{name}") for name in names]  # noqa: PTH116
    except OSError:
        return ""
    return " ".join([_FORMAT, folder.encode().hex(), *(f"{s.st_size}:{s.st_mtime_ns}" for s in files)])
