"""Small dense solves inside kernels: normal equations, bounded least squares; imported on first use only."""

from __future__ import annotations

import math

from roboyard.kinematics._kernels import kernel


@kernel
def normal_equations(jac, rhs, hessian, gradient):
    """`hessian` = J Jᵀ and gradient = J rhs of the transposed Jacobian (n, rows)."""
    n, rows = jac.shape
    for i in range(n):
        total = 0.0
        for r in range(rows):
            total += jac[i, r] * rhs[r]
        gradient[i] = total
        for j in range(i + 1):
            total = 0.0
            for r in range(rows):
                total += jac[i, r] * jac[j, r]
            hessian[i, j] = total
            hessian[j, i] = total


@kernel
def solve_free(hessian, damping, right, free, count, factor, step):
    """Cholesky solution of (hessian + diag(damping)) step = right over the first `count` of `free`."""
    for a in range(count):
        i = free[a]
        for b in range(a):
            j = free[b]
            total = hessian[i, j]
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            factor[a, b] = total * factor[b, b]
        total = hessian[i, i] + damping[i]
        for c in range(a):
            total -= factor[a, c] * factor[a, c]
        factor[a, a] = 1.0 / math.sqrt(max(total, 1e-300))  # reciprocal: divisions are dear
        total = right[i]
        for c in range(a):
            total -= factor[a, c] * step[free[c]]
        step[i] = total * factor[a, a]
    for a in range(count - 1, -1, -1):
        i = free[a]
        total = step[i]
        for c in range(a + 1, count):
            total -= factor[c, a] * step[free[c]]
        step[i] = total * factor[a, a]


@kernel
def bounded_step(hessian, damping, gradient, low, high, free, right, factor, step):
    """Step of min ½ dᵀ(H + D)d - gᵀd that stays within low..high.

    Entries that would pass a bound are put on it, leave the system and move to its right side; then the rest
    is solved again, until none passes. Each entry leaves at most once.
    """
    n = gradient.shape[0]
    count = 0
    for i in range(n):
        right[i] = gradient[i]
    for i in range(n):
        if (low[i] >= 0.0 and gradient[i] < 0.0) or (high[i] <= 0.0 and gradient[i] > 0.0):
            step[i] = min(max(0.0, low[i]), high[i])  # on the bound or beyond it, and pushed outwards
            if step[i] != 0.0:
                for j in range(n):
                    right[j] -= hessian[j, i] * step[i]
        else:
            free[count] = i
            count += 1
    while count > 0:
        solve_free(hessian, damping, right, free, count, factor, step)
        kept = 0
        for a in range(count):
            i = free[a]
            if step[i] < low[i] or step[i] > high[i]:
                step[i] = min(max(step[i], low[i]), high[i])
                for j in range(n):
                    right[j] -= hessian[j, i] * step[i]
            else:
                free[kept] = i
                kept += 1
        if kept == count:
            return
        count = kept
