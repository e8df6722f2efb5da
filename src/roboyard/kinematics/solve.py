"""Inverse kinematics to a tolerance: one target or many, one tip or several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboyard._lazy import lazy_module
from roboyard.kinematics._inputs import (
    UNREADABLE,
    joint_vector,
    read_batch,
    read_starts,
    read_targets,
    task_weights,
)
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.kinematics._lm")
_rest_kernels = lazy_module("roboyard.kinematics._settle")

_CANDIDATES = 8  # random postures looked at for each restart; the one nearest the target is descended from


@dataclass(frozen=True, kw_only=True, slots=True)
class IKResult:
    """An answer with its quality."""

    q: Array
    """(n,) joint positions inside the limits, in the chain's `joint_names` order; rad or m."""
    position_error: float
    """m; of the worst tip, over the axes that have a weight."""
    orientation_error: float
    """rad; of the worst tip, over the axes that have a weight."""
    converged: bool
    """True where every tip is within both tolerances."""
    iterations: int
    """Linear solves spent, over all descents."""
    descents: int
    """1 where the first start sufficed, plus one for every restart."""


@dataclass(frozen=True, kw_only=True, slots=True)
class IKBatchResult:
    """Answers to many targets; each field as in `IKResult`, one row a target."""

    q: Array
    """(b, n)"""
    position_error: Array
    """(b,) m"""
    orientation_error: Array
    """(b,) rad"""
    converged: NDArray[np.bool_]
    """(b,)"""
    iterations: NDArray[np.int64]
    """(b,)"""
    descents: NDArray[np.int64]
    """(b,)"""


def solve_ik(
    chain: ChainArrays,
    targets: ArrayLike,
    q0: ArrayLike | None = None,
    *,
    tolerance_position: float = 1e-4,
    tolerance_orientation: float = 1e-3,
    iterations: int = 40,
    restarts: int = 50,
    position_weights: ArrayLike = 1.0,
    orientation_weights: ArrayLike = 0.5,
    rest: ArrayLike | None = None,
    rest_weights: ArrayLike = 1.0,
    rest_iterations: int = 40,
    seed: int = 0,
) -> IKResult:
    """Joint positions that bring the chain's tips to their targets, with the error that is left.

    Levenberg-Marquardt within the joint limits from `q0`; when it ends elsewhere, again from random postures
    (the same ones for the same `seed`). With `rest`, the answer then slides along the solutions towards that
    posture as long as it stays within the tolerances. Joints that turn freely come back within half a turn of
    `q0`. An unreachable target gives the nearest posture found, `converged` False.

    Args:
        chain: what to move.
        targets: poses of the tips in the frame of `chain.base_link`. For one tip (3,) a position alone,
            (7,) position and quaternion (x, y, z, w), or (4, 4) a homogeneous matrix; for t tips (t, 3),
            (t, 7) or (t, 4, 4) in the order of `chain.tips`.
        q0: (n,) start; values outside the limits are brought to them. The middle of the limits by default.
        tolerance_position: m.
        tolerance_orientation: rad.
        iterations: most linear solves for each descent.
        restarts: most random starts after the first.
        position_weights: scalar, (3,) or (t, 3), of the errors along the base frame's x, y, z; 1/m.
        orientation_weights: scalar, (3,) or (t, 3), of the errors about the target's x, y, z; 1/rad.
            Weight 0 leaves an axis free; only weighted axes count towards the tolerances.
        rest: (n,) preferred posture.
        rest_weights: scalar or (n,), how much each joint matters in the distance to `rest`.
        rest_iterations: most steps towards `rest`.
        seed: of the restarts.

    Raises:
        ValueError: an array's shape does not fit, or a target, weight or start is not a number.
    """
    out = _run(
        chain,
        read_targets(chain, targets)[None],
        read_starts(chain, q0, 1),
        False,
        (float(tolerance_position), float(tolerance_orientation), int(iterations), int(restarts), int(seed)),
        (position_weights, orientation_weights),
        (rest, rest_weights, rest_iterations),
    )
    n = chain.size
    position_error, orientation_error, converged, used, descents, bad = out[0, n:].tolist()
    if bad:
        raise ValueError(f"the target{UNREADABLE}")
    return IKResult(
        q=out[0, :n],
        position_error=position_error,
        orientation_error=orientation_error,
        converged=converged == 1.0,
        iterations=int(used),
        descents=int(descents),
    )


