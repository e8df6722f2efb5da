"""Single damped least-squares steps as compiled loops."""

from __future__ import annotations

import math

from roboyard.kinematics._kernels import (
    CHAIN,
    fill_jacobian,
    linearize,
    place_links,
    place_nodes,
    read_targets,
    task_errors,
)
from roboyard.kinematics._linear import bounded_step, normal_equations, solve_free
from roboyard.kinematics._lm import WORK
from roboyard.native import compiled

PROJECTOR_DAMPING = 1e-4  # of the null-space projector: singular values above 0.01 are task directions

HALF_TURN = 1.6e-8
"""Real part below which PyBullet takes the other way round: it compares a single-precision angle with π."""


def bounded_motion(jac, rhs, damping_square, low, high, pull, hessian, factor, vectors, free, out):
    """Motion within low..high: damped least squares for jacᵀ d = rhs, plus `pull` in the null space.

    The projected pull is w = μ (JᵀJ + μ)⁻¹ pull; the task step then solves for what w leaves to do.
    """
    n = out.shape[0]
    gradient, damping, right, slide = vectors[0], vectors[1], vectors[2], vectors[3]
    for i in range(n):
        free[i] = i
        slide[i] = 0.0
    normal_equations(jac, rhs, hessian, gradient)
    pulls = False
    for i in range(n):
        damping[i] = PROJECTOR_DAMPING
        right[i] = PROJECTOR_DAMPING * pull[i]
        pulls = pulls or pull[i] != 0.0
    if pulls:
        solve_free(hessian, damping, right, free, n, factor, slide)
    for i in range(n):
        damping[i] = damping_square
        low[i] -= slide[i]
        high[i] -= slide[i]
        for j in range(n):
            gradient[i] -= hessian[i, j] * slide[j]
    bounded_step(hessian, damping, gradient, low, high, free, right, factor, out)
    for i in range(n):
        out[i] += slide[i]


@compiled(
    f"{CHAIN} f8[:,::1] f8[:,::1] f8[::1] f8 f8 f8[::1] f8[::1] f8[::1] {WORK} f8[::1] -> f8", fast_math=True
)
def step_to_targets(whole, real, node, local, targets, weights, q, gain, damping_square, low, high, pull,
                    frames, tip, target, raw, errors, jac, rhs, hessian, factor, vectors, free, postures,
                    state, out):  # fmt: skip
    """Motion `out` (n,) towards the targets; 0 where they or q are not finite, else 1."""
    n, t = q.shape[0], node.shape[0]
    good = read_targets(targets, target)
    for i in range(n):
        good = good and math.isfinite(q[i])
    if not good:
        return 0.0
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    task_errors(target, weights, tip, raw, errors)
    linearize(whole, real, frames, node, target, weights, tip, raw, jac, rhs)
    for r in range(6 * t):
        rhs[r] *= gain
    bounded_motion(jac, rhs, damping_square, low, high, pull, hessian, factor, vectors, free, out)
    return 1.0


@compiled(f"{CHAIN} f8[:,::1] f8[:,::1] f8[::1] f8 f8[::1] f8[::1] f8[::1] {WORK} f8[::1]", fast_math=True)
def step_with_twists(whole, real, node, local, twists, weights, q, damping_square, low, high, pull,
                     frames, tip, target, raw, errors, jac, rhs, hessian, factor, vectors, free, postures,
                     state, out):  # fmt: skip
    """Joint velocities `out` (n,) for tip velocities (t, 6) in base axes."""
    n, t = q.shape[0], node.shape[0]
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    for k in range(t):
        fill_jacobian(whole, real, frames, node[k], tip[k, 0], tip[k, 1], tip[k, 2], jac, 6 * k)
        for r in range(6):
            rhs[6 * k + r] = weights[k, r] * twists[k, r]
            for j in range(n):
                jac[j, 6 * k + r] *= weights[k, r]
    bounded_motion(jac, rhs, damping_square, low, high, pull, hessian, factor, vectors, free, out)


