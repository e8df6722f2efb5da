"""One step at a time: for controllers that run at every tick, and PyBullet's kind of inverse kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboyard._lazy import lazy_module
from roboyard.kinematics._inputs import joint_vector, read_targets, task_weights
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
    """Joint positions one damped least-squares step nearer to the targets, inside the limits.

    The step d minimises |J d - gain · e|² + damping² |d|² within the joint limits and `max_step`; joints that
    meet a bound stay on it and the others take over. The pull towards `rest` acts in the null space of J.

    Args:
        chain: what moves.
        q: (n,) where the joints are (or were last sent); a value outside its limits is brought back.
        targets: as in `solve_ik`.
        gain: share of the error to remove; 1 for all of it, rate · dt for exponential approach.
        damping: m or rad per rad; larger is calmer near singular postures and slower.
        max_step: scalar or (n,), largest move of each joint, as `chain.velocity * dt`.
        rest: (n,) posture that the free motion goes to.
        rest_gain: share of the way to `rest` in one step.
        position_weights, orientation_weights: as in `solve_ik`.

    Returns:
        (n,) new joint positions.

    Raises:
        ValueError: a shape does not fit, or a value is not finite.
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
        move,
    )
    if not good:
        raise ValueError("q or a target holds a value that is not finite, or a quaternion has zero length")
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
    """Joint velocities that give the tips the velocities asked for, and pass no limit within `dt`.

    Args:
        chain: what moves.
        q: (n,) joint positions.
        twists: (6,), or (t, 6) for t tips: linear velocity of the tip's origin (m/s), then angular velocity
            (rad/s), both in the base link's axes.
        dt: s, how long the answer will be held.
        damping: as in `differential_step`.
        max_velocity: scalar or (n,), rad/s or m/s; the description's limits by default.
        rest: (n,) posture that the free motion goes to.
        rest_gain: 1/s.
        position_weights, orientation_weights: as in `solve_ik`, here both along base axes.

    Returns:
        (n,) rad/s or m/s.

    Raises:
        ValueError: a shape does not fit, or a value is not finite.
    """
    if not dt > 0.0:
        raise ValueError(f"dt is {dt}; give a positive number of seconds")
    values, bound = _state(chain, q, chain.velocity if max_velocity is None else max_velocity)
    node, local = chain.tip_frames
    wanted = np.array(twists, dtype=float)
    if wanted.shape != (len(node), 6) and not (wanted.shape == (6,) and len(node) == 1):
        raise ValueError(f"twists have shape {wanted.shape}; give ({len(node)}, 6)")
    if not (np.isfinite(wanted).all() and np.isfinite(values).all()):
        raise ValueError("q or twists hold a value that is not finite")
    weights = task_weights(len(node), 6, position_weights, orientation_weights)
    pull = np.zeros(chain.size) if rest is None else rest_gain * (joint_vector(chain, rest, "rest") - values)
    low, high = _within((chain.lower - values) / dt, bound), _within((chain.upper - values) / dt, bound)
    whole, real = chain.nodes
    velocity = np.empty(chain.size)
    _kernels().step_with_twists(
        whole, real, node, local, wanted.reshape(-1, 6), weights, values, float(damping) ** 2, low, high,
        pull, velocity,
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
    """Joint positions after a fixed number of plain damped steps: what PyBullet's inverse kinematics answers.

    Every step from q0 solves (JᵀJ + D) d = Jᵀ e, where D is 0.5 or the joint damping given, and is scaled so
    that no joint moves by more than 45 degrees. Neither the joint limits nor whether the target was reached
    play a part: use `solve_ik` for an answer that holds. With all four null-space arguments D is 0.36, and a
    weak pull towards `rest` and a strong one back inside `lower`..`upper` are projected on the null space of
    the damped pseudo-inverse.

    Args:
        chain: joints, whole or in part; the answer has one value for each.
        q0: (n,) start.
        target: as in `solve_ik`; a position alone, (3,), leaves the orientation free.
        iterations: most steps.
        residual_threshold: m; the step that starts with a smaller distance is the last.
        joint_damping: scalar or (n,), D; not used together with the null-space arguments.
        lower, upper: (n,) range that the null-space motion keeps to.
        ranges: (n,) width by which a passed limit is measured.
        rest: (n,) posture that the null-space motion goes to.

    Returns:
        (n,) joint positions.

    Raises:
        ValueError: a shape does not fit, or only some of the null-space arguments are given.
    """
    q = joint_vector(chain, q0, "q0")
    goals = read_targets(chain, target)
    pulls = [lower, upper, ranges, rest]
    if all(value is None for value in pulls):
        low = high = width = posture = _NONE
        damping = joint_vector(chain, _DAMPING if joint_damping is None else joint_damping, "joint_damping")
    elif any(value is None for value in pulls):
        raise ValueError("lower, upper, ranges and rest belong together; give all four or none")
    else:
        names = ("lower", "upper", "ranges", "rest")
        low, high, width, posture = (
            joint_vector(chain, value, name)  # type: ignore[arg-type]
            for name, value in zip(names, pulls, strict=True)
        )
        damping = np.full(chain.size, _NULL_SPACE_DAMPING)
    whole, real = chain.nodes
    node, local = chain.tip_frames
    used = _kernels().plain_descent(
        whole, real, node, local, goals, damping, posture, low, high, width,
        _REST_GAIN, _LIMIT_GAIN, _LONGEST_STEP, float(residual_threshold), int(iterations), q,
    )  # fmt: skip
    if used < 0:
        raise ValueError("target holds a value that is not finite, or a quaternion of zero length")
    return q


# Measured on PyBullet 3.2.7 by single steps on its arms.
_DAMPING = 0.5
_NULL_SPACE_DAMPING = 0.36
_REST_GAIN = 0.001
_LIMIT_GAIN = 10.0
_LONGEST_STEP = np.pi / 4


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
                f"the bound on a joint's motion is {bound}; give one positive number, or one a joint"
            )
    return values, bound


def _within(values: Array, bound: Any) -> Array:
    """`values` cut to ±bound."""
    return values if bound is None else np.minimum(np.maximum(values, -bound), bound)
