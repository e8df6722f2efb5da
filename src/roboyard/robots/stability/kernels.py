"""Compiled kernels of the support polygon and the zero-moment point, imported with the first control step.

The formulas are in `roboyard.robots.stability.zmp` and `roboyard.robots.control.rate_limiter`.
"""

from __future__ import annotations

import math

import numpy as np

from roboyard._numba import njit

kernel = njit(cache=True, nogil=True, error_model="numpy")

TINY = 1e-9
"""As in `roboyard.robots.stability.zmp`, which does not import this file: that would load numba."""


@kernel
def lowest_points(geoms, is_sphere, contype, conaffinity, aabb, xpos, xmat, out):
    """Write the lowest points of shapes to `out` (8 per shape, 3) in the world frame (m); return their
    number.

    Shapes that roll or are round touch the floor below their centre; of others the corners of the bounding
    box in about its lower quarter count.

    Args:
        geoms: (g,) indices of the shapes in MuJoCo's geoms.
        is_sphere: (g,) whether a shape rolls or is round.
        contype: (ngeom,) MuJoCo's contact types.
        conaffinity: (ngeom,) MuJoCo's contact affinities.
        aabb: (ngeom, 6) centre and half sizes of the bounding boxes in the shapes' frames (m).
        xpos: (ngeom, 3) positions in the world frame (m).
        xmat: (ngeom, 9) rotation matrices, row by row.
        out: (8 g, 3) result.
    """
    count = 0
    for k in range(len(geoms)):
        i = geoms[k]
        if not contype[i] and not conaffinity[i]:
            continue
        if is_sphere[k]:
            out[count, 0], out[count, 1] = xpos[i, 0], xpos[i, 1]
            out[count, 2] = xpos[i, 2] - max(aabb[i, 3], aabb[i, 4], aabb[i, 5])
            count += 1
            continue
        first, lowest = count, np.inf
        for corner in range(8):
            x = aabb[i, 0] + (aabb[i, 3] if corner & 1 else -aabb[i, 3])
            y = aabb[i, 1] + (aabb[i, 4] if corner & 2 else -aabb[i, 4])
            z = aabb[i, 2] + (aabb[i, 5] if corner & 4 else -aabb[i, 5])
            for a in range(3):
                m = xmat[i]
                out[count, a] = xpos[i, a] + m[3 * a] * x + m[3 * a + 1] * y + m[3 * a + 2] * z
            lowest = min(lowest, out[count, 2])
            count += 1
        limit = lowest + 0.5 * min(aabb[i, 3], aabb[i, 4], aabb[i, 5])
        end, count = count, first
        for j in range(first, end):
            if out[j, 2] <= limit:
                for a in range(3):
                    out[count, a] = out[j, a]
                count += 1
    return count


@kernel
def hull_edges(points, count, normals, bounds, middle):
    """Compute the convex hull of points in the xy plane; return its number of edges e, 0 for a hull without
    area.

    Source: Andrew, Another efficient algorithm for convex hulls in two dimensions, IPL 9(5), 1979.

    Args:
        points: (n, 3) m; the first `count` are used, and sorted in place.
        count: of points.
        normals: result, (e, 2) outward unit normals of the edges.
        bounds: result, (e,) distance of each edge from the origin along its normal (m).
        middle: result, (2,) mean of the corners (m).
    """
    for i in range(1, count):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        j = i - 1
        while j >= 0 and (points[j, 0] > x or (points[j, 0] == x and points[j, 1] > y)):
            for a in range(3):
                points[j + 1, a] = points[j, a]
            j -= 1
        points[j + 1, 0], points[j + 1, 1], points[j + 1, 2] = x, y, z
    chain = np.empty(2 * count + 2, dtype=np.int64)
    size = 0
    for side in range(2):
        start = size
        for k in range(count):
            i = k if side == 0 else count - 1 - k
            while size - start > 1:
                a, b = chain[size - 2], chain[size - 1]
                cross = (points[b, 0] - points[a, 0]) * (points[i, 1] - points[a, 1])
                cross -= (points[b, 1] - points[a, 1]) * (points[i, 0] - points[a, 0])
                if cross > 0.0:
                    break
                size -= 1
            if (
                size == start
                or points[chain[size - 1], 0] != points[i, 0]
                or (points[chain[size - 1], 1] != points[i, 1])
            ):
                chain[size] = i
                size += 1
        size -= 1  # the last corner of one side is the first of the other
    if size < 3:
        return 0
    area, longest = 0.0, 0.0
    middle[0] = middle[1] = 0.0
    for k in range(size):
        a, b = chain[k], chain[(k + 1) % size]
        x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        length = math.sqrt(x * x + y * y)
        normals[k, 0], normals[k, 1] = y / length, -x / length
        bounds[k] = normals[k, 0] * points[a, 0] + normals[k, 1] * points[a, 1]
        area += 0.5 * (points[a, 0] * y - points[a, 1] * x)
        longest = max(longest, length)
        middle[0] += points[a, 0] / size
        middle[1] += points[a, 1] / size
    return size if area >= 1e-9 + 1e-3 * longest * longest else 0


