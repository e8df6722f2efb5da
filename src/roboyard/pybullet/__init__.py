"""PyBullet's API on Roboyard's engine: the same functions, constants, ids, return values and errors.

    import roboyard.pybullet as p

    p.connect(p.DIRECT)

or, for an unmodified script: `roboyard run script.py`. The functions are thin: they check PyBullet's
arguments, call `roboyard.sim`, and return the results as PyBullet does.
"""

from __future__ import annotations

from typing import Any

from roboyard.pybullet.ending import end_early as _end_early
from roboyard.pybullet.face import constants as _constants
from roboyard.pybullet.face.errors import error as error
from roboyard.pybullet.functions import NAMES as _NAMES
from roboyard.pybullet.functions import public_function as _public_function

_members = {name: value for name, value in vars(_constants).items() if isinstance(value, int)}
globals().update(_members)

_end_early()

__all__ = sorted(["error", *_members, *_NAMES])  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Return a function of the API, created on first use; raise AttributeError for any other name."""
    function = globals()[name] = _public_function(name)
    if name == "connect":  # clients disconnect when Python ends, when nothing can be imported any more
        globals()["disconnect"] = _public_function("disconnect")
    return function


def __dir__() -> list[str]:
    return __all__
