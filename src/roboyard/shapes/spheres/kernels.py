"""Numba loops behind `roboyard.shapes.spheres.fit`."""

from __future__ import annotations

import math

import numpy as np

from roboyard._numba import njit
from roboyard.shapes.voxels.kernels import sample_field


@njit(cache=True, fastmath=True, nogil=True)
def nearest_sphere(px, py, pz, x, index, gap):
    """Signed distance (negative inside) from each point to the union of spheres, and the nearest sphere.

    Args:
        px, py, pz: (p,) float32 points.
        x: (4 n,) centre and radius of each sphere.
        index: (p,) int32 output.
        gap: (p,) float32 output.
    """
    gap[:] = np.float32(1e30)
    index[:] = 0
    n = x.shape[0] // 4
    # Two spheres at a time: with one, the compiler stores under a mask, which takes AMD's processors long.
    for s in range(0, n, 2):
        other = min(s + 1, n - 1)
        ax, ay, az = np.float32(x[4 * s]), np.float32(x[4 * s + 1]), np.float32(x[4 * s + 2])
        bx, by, bz = np.float32(x[4 * other]), np.float32(x[4 * other + 1]), np.float32(x[4 * other + 2])
        ar, br = np.float32(x[4 * s + 3]), np.float32(x[4 * other + 3])
        a, b = np.int32(s), np.int32(other)
        for p in range(px.shape[0]):
            best, who = gap[p], index[p]
            dx, dy, dz = px[p] - ax, py[p] - ay, pz[p] - az
            d = np.sqrt(dx * dx + dy * dy + dz * dz) - ar
            nearer = d < best
            best, who = d if nearer else best, a if nearer else who
            dx, dy, dz = px[p] - bx, py[p] - by, pz[p] - bz
            d = np.sqrt(dx * dx + dy * dy + dz * dz) - br
            nearer = d < best
            gap[p], index[p] = d if nearer else best, b if nearer else who


@njit(cache=True, fastmath=True, nogil=True)
def volume_cost(x, px, py, pz, weight, tau, tail, index, gap, grad):
    """Weighted volume on the wrong side of the spheres' surface, with its gradient.

    Points of positive weight should be covered, those of negative weight should not. Each counts by a smooth
    step of half-width `tau` in its distance to the union's surface; beyond the step the cost of uncovered
    points grows by `tail` of a step per `tau`, so that far points keep a gradient.
    """
    nearest_sphere(px, py, pz, x, index, gap)
    grad[:] = 0.0
    cost = 0.0
    for p in range(px.shape[0]):
        w = weight[p]
        t = gap[p] / tau if w > 0.0 else -gap[p] / tau
        if t <= -1.0:
            continue
        size = abs(w)
        if t >= 1.0:
            if w < 0.0:
                cost += size
                continue
            cost += size * (1.0 + tail * (t - 1.0))
            slope = w * tail / tau
        else:
            u = 0.5 * (t + 1.0)
            cost += size * u * u * (3.0 - 2.0 * u)
            slope = w * 3.0 * u * (1.0 - u) / tau
        s = 4 * index[p]
        distance = max(gap[p] + x[s + 3], 1e-9)
        grad[s] -= slope * (px[p] - x[s]) / distance
        grad[s + 1] -= slope * (py[p] - x[s + 1]) / distance
        grad[s + 2] -= slope * (pz[p] - x[s + 2]) / distance
        grad[s + 3] -= slope
    return cost


@njit(cache=True, nogil=True)
def surface_cost(x, sdf, unit, directions, tau, price, grad):
    """`price` times the share of the spheres' surface outside the solid; adds its gradient to `grad`.

    Each point of a sphere counts by a smooth step of half-width `tau` in its distance to the solid.

    Args:
        x: (4 n,) centre and radius of each sphere.
        sdf: (nx, ny, nz) signed distance to the solid at voxel centres (voxels).
        unit: length of a voxel.
        directions: (d, 3) evenly distributed unit vectors.
        tau: half-width of the step.
        price: cost of the whole surface.
        grad: (4 n,) gradient.
    """
    n, d = x.shape[0] // 4, directions.shape[0]
    area, out = 0.0, 0.0
    part, slope = np.empty(n), np.empty((n, 4))
    for s in range(n):
        r = x[4 * s + 3]
        area += r * r
        part[s] = 0.0
        slope[s] = 0.0
        for j in range(d):
            vx, vy, vz = directions[j, 0], directions[j, 1], directions[j, 2]
            value, gx, gy, gz = sample_field(
                sdf,
                (x[4 * s] + r * vx) / unit,
                (x[4 * s + 1] + r * vy) / unit,
                (x[4 * s + 2] + r * vz) / unit,
            )
            t = value * unit / tau
            if t <= -1.0:
                continue
            if t >= 1.0:
                part[s] += 1.0
                continue
            u = 0.5 * (t + 1.0)
            part[s] += u * u * (3.0 - 2.0 * u)
            w = 3.0 * u * (1.0 - u) / tau
            slope[s, 0] += w * gx
            slope[s, 1] += w * gy
            slope[s, 2] += w * gz
            slope[s, 3] += w * (gx * vx + gy * vy + gz * vz)
        part[s] /= d
        out += r * r * part[s]
    for s in range(n):
        r = x[4 * s + 3]
        for k in range(4):
            grad[4 * s + k] += price * r * r * slope[s, k] / d / area
        grad[4 * s + 3] += price * 2.0 * r * (part[s] - out / area) / area
    return price * out / area


