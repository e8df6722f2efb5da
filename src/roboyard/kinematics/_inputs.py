"""Check callers' arguments and convert them to the arrays that the kernels take."""

from __future__ import annotations

from functools import lru_cache
from math import isfinite

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array

INVALID = " or its start has a value that is not finite, or a quaternion of zero length"


def read_targets(chain: ChainArrays, targets: ArrayLike) -> Array:
    """Return (t, k) targets of one problem: k = 3 position (m), 7 with quaternion, 16 matrix.

    Raises:
        ValueError: another shape.
    """
    return _flat(np.array(targets, dtype=float, order="C"), (), len(chain.tips))


def read_batch(chain: ChainArrays, targets: ArrayLike) -> Array:
    """Return (b, t, k) targets of many problems, k as in `read_targets`.

    Raises:
        ValueError: another shape.
    """
    array = np.array(targets, dtype=float, order="C")
    return _flat(array, array.shape[:1], len(chain.tips))


def _flat(array: Array, front: tuple[int, ...], t: int) -> Array:
    shape = array.shape[len(front) :]
    if shape == (t, 4, 4) or (t == 1 and shape == (4, 4)):
        return array.reshape(*front, t, 16)
    if shape in ((t, 3), (t, 7)) or (t == 1 and shape in ((3,), (7,))):
        return array.reshape(*front, t, shape[-1])
    axes = ("b, " if front else "") + ("" if t == 1 else f"{t}, ")
    expected = " or ".join(f"({axes}{size})" for size in ("3", "7", "4, 4"))
    raise ValueError(f"targets have shape {array.shape}; give {expected} for {t} tip{'s' if t > 1 else ''}")


def read_starts(chain: ChainArrays, q0: ArrayLike | None, batch: int) -> Array:
    """Return (1 or batch, n) start postures (rad or m), the middle of the limits for None.

    Raises:
        ValueError: another shape.
    """
    array = np.array(chain.middle if q0 is None else q0, dtype=float, order="C")
    if array.ndim == 1:
        array = array[None]
    if array.ndim != 2 or array.shape[1] != chain.size or len(array) not in (1, batch):
        raise ValueError(wrong_size(chain, "q0", array.shape if q0 is None else np.shape(q0)))
    return array


def joint_vector(chain: ChainArrays, values: ArrayLike, what: str) -> Array:
    """Return an (n,) copy of `values`, a scalar repeated for all joints.

    Raises:
        ValueError: another shape, or a value is not finite; the message calls the argument `what`.
    """
    array, size = np.array(values, dtype=float), chain.size
    if array.ndim == 0:
        array = np.full(size, float(array))
    if array.shape != (size,):
        raise ValueError(wrong_size(chain, what, array.shape))
    if not (isfinite(array.sum()) or np.isfinite(array).all()):  # large numbers have no finite sum
        raise ValueError(f"{what} must be finite, got {array.tolist()}")
    return array


def wrong_size(chain: ChainArrays, what: str, shape: tuple[int, ...]) -> str:
    """Return the message for a joint vector of the wrong length."""
    names = ", ".join(chain.joint_names[:12]) + (", ..." if chain.size > 12 else "")
    return f"{what} has shape {shape}; the chain has {chain.size} joints ({names})"


def task_weights(t: int, width: int, position: ArrayLike, orientation: ArrayLike) -> Array:
    """Return (t, 6) weights of the errors along x, y, z (1/m) and about them (1/rad); do not write to them.

    Raises:
        ValueError: shapes that do not fit, or a weight that is negative or not finite.
    """
    if isinstance(position, float) and isinstance(orientation, float):
        return _scalar_weights(t, width, position, orientation)
    return _task_weights(t, width, position, orientation)


@lru_cache(maxsize=64)
def _scalar_weights(t: int, width: int, position: float, orientation: float) -> Array:
    return _task_weights(t, width, position, orientation)


def _task_weights(t: int, width: int, position: ArrayLike, orientation: ArrayLike) -> Array:
    weights = np.empty((t, 6))
    try:
        weights[:, :3] = position
        weights[:, 3:] = orientation
    except ValueError:
        shapes = f"{np.shape(position)} and {np.shape(orientation)}"
        message = f"position and orientation weights have shapes {shapes}; give scalars, (3,) or ({t}, 3)"
        raise ValueError(message) from None
    if width == 3:
        weights[:, 3:] = 0.0
    if not (weights.min() >= 0.0 and weights.max() < np.inf):
        raise ValueError(f"weights must be finite and not negative, got {position} and {orientation}")
    return weights