@kernel
def tipping(shift, spin, dofs, com, mass, height, weight, normals, com_shift, zmp_shift):
    """Compute how joints shift the centre of mass and the zero-moment point across each edge of the support.

    Args:
        shift: (3, nv) Jacobian of the centre of mass (m/rad or m/m).
        spin: (3, nv) matrix of the angular momentum about the centre of mass (kg m²/s per rad/s or m/s).
        dofs: (k,) indices of the joints in the velocities.
        com: (3,) centre of mass (m); unused.
        mass: of the robot (kg).
        height: of the centre of mass above the floor (m).
        weight: of the robot (N).
        normals: (e, 2) outward normals of the edges.
        com_shift: result, (e, k) m/rad or m/m.
        zmp_shift: result, (e, k) m s²/rad or s².
    """
    for k in range(len(dofs)):
        dof = dofs[k]
        x, y = shift[0, dof], shift[1, dof]
        about_x, about_y = spin[0, dof] - mass * height * y, spin[1, dof] + mass * height * x
        for e in range(len(normals)):
            com_shift[e, k] = normals[e, 0] * x + normals[e, 1] * y
            zmp_shift[e, k] = (normals[e, 1] * about_x - normals[e, 0] * about_y) / weight


@kernel
def first_moment(bodies, body_mass, inertia, place, turn, floor, x, y, out):
    """Write the sum of mass times height times horizontal distance from (x, y) to `out`, (2,) in world axes
    (kg m²).

    Args:
        bodies: (b,) indices of the links in MuJoCo's bodies.
        body_mass: (nbody,) kg.
        inertia: (nbody, 3) principal inertias (kg m²).
        place: (nbody, 3) centres of mass in the world frame (m).
        turn: (nbody, 9) rotation matrices of the principal axes, row by row.
        floor: height of the floor (m).
        x: of the base (m).
        y: of the base (m).
        out: (2,) result.
    """
    out[0] = out[1] = 0.0
    for k in range(len(bodies)):
        b = bodies[k]
        high = body_mass[b] * (place[b, 2] - floor)
        m, own = turn[b], inertia[b]
        out[0] += high * (place[b, 0] - x)
        out[1] += high * (place[b, 1] - y)
        for j in range(3):
            out[0] -= m[j] * own[j] * m[6 + j]
            out[1] -= m[3 + j] * own[j] * m[6 + j]


@kernel
def share(com_margin, push):
    """Return the largest fraction (0 to 1) of (e,) shifts (m) within the (e,) margins (m) of every edge."""
    found = 1.0
    for e in range(len(com_margin)):
        if push[e] > TINY:
            found = min(found, com_margin[e] / push[e])
    return min(max(found, 0.0), 1.0)


