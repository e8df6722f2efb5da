"""Single damped least-squares steps as kernels; imported on first use only."""

from __future__ import annotations

import math

import numpy as np

from roboyard.kinematics._kernels import (
    fill_jacobian,
    kernel,
    linearize,
    place_links,
    place_nodes,
    read_targets,
    rotation_log,
    task_errors,
)
from roboyard.kinematics._linear import bounded_step, normal_equations, solve_free

PROJECTOR_DAMPING = 1e-4  # of the null-space projector: singular values above 0.01 are task directions


@kernel
def bounded_motion(jac, rhs, damping_square, low, high, pull, out):
    """Motion within low..high: damped least squares for jacᵀ d = rhs, plus `pull` in the null space.

    The projected pull is w = μ (JᵀJ + μ)⁻¹ pull; the task step then solves for what w leaves to do.
    """
    n = out.shape[0]
    hessian, factor = np.empty((n, n)), np.empty((n, n))
    gradient, damping, right, slide = np.empty(n), np.empty(n), np.empty(n), np.zeros(n)
    free = np.arange(2 * n)
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


@kernel
def step_to_targets(
    whole, real, node, local, targets, weights, q, gain, damping_square, low, high, pull, out
):
    """Motion `out` (n,) towards the targets; False where they or q are not finite."""
    m, n, t = whole.shape[0], q.shape[0], node.shape[0]
    frames, tip, target = np.empty((m, 12)), np.empty((t, 12)), np.empty((t, 12))
    raw, errors = np.zeros((t, 6)), np.empty((t, 2))
    jac, rhs = np.empty((n, 6 * t)), np.empty(6 * t)
    good = read_targets(targets, target)
    for i in range(n):
        good = good and math.isfinite(q[i])
    if not good:
        return False
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    task_errors(target, weights, tip, raw, errors)
    linearize(whole, real, frames, node, target, weights, tip, raw, jac, rhs)
    for r in range(6 * t):
        rhs[r] *= gain
    bounded_motion(jac, rhs, damping_square, low, high, pull, out)
    return True


@kernel
def step_with_twists(whole, real, node, local, twists, weights, q, damping_square, low, high, pull, out):
    """Joint velocities `out` (n,) for tip velocities (t, 6) in base axes."""
    m, n, t = whole.shape[0], q.shape[0], node.shape[0]
    frames, tip = np.empty((m, 12)), np.empty((t, 12))
    jac, rhs = np.empty((n, 6 * t)), np.empty(6 * t)
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    for k in range(t):
        fill_jacobian(whole, real, frames, node[k], tip[k, 0], tip[k, 1], tip[k, 2], jac, 6 * k)
        for r in range(6):
            rhs[6 * k + r] = weights[k, r] * twists[k, r]
            for j in range(n):
                jac[j, 6 * k + r] *= weights[k, r]
    bounded_motion(jac, rhs, damping_square, low, high, pull, out)


@kernel
def plain_descent(whole, real, node, local, targets, damping, rest, lower, upper, ranges,
                  rest_gain, limit_gain, longest, threshold, iterations, q):  # fmt: skip
    """`damped_step_ik` in place; an empty `rest` means no null-space motion. -1 for invalid input."""
    m, n, t = whole.shape[0], q.shape[0], node.shape[0]
    frames, tip, target = np.empty((m, 12)), np.empty((t, 12)), np.empty((t, 12))
    per = 3 if targets.shape[1] == 3 else 6
    columns, jac, rhs = np.empty((n, 6)), np.empty((n, per * t)), np.empty(per * t)
    hessian, factor, gradient, step = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(n)
    free = np.arange(n)
    if not read_targets(targets, target):
        return -1
    for iteration in range(iterations):
        place_nodes(whole, real, q, frames)
        place_links(frames, node, local, tip)
        left = 0.0
        for k in range(t):
            fill_jacobian(whole, real, frames, node[k], tip[k, 0], tip[k, 1], tip[k, 2], columns, 0)
            for r in range(per):
                for j in range(n):
                    jac[j, per * k + r] = columns[j, r]
            for r in range(3):
                rhs[per * k + r] = target[k, r] - tip[k, r]
                left += rhs[per * k + r] ** 2
            if per == 6:
                x, y, z = rotation_log(target, k, tip, k)
                for r in range(3):
                    turned = target[k, 3 + 3 * r] * x + target[k, 4 + 3 * r] * y + target[k, 5 + 3 * r] * z
                    rhs[6 * k + 3 + r] = -turned
        normal_equations(jac, rhs, hessian, gradient)
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
            return iteration + 1
    return iterations