def frame_quaternion(frames, k):
    """Quaternion (x, y, z, w) of the rotation of a frame; its largest part, or w, is positive."""
    m00, m01, m02 = frames[k, 3], frames[k, 4], frames[k, 5]
    m10, m11, m12 = frames[k, 6], frames[k, 7], frames[k, 8]
    m20, m21, m22 = frames[k, 9], frames[k, 10], frames[k, 11]
    if m00 + m11 + m22 > 0.0:
        x, y, z, w = m21 - m12, m02 - m20, m10 - m01, 1.0 + m00 + m11 + m22
    elif m00 >= m11 and m00 >= m22:
        x, y, z, w = 1.0 + m00 - m11 - m22, m10 + m01, m20 + m02, m21 - m12
    elif m11 >= m22:
        x, y, z, w = m10 + m01, 1.0 + m11 - m00 - m22, m21 + m12, m02 - m20
    else:
        x, y, z, w = m20 + m02, m21 + m12, 1.0 + m22 - m00 - m11, m10 - m01
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def turn_to_target(target, tip, k):
    """Rotation vector (rad, base axes) from a tip to its target; half a turn goes as in PyBullet."""
    a, b, c, d = frame_quaternion(target, k)
    i, j, l, r = frame_quaternion(tip, k)
    x = a * r - d * i - b * l + c * j
    y = b * r - d * j - c * i + a * l
    z = c * r - d * l - a * j + b * i
    w = d * r + a * i + b * j + c * l
    if w < HALF_TURN:
        x, y, z, w = -x, -y, -z, -w
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0
    if sine > 1e-12:
        scale = 2.0 * math.atan2(sine, w) / sine
    return scale * x, scale * y, scale * z


@compiled(
    f"{CHAIN} f8[:,::1] f8[::1] f8[::1] f8[::1] f8[::1] f8[::1] f8 f8 f8 f8 i8 f8[:,::1] f8[:,::1] {WORK} "
    "f8[::1] -> f8",
    fast_math=True,
)
def plain_descent(whole, real, node, local, targets, damping, rest, lower, upper, ranges,
                  rest_gain, limit_gain, longest, threshold, iterations, columns, rows,
                  frames, tip, target, raw, errors, jac, rhs, hessian, factor, vectors, free, postures,
                  state, q):  # fmt: skip
    """`damped_step_ik` in place; an empty `rest` means no null-space motion. -1 for invalid input."""
    n, t = q.shape[0], node.shape[0]
    per = 3 if targets.shape[1] == 3 else 6
    gradient, step = vectors[0], vectors[1]
    for i in range(n):
        free[i] = i
    if not read_targets(targets, target):
        return -1.0
    for iteration in range(iterations):
        place_nodes(whole, real, q, frames)
        place_links(frames, node, local, tip)
        left = 0.0
        for k in range(t):
            fill_jacobian(whole, real, frames, node[k], tip[k, 0], tip[k, 1], tip[k, 2], columns, 0)
            for r in range(per):
                for j in range(n):
                    rows[j, per * k + r] = columns[j, r]
            for r in range(3):
                rhs[per * k + r] = target[k, r] - tip[k, r]
                left += rhs[per * k + r] ** 2
            if per == 6:
                rhs[6 * k + 3], rhs[6 * k + 4], rhs[6 * k + 5] = turn_to_target(target, tip, k)
        normal_equations(rows, rhs, hessian, gradient)
        if rest.shape[0] == n:
            for i in range(n):
                wish = rest_gain * (rest[i] - q[i])
                if q[i] > upper[i]:
                    wish += limit_gain * (upper[i] - q[i]) / ranges[i]
                if q[i] < lower[i]:
                    wish += limit_gain * (lower[i] - q[i]) / ranges[i]
                gradient[i] += damping[i] * wish
        solve_free(hessian, damping, gradient, free, n, factor, step)
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(step[i]))
        scale = longest / largest if largest > longest else 1.0
        for i in range(n):
            q[i] += scale * step[i]
        if math.sqrt(left) <= threshold:
            return iteration + 1.0
    return float(iterations)