def solve_ik_batch(
    chain: ChainArrays,
    targets: ArrayLike,
    q0: ArrayLike | None = None,
    *,
    warm_start: bool = False,
    tolerance_position: float = 1e-4,
    tolerance_orientation: float = 1e-3,
    iterations: int = 40,
    restarts: int = 50,
    position_weights: ArrayLike = 1.0,
    orientation_weights: ArrayLike = 0.5,
    rest: ArrayLike | None = None,
    rest_weights: ArrayLike = 1.0,
    rest_iterations: int = 40,
    seed: int = 0,
) -> IKBatchResult:
    """`solve_ik` for many targets in one call, which releases the interpreter lock.

    Args:
        chain: what to move.
        targets: (b, ...) of what `solve_ik` takes; for t tips (b, t, 3), (b, t, 7) or (b, t, 4, 4).
        q0: (n,) for all, or (b, n).
        warm_start: start each target from the answer before it where that converged; for paths.
        tolerance_position, tolerance_orientation, iterations, restarts: as in `solve_ik`.
        position_weights, orientation_weights, rest, rest_weights, rest_iterations: as in `solve_ik`.
        seed: of the first target; the next ones count up.

    Raises:
        ValueError: as `solve_ik`, naming the first target that cannot be read.
    """
    many = read_batch(chain, targets)
    out = _run(
        chain,
        many,
        read_starts(chain, q0, len(many)),
        bool(warm_start),
        (float(tolerance_position), float(tolerance_orientation), int(iterations), int(restarts), int(seed)),
        (position_weights, orientation_weights),
        (rest, rest_weights, rest_iterations),
    )
    n = chain.size
    if out[:, n + 5].any():
        raise ValueError(f"target {int(np.argmax(out[:, n + 5]))}{UNREADABLE}")
    return IKBatchResult(
        q=out[:, :n],
        position_error=out[:, n],
        orientation_error=out[:, n + 1],
        converged=out[:, n + 2] == 1.0,
        iterations=out[:, n + 3].astype(np.int64),
        descents=out[:, n + 4].astype(np.int64),
    )


def _run(
    chain: ChainArrays,
    targets: Array,
    q0: Array,
    warm: bool,
    budget: tuple[float, float, int, int, int],
    weights: tuple[ArrayLike, ArrayLike],
    rest: tuple[ArrayLike | None, ArrayLike, int],
) -> Array:
    """(b, n + 6) rows of `_lm.solve`; budget: tolerances, iterations, restarts, seed; rest: also in order."""
    whole, real = chain.nodes
    node, local = chain.tip_frames
    tasks = task_weights(len(node), targets.shape[2], *weights)
    position, orientation, iterations, restarts, seed = budget
    out = np.empty((len(targets), chain.size + 6))
    _kernels().solve(
        whole, real, node, local, chain.ranges, targets, tasks, q0, warm,
        position, orientation, iterations, restarts, _CANDIDATES, seed, out,
    )  # fmt: skip
    if rest[0] is not None:
        scale = joint_vector(chain, rest[1], "rest_weights")
        if scale.min() < 0.0:
            raise ValueError("rest_weights must not be negative")
        _rest_kernels().settle(
            whole, real, node, local, chain.ranges, targets, tasks, position, orientation,
            joint_vector(chain, rest[0], "rest"), scale, int(rest[2]), out,
        )  # fmt: skip
    return out
