"""MuJoCo's library for what its Python module does not offer."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

from roboyard._mujoco import mujoco


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