@kernel
def together(zmp_shift, zmp_margin, acceleration):
    """Return the fraction of (k,) accelerations that joints may have at once: `BalanceMargins.together`."""
    found = 1.0
    for e in range(len(zmp_margin)):
        total = parts = 0.0
        for k in range(len(acceleration)):
            part = zmp_shift[e, k] * acceleration[k]
            total += part
            parts += abs(part)
        found = min(found, zmp_margin[e] / max(0.5 * (abs(total) + parts), zmp_margin[e]))
    return found


@kernel
def limit_acceleration(
    rise, fastest, speed, way, q, reference, com_shift, zmp_shift, com_margin, zmp_margin, swing, allowed
):
    """Limit (k,) accelerations and speeds so that the zero-moment point stays in the support polygon, in
    place.

    Args:
        rise: (k,) accelerations, limited in place (rad/s² or m/s²).
        fastest: (k,) speeds, limited in place (rad/s or m/s).
        speed: (k,) speeds of the references (rad/s or m/s).
        way: (k,) from the references to their goals (rad or m).
        q: (k,) joint positions (rad or m).
        reference: (k,) references (rad or m).
        com_shift: (e, k) as in `BalanceMargins`.
        zmp_shift: (e, k) as in `BalanceMargins`.
        com_margin: (e,) as in `BalanceMargins` (m).
        zmp_margin: (e,) as in `BalanceMargins` (m).
        swing: (e,) as in `BalanceMargins` (m).
        allowed: result, (k,) whether a joint may move on towards its goal.
    """
    calm = math.sqrt(share(zmp_margin, swing))
    count, edges = len(rise), len(zmp_margin)
    wanted = np.empty(count)
    for k in range(count):
        if calm < 1.0:
            fastest[k] = min(fastest[k], abs(speed[k]) * calm)
        for e in range(edges):
            rise[k] = min(rise[k], zmp_margin[e] / max(abs(zmp_shift[e, k]), TINY))
        towards = speed[k] if way[k] == 0.0 else way[k]
        wanted[k] = rise[k] * np.sign(towards)
    part = together(zmp_shift, zmp_margin, wanted)
    for k in range(count):
        rise[k] *= part
        wanted[k] = reference[k] - q[k] + speed[k] * abs(speed[k]) / (2.0 * rise[k])
        allowed[k] = True
    for e in range(edges):
        left = com_margin[e]
        for k in range(count):
            left -= com_shift[e, k] * wanted[k]
        if left < 0.0:
            for k in range(count):
                if com_shift[e, k] * np.sign(way[k]) > TINY:
                    allowed[k] = False


@kernel
def advance(reference, speed, goal, way, allowed, rise, fastest, dt):
    """Move (k,) references one step of `dt` (s) towards their goals, with their speeds; both in place.

    Args:
        reference: (k,) rad or m.
        speed: (k,) rad/s or m/s.
        goal: (k,) rad or m.
        way: (k,) from the references to their goals (rad or m).
        allowed: (k,) whether a joint may move on; others brake.
        rise: (k,) largest accelerations (rad/s² or m/s²).
        fastest: (k,) largest speeds (rad/s or m/s).
        dt: time step (s).
    """
    for k in range(len(reference)):
        gap = way[k] if allowed[k] else 0.0
        # speeds fall by `rise * dt` each step: v² / 2 rise + v dt / 2 is the way to a stop
        half = 0.5 * rise[k] * dt
        braking = math.sqrt(half * half + 2.0 * rise[k] * abs(gap)) - half
        wanted = np.sign(gap) * min(min(fastest[k], braking), abs(gap) / dt)
        change = rise[k] * dt
        speed[k] = min(max(wanted, speed[k] - change), speed[k] + change)
        move = speed[k] * dt
        if np.sign(move) == np.sign(gap) and abs(move) >= (1.0 - 1e-9) * abs(gap):
            reference[k] = goal[k] if gap != 0.0 else reference[k]
            speed[k] = 0.0
        else:
            reference[k] += move