@njit(cache=True, nogil=True)
def descend(x, px, py, pz, weight, tau, tail, floor, ceiling, rounds, sdf, unit, directions, price):
    """Lower `volume_cost` + `surface_cost` from `x` in place, radii in `floor`..`ceiling`; returns the sum.

    L-BFGS with eight pairs, projection onto the bounds and backtracking; Nocedal and Wright, Numerical
    Optimization (2006), algorithms 7.4 and 3.1. (SciPy's spends most of its time in threaded linear algebra
    here.) Coordinate by coordinate: numba takes several times as long to compile operations on arrays.
    """
    n, memory = x.shape[0], 8
    index, gap = np.empty(px.shape[0], np.int32), np.empty(px.shape[0], np.float32)
    grad, grad_try, x_try, direction = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    # one more than is kept, for the newest
    steps, turns = np.zeros((memory + 1, n)), np.zeros((memory + 1, n))
    rho, alpha = np.zeros(memory + 1), np.zeros(memory)
    held = 0
    cost = volume_cost(x, px, py, pz, weight, tau, tail, index, gap, grad)
    if price > 0.0:
        cost += surface_cost(x, sdf, unit, directions, tau, price, grad)
    for _ in range(rounds):
        for k in range(n):
            direction[k] = grad[k]
        for i in range(held):
            j = held - 1 - i
            alpha[j] = rho[j] * _product(steps, j, direction)
            _add(direction, -alpha[j], turns, j)
        if held > 0:
            scale = rho[held - 1] * _square(turns, held - 1)
            for k in range(n):
                direction[k] /= scale
        else:
            # first step: move no parameter farther than half the step's width
            steepest = 1e-30
            for k in range(n):
                steepest = max(steepest, abs(grad[k]))
            for k in range(n):
                direction[k] *= 0.5 * tau / steepest
        for j in range(held):
            _add(direction, alpha[j] - rho[j] * _product(turns, j, direction), steps, j)
        length, accepted, cost_try = 1.0, False, cost
        for _ in range(12):
            slope = 0.0
            for k in range(n):
                x_try[k] = x[k] - length * direction[k]
                if k % 4 == 3:
                    x_try[k] = min(max(x_try[k], floor), ceiling)
                slope += grad[k] * (x_try[k] - x[k])
            if slope >= 0.0:
                break
            cost_try = volume_cost(x_try, px, py, pz, weight, tau, tail, index, gap, grad_try)
            if price > 0.0:
                cost_try += surface_cost(x_try, sdf, unit, directions, tau, price, grad_try)
            if cost_try <= cost + 1e-4 * slope:
                accepted = True
                break
            length *= 0.4
        if not accepted:
            if held == 0:
                break
            held = 0
            continue
        gained = cost - cost_try
        for k in range(n):
            steps[held, k], turns[held, k] = x_try[k] - x[k], grad_try[k] - grad[k]
            x[k], grad[k] = x_try[k], grad_try[k]
        cost = cost_try
        curvature = 0.0
        for k in range(n):
            curvature += steps[held, k] * turns[held, k]
        if curvature > 1e-10 * _square(turns, held):
            rho[held] = 1.0 / curvature
            held += 1
        if held > memory:
            held = memory
            for j in range(memory):
                rho[j] = rho[j + 1]
                for k in range(n):
                    steps[j, k], turns[j, k] = steps[j + 1, k], turns[j + 1, k]
        if gained < 1e-5 * cost:
            break
    return cost


@njit(cache=True, nogil=True)
def _product(rows, j, vector):
    """Return the dot product of row j of (m, n) numbers and an (n,) vector."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += rows[j, k] * vector[k]
    return total


@njit(cache=True, nogil=True)
def _square(rows, j):
    """Return the squared length of row j of (m, n) numbers."""
    total = 0.0
    for k in range(rows.shape[1]):
        total += rows[j, k] * rows[j, k]
    return total


@njit(cache=True, nogil=True)
def _add(vector, factor, rows, j):
    """Add a multiple of row j of (m, n) numbers to an (n,) vector."""
    for k in range(vector.shape[0]):
        vector[k] += factor * rows[j, k]


@njit(cache=True, nogil=True)
def spread_seeds(points, centers):
    """Fill `centers` with points far from each other, starting with the farthest from the first point."""
    far = np.full(points.shape[0], 1e30)
    at = 0
    for s in range(-1, centers.shape[0]):
        best = -1.0
        nxt = 0
        for p in range(points.shape[0]):
            d = 0.0
            for k in range(3):
                d += (points[p, k] - points[at, k]) ** 2
            far[p] = d if s <= 0 else min(far[p], d)
            if far[p] > best:
                best, nxt = far[p], p
        at = nxt
        if s + 1 < centers.shape[0]:
            centers[s + 1] = points[at]


@njit(cache=True, nogil=True)
def cluster(points, centers, rounds, label, spread):
    """Lloyd's k-means from `centers`, in place.

    Writes each cluster's root mean square distance to `spread`.
    """
    n = centers.shape[0]
    total = np.zeros((n, 3))
    count = np.zeros(n)
    for turn in range(rounds + 1):
        total[:] = 0.0
        count[:] = 0.0
        spread[:] = 0.0
        for p in range(points.shape[0]):
            best, who = 1e30, 0
            for s in range(n):
                dx = points[p, 0] - centers[s, 0]
                dy = points[p, 1] - centers[s, 1]
                dz = points[p, 2] - centers[s, 2]
                d = dx * dx + dy * dy + dz * dz
                if d < best:
                    best, who = d, s
            label[p] = who
            count[who] += 1.0
            spread[who] += best
            for k in range(3):
                total[who, k] += points[p, k]
        if turn == rounds:
            break
        for s in range(n):
            if count[s] > 0.0:
                for k in range(3):
                    centers[s, k] = total[s, k] / count[s]
    for s in range(n):
        spread[s] = math.sqrt(spread[s] / count[s]) if count[s] > 0.0 else 0.0
