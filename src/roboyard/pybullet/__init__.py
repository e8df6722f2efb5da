"""PyBullet's API on Roboyard's engine: the same functions, constants, ids, return values and errors.

    import roboyard.pybullet as p

    p.connect(p.DIRECT)

or, for an unmodified script: `roboyard run script.py`. The functions are thin: they check PyBullet's
arguments, call `roboyard.sim`, and return the results as PyBullet does.
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
