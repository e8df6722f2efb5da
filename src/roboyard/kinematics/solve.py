"""Inverse kinematics to a tolerance: one target or many, one tip or several."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.kinematics._inputs import (
    INVALID,
    joint_vector,
    read_batch,
    read_starts,
    read_targets,
    task_weights,
)
from roboyard.kinematics._work import work_space
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array

_kernels = lazy_module("roboyard.kinematics._lm")
_rest_kernels = lazy_module("roboyard.kinematics._rest")

_CANDIDATES = 8  # random postures for each restart; the descent starts from the one nearest the target


@dataclass(frozen=True, kw_only=True, slots=True)
class IKResult:
    """Solution of one inverse kinematics problem, with its errors."""

    q: Array
    """(n,) joint positions inside the limits (rad or m), in the order of the chain's `joint_names`."""
    position_error: float
    """Largest position error of a tip (m), over the axes with a weight."""
    orientation_error: float
    """Largest orientation error of a tip (rad), over the axes with a weight."""
    converged: bool
    """Whether every tip is within both tolerances."""
    iterations: int
    """Number of linear solves, over all descents."""
    descents: int
    """Number of descents: 1 plus the number of restarts."""


@dataclass(frozen=True, kw_only=True, slots=True)
class IKBatchResult:
    """Solutions for many targets; fields as in `IKResult`, with one row per target."""

    q: Array
    """(b, n) joint positions (rad or m)."""
    position_error: Array
    """(b,) largest position errors (m)."""
    orientation_error: Array
    """(b,) largest orientation errors (rad)."""
    converged: NDArray[np.bool_]
    """(b,) whether every tip is within both tolerances."""
    iterations: NDArray[np.int64]
    """(b,) number of linear solves."""
    descents: NDArray[np.int64]
    """(b,) number of descents."""


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
    """Return joint positions that bring the chain's tips to their targets, and the remaining errors.

    Levenberg-Marquardt within the joint limits from `q0`; where that does not converge, again from random
    postures (the same for the same `seed`). With `rest`, the solution then moves in the null space towards
    that posture while it stays within the tolerances. Continuous joints end within half a turn of `q0`. An
    unreachable target gives the nearest posture found, with `converged` False.

    Args:
        chain: the joints to move.
        targets: poses of the tips in the frame of `chain.base_link`. For one tip (3,) a position (m) alone,
            (7,) position and quaternion (x, y, z, w), or (4, 4) a homogeneous matrix; for t tips (t, 3),
            (t, 7) or (t, 4, 4) in the order of `chain.tips`.
        q0: (n,) start (rad or m), clipped to the limits; the middle of the limits by default.
        tolerance_position: largest position error of a solution (m).
        tolerance_orientation: largest orientation error of a solution (rad).
        iterations: most linear solves of each descent.
        restarts: most random starts after the first.
        position_weights: scalar, (3,) or (t, 3) weights of the errors along the base frame's x, y, z (1/m).
        orientation_weights: scalar, (3,) or (t, 3) weights of the errors about the target's x, y, z (1/rad).
            Weight 0 frees an axis; the tolerances apply to weighted axes only.
        rest: (n,) preferred posture (rad or m).
        rest_weights: scalar or (n,) weights of the joints in the distance to `rest`.
        rest_iterations: most steps towards `rest`.
        seed: seed of the restarts.

    Raises:
        ValueError: an array has the wrong shape, or a target, weight or start is not finite.
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
        raise ValueError(f"the target{INVALID}")
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
    """Solve `solve_ik` for many targets in one call, which releases the interpreter lock.

    Args:
        chain: the joints to move.
        targets: (b, ...) of what `solve_ik` takes; for t tips (b, t, 3), (b, t, 7) or (b, t, 4, 4).
        q0: (n,) start for all targets, or (b, n); rad or m.
        warm_start: start each target from the previous solution if that converged; for paths.
        tolerance_position: as in `solve_ik`.
        tolerance_orientation: as in `solve_ik`.
        iterations: as in `solve_ik`.
        restarts: as in `solve_ik`.
        position_weights: as in `solve_ik`.
        orientation_weights: as in `solve_ik`.
        rest: as in `solve_ik`.
        rest_weights: as in `solve_ik`.
        rest_iterations: as in `solve_ik`.
        seed: seed of the first target; each further target adds 1.

    Raises:
        ValueError: as `solve_ik`; the message names the first invalid target.
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
        raise ValueError(f"target {int(np.argmax(out[:, n + 5]))}{INVALID}")
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
    """Return (b, n + 6) rows of `_lm.solve`.

    Args:
        chain: the joints to move.
        targets: (b, t, k) as of `read_batch`.
        q0: (1 or b, n) starts (rad or m).
        warm: as `warm_start` of `solve_ik_batch`.
        budget: tolerances (m, rad), iterations, restarts, seed.
        weights: position and orientation weights.
        rest: posture (rad or m), its weights and iterations.
    """
    whole, real = chain.nodes
    node, local = chain.tip_frames
    tasks = task_weights(len(node), targets.shape[2], *weights)
    position, orientation, iterations, restarts, seed = budget
    out, work = np.empty((len(targets), chain.size + 6)), work_space(chain)
    _kernels().solve(
        whole, real, node, local, chain.ranges, targets, tasks, q0, warm,
        position, orientation, iterations, restarts, _CANDIDATES, seed, *work, out,
    )  # fmt: skip
    if rest[0] is not None:
        scale = joint_vector(chain, rest[1], "rest_weights")
        if scale.min() < 0.0:
            raise ValueError(f"rest_weights must not be negative, got {rest[1]}")
        _rest_kernels().approach_rest(
            whole, real, node, local, chain.ranges, targets, tasks, position, orientation,
            joint_vector(chain, rest[0], "rest"), scale, int(rest[2]), *work, out,
        )  # fmt: skip
    return out
