"""A drop-in for `pybullet` on Roboyard's own engine: the same functions, constants, ids, layouts and errors.

    import roboyard.pybullet as p

    p.connect(p.DIRECT)

or, for a script as it is: `roboyard run script.py`. The functions are thin: they read PyBullet's arguments,
ask `roboyard.sim`, and lay the answers out as PyBullet does.
"""

from __future__ import annotations

from roboyard.pybullet.face import constants as _constants
from roboyard.pybullet.face.errors import error as error
from roboyard.pybullet.functions import public_functions as _public_functions

_members = {name: value for name, value in vars(_constants).items() if isinstance(value, int)}
_members |= _public_functions()
globals().update(_members)

__all__ = sorted(["error", *_members])  # pyright: ignore[reportUnsupportedDunderAll]


def __dir__() -> list[str]:
    return __all__
