"""Work space of the compiled loops, kept for each thread and size."""

from __future__ import annotations

import threading

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import NamedTuple
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array


class WorkSpace(NamedTuple):
    """Arrays that a loop writes to, in the order of its arguments: m nodes, n joints, t tips."""

    frames: Array
    """(m, 12)."""
    tip: Array
    """(t, 12)."""
    target: Array
    """(t, 12)."""
    raw: Array
    """(t, 6)."""
    errors: Array
    """(t, 2)."""
    jac: Array
    """(n, 6t)."""
    rhs: Array
    """(6t,)."""
    hessian: Array
    """(n, n)."""
    factor: Array
    """(n, n)."""
    vectors: Array
    """(6, n)."""
    free: NDArray[np.int64]
    """(2n,)."""
    postures: Array
    """(3, n)."""
    state: NDArray[np.uint64]
    """(1,) of the random numbers."""


_kept = threading.local()


def work_space(chain: ChainArrays) -> WorkSpace:
    """Return the work space of a chain; no other thread writes to it."""
    m, n, t = len(chain.parent), chain.size, len(chain.tips)
    spaces: dict[tuple[int, int, int], WorkSpace] = _kept.__dict__.setdefault("spaces", {})
    found = spaces.get((m, n, t))
    if found is None:
        if len(spaces) > 64:
            spaces.clear()
        found = spaces[m, n, t] = WorkSpace(
            frames=np.zeros((m, 12)),
            tip=np.zeros((t, 12)),
            target=np.zeros((t, 12)),
            raw=np.zeros((t, 6)),
            errors=np.zeros((t, 2)),
            jac=np.zeros((n, 6 * t)),
            rhs=np.zeros(6 * t),
            hessian=np.zeros((n, n)),
            factor=np.zeros((n, n)),
            vectors=np.zeros((6, n)),
            free=np.zeros(2 * n, dtype=np.int64),
            postures=np.zeros((3, n)),
            state=np.zeros(1, dtype=np.uint64),
        )
    return found
