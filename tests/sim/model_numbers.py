"""All numbers of MuJoCo's objects, to be compared."""

from __future__ import annotations

from typing import Any

import numpy as np


def numbers(owner: Any) -> dict[str, Any]:
    """Return the arrays and numbers of an MjModel, MjData or a part of one, by name."""
    found = {name: getattr(owner, name) for name in dir(type(owner)) if not name.startswith("_")}
    kinds = (np.ndarray, float, int)
    return {name: np.array(value) for name, value in found.items() if isinstance(value, kinds)}


def differing(one: Any, other: Any) -> list[str]:
    """Return the names of those that are not the same bit for bit."""
    ours, theirs = numbers(one), numbers(other)
    assert ours.keys() == theirs.keys()
    return [name for name in ours if not np.array_equal(ours[name], theirs[name], equal_nan=True)]
