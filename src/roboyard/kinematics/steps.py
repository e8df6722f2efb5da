"""Differential inverse kinematics for controllers, one step per call, and PyBullet's damped iteration."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._lazy import lazy_module
from roboyard.kinematics._inputs import joint_vector, read_targets, task_weights
from roboyard.kinematics._work import work_space
from roboyard.kinematics.chain import ChainArrays
from roboyard.transforms import Array

_NONE = np.zeros(0)


_kernels = lazy_module("roboyard.kinematics._steps")


def differential_step(
    chain: ChainArrays,
    q: ArrayLike,
    targets: ArrayLike,
    *,
    gain: float = 1.0,
    damping: float = 0.05,
    max_step: ArrayLike | None = None,
    rest: ArrayLike | None = None,
    rest_gain: float = 0.1,
    position_weights: ArrayLike = 1.0,
    orientation_weights: ArrayLike = 1.0,
) -> Array:
    """Return joint positions after one damped least-squares step towards the targets, inside the limits.

    The step d minimises |J d - gain · e|² + damping² |d|² within the joint limits and `max_step`; joints that
    reach a bound stay there and the others compensate. The motion towards `rest` is in the null space of J.

    Args:
        chain: the joints to move.
        q: (n,) measured or last commanded joint positions (rad or m); values outside the limits return to
            them.
        targets: as in `solve_ik`.
        gain: share of the error to remove: 1 for all, rate · dt for an exponential approach.
        damping: larger values give smaller, slower steps near singular postures (m/rad or rad/rad).
        max_step: scalar or (n,) largest motion of each joint (rad or m), such as `chain.velocity * dt`.
        rest: (n,) preferred posture (rad or m) for the null space.
        rest_gain: share of the distance to `rest` in one step.
        position_weights: as in `solve_ik`.
        orientation_weights: as in `solve_ik`.

    Returns:
        (n,) new joint positions (rad or m).

    Raises:
        ValueError: an array has the wrong shape, or a value is not finite.
    """
    values, bound = _state(chain, q, max_step)
    goals = read_targets(chain, targets)
    node, local = chain.tip_frames
    weights = task_weights(len(node), goals.shape[1], position_weights, orientation_weights)
    pull = np.zeros(chain.size) if rest is None else rest_gain * (joint_vector(chain, rest, "rest") - values)
    low, high = _within(chain.lower - values, bound), _within(chain.upper - values, bound)
    whole, real = chain.nodes
    move = np.empty(chain.size)
    good = _kernels().step_to_targets(
        whole,
        real,
        node,
        local,
        goals,
        weights,
        values,
        float(gain),
        float(damping) ** 2,
        low,
        high,
        pull,
        *work_space(chain),
        move,
    )
    if not good:
        raise ValueError(
            f"q and targets must be finite and quaternions longer than 0, got q={values.tolist()}, "
            f"targets={goals.tolist()}"
        )
    move += values
    return move


def differential_velocity(
    chain: ChainArrays,
    q: ArrayLike,
    twists: ArrayLike,
    dt: float,
    *,
    damping: float = 0.05,
    max_velocity: ArrayLike | None = None,
    rest: ArrayLike | None = None,
    rest_gain: float = 1.0,
    position_weights: ArrayLike = 1.0,
    orientation_weights: ArrayLike = 1.0,
) -> Array:
    """Return joint velocities that give the tips the requested twists and exceed no limit within `dt`.

    Args:
        chain: the joints to move.
        q: (n,) joint positions (rad or m).
        twists: (6,), or (t, 6) for t tips: linear velocity of the tip's origin (m/s), then angular velocity
            (rad/s), both along the base link's axes.
        dt: time for which the velocities are applied (s).
        damping: as in `differential_step`.
        max_velocity: scalar or (n,) limits (rad/s or m/s); the description's by default.
        rest: (n,) preferred posture (rad or m) for the null space.
        rest_gain: rate of the motion towards `rest` (1/s).
        position_weights: as in `solve_ik`, along base axes.
        orientation_weights: as in `solve_ik`, along base axes.

    Returns:
        (n,) joint velocities (rad/s or m/s).

    Raises:
        ValueError: an array has the wrong shape, or a value is not finite.
    """
    if not dt > 0.0:
        raise ValueError(f"dt must be positive (s), got {dt}")
    values, bound = _state(chain, q, chain.velocity if max_velocity is None else max_velocity)
    node, local = chain.tip_frames
    given = np.array(twists, dtype=float, order="C")
    if given.shape != (len(node), 6) and not (given.shape == (6,) and len(node) == 1):
        raise ValueError(f"twists have shape {given.shape}; give ({len(node)}, 6)")
    if not (np.isfinite(given).all() and np.isfinite(values).all()):
        raise ValueError(f"q and twists must be finite, got {values.tolist()} and {given.tolist()}")
    weights = task_weights(len(node), 6, position_weights, orientation_weights)
    pull = np.zeros(chain.size) if rest is None else rest_gain * (joint_vector(chain, rest, "rest") - values)
    low, high = _within((chain.lower - values) / dt, bound), _within((chain.upper - values) / dt, bound)
    whole, real = chain.nodes
    velocity = np.empty(chain.size)
    _kernels().step_with_twists(
        whole, real, node, local, given.reshape(-1, 6), weights, values, float(damping) ** 2, low, high,
        pull, *work_space(chain), velocity,
    )  # fmt: skip
    return velocity


def damped_step_ik(
    chain: ChainArrays,
    q0: ArrayLike,
    target: ArrayLike,
    *,
    iterations: int = 20,
    residual_threshold: float = 1e-4,
    joint_damping: ArrayLike | None = None,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    ranges: ArrayLike | None = None,
    rest: ArrayLike | None = None,
) -> Array:
    """Return joint positions after a fixed number of damped steps, as PyBullet's inverse kinematics does.

    Every step from q0 solves (JᵀJ + D) d = Jᵀ e, where D is 0.5 or the joint damping given, and is scaled
    so that no joint moves by more than 45 degrees. A target half a turn away is approached from the side
    that PyBullet takes. It ignores joint limits and does not check convergence: use `solve_ik` where
    these matter. With all four null-space arguments D is 0.36, and a weak motion towards `rest` and a
    strong one back into `lower`..`upper` are projected on the
    null space of the damped pseudo-inverse. Constants were measured on PyBullet 3.2.7.

    Args:
        chain: the joints; the result has one value for each.
        q0: (n,) start (rad or m).
        target: as in `solve_ik`; a position alone, (3,) in m, frees the orientation.
        iterations: most steps.
        residual_threshold: the step that starts nearer than this to the target (m) is the last.
        joint_damping: scalar or (n,) D; ignored with the null-space arguments.
        lower: (n,) lower end of the null-space motion (rad or m).
        upper: (n,) upper end of the null-space motion (rad or m).
        ranges: (n,) width that scales the distance beyond a limit (rad or m).
        rest: (n,) target of the null-space motion (rad or m).

    Returns:
        (n,) joint positions.

    Raises:
        ValueError: an array has the wrong shape, or only some of the null-space arguments are given.
    """
    q = joint_vector(chain, q0, "q0")
    goals = read_targets(chain, target)
    names, pulls = ("lower", "upper", "ranges", "rest"), (lower, upper, ranges, rest)
    if all(value is None for value in pulls):
        low = high = width = posture = _NONE
        if joint_damping is None:
            damping = _same_damping(chain.size)
        else:
            damping = joint_vector(chain, joint_damping, "joint_damping")
    elif any(value is None for value in pulls):
        missing = [name for name, value in zip(names, pulls, strict=True) if value is None]
        raise ValueError(f"lower, upper, ranges and rest belong together; {', '.join(missing)} missing")
    else:
        low, high, width, posture = (
            joint_vector(chain, value, name)  # type: ignore[arg-type]
            for name, value in zip(names, pulls, strict=True)
        )
        damping = np.full(chain.size, _NULL_SPACE_DAMPING)
    pulled = posture, low, high, width
    return _descend(chain, q, goals, damping, pulled, float(residual_threshold), int(iterations))


def plain_steps(chain: ChainArrays, q: Array, goals: Array, residual_threshold: float, most: int) -> Array:
    """Do what `damped_step_ik` does without damping or pulls, and without a look at the arrays.

    Args:
        chain: the joints.
        q: (n,) start (rad or m); it becomes the result.
        goals: (t, 3) positions (m), or (t, 7) with quaternions x, y, z, w.
        residual_threshold: the step that starts nearer than this to the target (m) is the last.
        most: number of steps.

    Returns:
        (n,) joint positions.

    Raises:
        ValueError: a goal is not finite, or a quaternion has no length.
    """
    return _descend(chain, q, goals, _same_damping(chain.size), _NO_PULLS, residual_threshold, most)


def _descend(
    chain: ChainArrays,
    q: Array,
    goals: Array,
    damping: Array,
    pulls: tuple[Array, ...],
    threshold: float,
    most: int,
) -> Array:
    whole, real = chain.nodes
    node, local = chain.tip_frames
    size, per = chain.size, 3 if goals.shape[1] == 3 else 6
    used = _kernels().plain_descent(
        whole, real, node, local, goals, damping, *pulls,
        _REST_GAIN, _LIMIT_GAIN, _LONGEST_STEP, threshold, most,
        np.empty((size, 6)), np.empty((size, per * len(node))), *work_space(chain), q,
    )  # fmt: skip
    if used < 0:
        raise ValueError(f"target must be finite and quaternions longer than 0, got {goals.tolist()}")
    return q


# Measured on PyBullet 3.2.7 by single steps on its arms.
_DAMPING = 0.5
_NULL_SPACE_DAMPING = 0.36
_REST_GAIN = 0.001
_LIMIT_GAIN = 10.0
_LONGEST_STEP = np.pi / 4
_NO_PULLS = (_NONE,) * 4


@lru_cache(maxsize=64)
def _same_damping(count: int) -> Array:
    """Return (n,) times the damping of joints that have none of their own; do not write to it."""
    return np.full(count, _DAMPING)


def _state(chain: ChainArrays, q: ArrayLike, bound: ArrayLike | None) -> tuple[Array, Any]:
    values = np.array(q, dtype=float)
    if values.shape != (chain.size,):
        raise ValueError(
            f"q has shape {values.shape}; the chain has {chain.size} joints: {chain.joint_names}"
        )
    if bound is None:
        return values, None
    if bound is not chain.velocity:
        bound = np.asarray(bound, dtype=float)
        if bound.shape not in ((), (chain.size,)) or not bound.min() >= 0.0:
            raise ValueError(
                f"the bound of a joint's motion must be one positive number or one per joint, got {bound}"
            )
    return values, bound


def _within(values: Array, bound: Any) -> Array:
    """Return `values` clipped to ±bound."""
    return values if bound is None else np.minimum(np.maximum(values, -bound), bound)
