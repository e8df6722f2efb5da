"""Small dense solves inside compiled loops: normal equations, bounded least squares."""

from __future__ import annotations

import math


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
        factor[a, a] = 1.0 / math.sqrt(max(total, 1e-300))  # reciprocal: divisions are slow
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


def bounded_step(hessian, damping, gradient, low, high, free, right, factor, step):
    """Step of min ½ dᵀ(H + D)d - gᵀd within low..high, by block principal pivoting.

    Entries beyond a bound are put on it, entries on a bound that are pulled inwards are let go, and the free
    rest is solved again, until nothing changes. Exchanging all at once may go round in a circle, so that
    later rounds exchange one entry alone (Júdice and Pires, Computers & Operations Research 21(5), 1994).

    `free` (2n,) is work space: the free entries, then 0 free, 1 fixed, +2 to be exchanged for each entry.
    """
    n = gradient.shape[0]
    for i in range(n):
        outwards = (low[i] >= 0.0 and gradient[i] < 0.0) or (high[i] <= 0.0 and gradient[i] > 0.0)
        free[n + i] = 1 if outwards else 0
        step[i] = min(max(0.0, low[i]), high[i])
    for sweep in range(6 + 4 * n):
        count = 0
        for i in range(n):
            right[i] = gradient[i]
            if free[n + i] == 0:
                free[count] = i
                count += 1
        for j in range(n):
            if free[n + j] == 1 and step[j] != 0.0:
                for i in range(n):
                    right[i] -= hessian[i, j] * step[j]
        solve_free(hessian, damping, right, free, count, factor, step)
        last = mark_wrong(hessian, damping, right, low, high, free, count, step)
        if last < 0:
            return
        for i in range(n):
            if free[n + i] >= 2:
                free[n + i] -= 2
                if sweep < 6 or i == last:
                    free[n + i] = 1 - free[n + i]
                    step[i] = min(max(step[i], low[i]), high[i])
    for i in range(n):
        step[i] = min(max(step[i], low[i]), high[i])


def mark_wrong(hessian, damping, right, low, high, free, count, step):
    """Mark free entries beyond a bound and fixed ones whose gradient points inwards.

    The last such entry, or -1.
    """
    n, last = step.shape[0], -1
    for i in range(n):
        if free[n + i] == 0:
            wrong = step[i] < low[i] or step[i] > high[i]
        elif low[i] < high[i]:
            pull = right[i] - damping[i] * step[i]
            for b in range(count):
                pull -= hessian[i, free[b]] * step[free[b]]
            wrong = (pull > 1e-12 and step[i] <= low[i]) or (pull < -1e-12 and step[i] >= high[i])
        else:
            wrong = False
        if wrong:
            free[n + i] += 2
            last = i
    return last
