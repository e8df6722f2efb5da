"""Levenberg-Marquardt with limits and restarts, in one compiled loop.

The damping grows with the remaining error (Sugihara, IEEE Trans. Robotics 27(5), 2011) and with every refused
step.
"""

from __future__ import annotations

import math

import numpy as np

from roboyard.kinematics._kernels import (
    CHAIN,
    linearize,
    place_links,
    place_nodes,
    read_targets,
    task_errors,
)
from roboyard.kinematics._linear import bounded_step, normal_equations
from roboyard.native import compiled

WORK = (
    "f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1] f8[::1] f8[:,::1] f8[:,::1] f8[:,::1] "
    "i8[::1] f8[:,::1] u8[::1]"
)
"""Signature of the fields of `WorkSpace`."""


def next_random(state):
    """Uniform in 0..1 from one 64-bit word (Marsaglia's xorshift, Vigna's multiplier)."""
    x = state[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    state[0] = x
    return float((x * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


def seed_state(seed, state):
    """Spread a small seed over 64 bits (splitmix64)."""
    z = np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    state[0] = z if z != np.uint64(0) else np.uint64(1)


def evaluate(whole, real, node, local, target, weights, q, frames, tip, raw, errors):
    """Cost at q (n,); writes frames, tips and errors to the work arrays."""
    place_nodes(whole, real, q, frames)
    place_links(frames, node, local, tip)
    return task_errors(target, weights, tip, raw, errors)


def within(errors, tolerance_position, tolerance_orientation):
    """Whether all errors (t, 2) are within the tolerances."""
    for t in range(errors.shape[0]):
        if not (errors[t, 0] <= tolerance_position and errors[t, 1] <= tolerance_orientation):
            return False
    return True


def draw(ranges, q0, state, q):
    """Random configuration inside the limits; within half a turn (or 1 m) of q0 where a side has no limit."""
    for i in range(q.shape[0]):
        low, high = ranges[i, 0], ranges[i, 1]
        if not math.isfinite(low):
            low = min(q0[i], high) - (math.pi if ranges[i, 2] > 0.0 else 1.0)
        if not math.isfinite(high):
            high = max(q0[i], low) + (math.pi if ranges[i, 2] > 0.0 else 1.0)
        q[i] = low + (high - low) * next_random(state)


def nearest_turn(ranges, q0, q):
    """Move every periodic entry to the equivalent nearest to q0 inside its limits."""
    for i in range(q.shape[0]):
        period = ranges[i, 2]
        if period > 0.0 and ranges[i, 1] - ranges[i, 0] > period:
            value = q[i] - period * math.floor((q[i] - q0[i]) / period + 0.5)
            if value > ranges[i, 1]:
                value -= period * math.ceil((value - ranges[i, 1]) / period)
            if value < ranges[i, 0]:
                value += period * math.ceil((ranges[i, 0] - value) / period)
            q[i] = value


def descend(whole, real, node, local, ranges, target, weights,
            tolerance_position, tolerance_orientation, iterations, q, trial, frames, tip, raw, errors,
            jac, rhs, hessian, vectors, free, factor):  # fmt: skip
    """One descent from q, in place. Returns (converged, iterations used, cost)."""
    n = q.shape[0]
    gradient, damping, low = vectors[0], vectors[1], vectors[2]
    high, right, step = vectors[3], vectors[4], vectors[5]
    cost, extra, slow, refused = math.inf, 1e-5, 0, 0
    for i in range(n):
        trial[i] = q[i]
    for iteration in range(iterations + 1):
        now = evaluate(whole, real, node, local, target, weights, trial, frames, tip, raw, errors)
        if now < cost or iteration == 0:
            for i in range(n):
                q[i] = trial[i]
            if within(errors, tolerance_position, tolerance_orientation):
                return True, iteration, now
            slow = slow + 1 if now > 0.98 * cost else 0
            cost, extra, refused = now, max(0.1 * extra, 1e-9), 0
            linearize(whole, real, frames, node, target, weights, tip, raw, jac, rhs)
            normal_equations(jac, rhs, hessian, gradient)
            for i in range(n):
                low[i], high[i] = ranges[i, 0] - q[i], ranges[i, 1] - q[i]
        else:
            extra = max(8.0 * extra, 1e-3)
            refused += 1
        if slow >= 4 or refused >= 8 or iteration == iterations:
            return False, iteration, cost
        for i in range(n):
            damping[i] = extra + 0.1 * cost
        bounded_step(hessian, damping, gradient, low, high, free, right, factor, step)
        for i in range(n):
            trial[i] = min(max(q[i] + step[i], ranges[i, 0]), ranges[i, 1])
    return False, iterations, cost


@compiled(
    f"{CHAIN} f8[:,::1] f8[:,:,::1] f8[:,::1] f8[:,::1] i8 f8 f8 i8 i8 i8 i8 {WORK} f8[:,::1]",
    fast_math=True,
    releases_gil=True,
)
def solve(whole, real, node, local, ranges, targets, weights, q0, warm,
          tolerance_position, tolerance_orientation, iterations, restarts, candidates, seed,
          frames, tip, target, raw, errors, jac, rhs, hessian, factor, vectors, free, postures, state,
          out):  # fmt: skip
    """Solve many problems (b, t, k) with t tips each.

    q0 has one row for all problems, or one each; with `warm` a solved problem's answer starts the next one.
    out (b, n + 6): q, position and orientation error (of the worst tip), converged, iterations, descents,
    and 1 for a target or start that is not a number.
    """
    n = ranges.shape[0]
    start, q, trial = postures[0], postures[1], postures[2]
    for b in range(targets.shape[0]):
        seed_state(seed + b, state)
        good = read_targets(targets[b], target)
        row = b if q0.shape[0] > 1 else 0
        answer = out[b, :n]
        for i in range(n):
            value = q0[row, i]
            good = good and math.isfinite(value)
            if warm != 0 and b > 0 and out[b - 1, n + 2] == 1.0:
                value = out[b - 1, i]
            start[i] = min(max(value, ranges[i, 0]), ranges[i, 1])
            q[i] = start[i]
            answer[i] = start[i]
        best, used, descents, converged = math.inf, 0, 0, False
        while good:
            converged, spent, cost = descend(
                whole, real, node, local, ranges, target, weights,
                tolerance_position, tolerance_orientation, iterations, q, trial, frames, tip, raw, errors,
                jac, rhs, hessian, vectors, free, factor)  # fmt: skip
            used += spent
            if converged or cost < best:
                best = cost
                for i in range(n):
                    answer[i] = q[i]
            descents += 1
            if converged or descents > restarts:
                break
            lowest = math.inf
            for _ in range(candidates):
                draw(ranges, start, state, trial)
                cost = evaluate(whole, real, node, local, target, weights, trial, frames, tip, raw, errors)
                if cost < lowest:
                    lowest = cost
                    for i in range(n):
                        q[i] = trial[i]
        nearest_turn(ranges, start, answer)
        if not converged:
            evaluate(whole, real, node, local, target, weights, answer, frames, tip, raw, errors)
        note_errors(errors, out[b], n)
        out[b, n + 2] = 1.0 if converged else 0.0
        out[b, n + 3], out[b, n + 4], out[b, n + 5] = used, descents, 0.0 if good else 1.0


def note_errors(errors, row, n):
    """Entries n and n + 1 of `row`: position and orientation error of the worst tip."""
    row[n], row[n + 1] = errors[0, 0], errors[0, 1]
    for k in range(1, errors.shape[0]):
        row[n] = max(row[n], errors[k, 0])
        row[n + 1] = max(row[n + 1], errors[k, 1])
