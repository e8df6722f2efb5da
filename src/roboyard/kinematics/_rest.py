"""Compiled loop that moves solutions towards a rest posture in the null space."""

from __future__ import annotations

from roboyard.kinematics._kernels import CHAIN, linearize, read_targets
from roboyard.kinematics._linear import bounded_step, normal_equations
from roboyard.kinematics._lm import WORK, descend, evaluate, note_errors, within
from roboyard.native import compiled

SMALL = 1e-6  # weight of a radian from rest relative to the task's unit


def rest_cost(rest, rest_weights, q):
    """Weighted squared distance of q (n,) to rest (n,)."""
    total = 0.0
    for i in range(q.shape[0]):
        total += rest_weights[i] * (rest[i] - q[i]) ** 2
    return total


@compiled(
    f"{CHAIN} f8[:,::1] f8[:,:,::1] f8[:,::1] f8 f8 f8[::1] f8[::1] i8 {WORK} f8[:,::1]",
    fast_math=True,
    releases_gil=True,
)
def approach_rest(whole, real, node, local, ranges, targets, weights,
                  tolerance_position, tolerance_orientation, rest, rest_weights, iterations,
                  frames, tip, target, raw, errors, jac, rhs, hessian, factor, vectors, free, postures, state,
                  out):  # fmt: skip
    """Move the converged rows of `_lm.solve`'s `out` towards rest, within the tolerances.

    Each step d is the minimum of |jacᵀ d - rhs|² / SMALL + |rest - q - d|², cut to `reach` and corrected by a
    short descent; a step that leaves the tolerances or comes no nearer to rest shortens the reach. Iterations
    are added up.
    """
    n = ranges.shape[0]
    q, here, trial = postures[0], postures[1], postures[2]
    gradient, damping, low = vectors[0], vectors[1], vectors[2]
    high, right, step = vectors[3], vectors[4], vectors[5]
    for b in range(targets.shape[0]):
        if out[b, n + 2] != 1.0:
            continue
        read_targets(targets[b], target)
        reach = 0.5
        for i in range(n):
            q[i] = out[b, i]
        cost = rest_cost(rest, rest_weights, q)
        for _ in range(iterations):
            out[b, n + 3] += 1.0
            evaluate(whole, real, node, local, target, weights, q, frames, tip, raw, errors)
            linearize(whole, real, frames, node, target, weights, tip, raw, jac, rhs)
            normal_equations(jac, rhs, hessian, gradient)
            for i in range(n):
                low[i], high[i] = ranges[i, 0] - q[i], ranges[i, 1] - q[i]
                gradient[i] += SMALL * rest_weights[i] * (rest[i] - q[i])
                damping[i] = SMALL * rest_weights[i] + 1e-12
            bounded_step(hessian, damping, gradient, low, high, free, right, factor, step)
            longest = 0.0
            for i in range(n):
                longest = max(longest, abs(step[i]))
            scale = min(1.0, reach / longest) if longest > 0.0 else 1.0
            for i in range(n):
                here[i] = min(max(q[i] + scale * step[i], ranges[i, 0]), ranges[i, 1])
            descend(
                whole, real, node, local, ranges, target, weights, 0.1 * tolerance_position,
                0.1 * tolerance_orientation, 4, here, trial, frames, tip, raw, errors,
                jac, rhs, hessian, vectors, free, factor)  # fmt: skip
            evaluate(whole, real, node, local, target, weights, here, frames, tip, raw, errors)
            now = rest_cost(rest, rest_weights, here)
            if within(errors, tolerance_position, tolerance_orientation) and now < cost:
                gain, cost = cost - now, now
                for i in range(n):
                    q[i] = here[i]
                    out[b, i] = here[i]
                note_errors(errors, out[b], n)
                if gain < 1e-6 * (cost + 1e-9):
                    break
            else:
                reach = 0.5 * scale * longest
                if reach < 1e-4:
                    break
