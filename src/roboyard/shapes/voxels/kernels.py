"""Numba loops behind `roboyard.shapes.voxels.grid`: ray crossings, surface marking, distance transform."""

from __future__ import annotations

import math

import numpy as np

from roboyard._numba import njit

FAR = np.int32(2**30)


@njit(cache=True, inline="always")
def _left_of(au, av, bu, bv, pu, pv):
    """Whether p is left of a→b, with the negated result for b→a: neighbours never share a ray."""
    if au < bu or (au == bu and av < bv):
        return (bu - au) * (pv - av) - (bv - av) * (pu - au) >= 0.0
    return not ((au - bu) * (pv - bv) - (av - bv) * (pu - bu) >= 0.0)


@njit(cache=True, nogil=True)
def count_crossings(vertices, faces, axis, shape, signed, unsigned):
    """Record where rays through voxel centres along `axis` cross the triangles.

    Args:
        vertices: (n, 3) in voxel units: voxel i has its centre at i + 0.5.
        faces: (m, 3).
        axis: 0, 1 or 2; u and v below are the next two axes in cyclic order.
        shape: (3,) voxels along x, y, z.
        signed: (nu, nv, nw + 1) out: sum of crossing directions just below voxel w.
        unsigned: the same, number of crossings.
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    nu, nv, nw = shape[u], shape[v], shape[axis]
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        area = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u])
        if area == 0.0:
            continue
        i0 = max(0, math.ceil(min(a[u], b[u], c[u]) - 0.5))
        i1 = min(nu - 1, math.floor(max(a[u], b[u], c[u]) - 0.5))
        j0 = max(0, math.ceil(min(a[v], b[v], c[v]) - 0.5))
        j1 = min(nv - 1, math.floor(max(a[v], b[v], c[v]) - 0.5))
        for i in range(i0, i1 + 1):
            pu = i + 0.5
            for j in range(j0, j1 + 1):
                pv = j + 0.5
                left = _left_of(a[u], a[v], b[u], b[v], pu, pv)
                if left != _left_of(b[u], b[v], c[u], c[v], pu, pv):
                    continue
                if left != _left_of(c[u], c[v], a[u], a[v], pu, pv):
                    continue
                s = ((pu - a[u]) * (c[v] - a[v]) - (pv - a[v]) * (c[u] - a[u])) / area
                t = ((b[u] - a[u]) * (pv - a[v]) - (b[v] - a[v]) * (pu - a[u])) / area
                depth = a[axis] + s * (b[axis] - a[axis]) + t * (c[axis] - a[axis])
                k = min(max(math.ceil(depth - 0.5), 0), nw)
                signed[i, j, k] += -1 if left else 1
                unsigned[i, j, k] += 1


@njit(cache=True, nogil=True)
def closed_share(signed, unsigned):
    """Numbers of rays that hit the mesh, of those closed by direction, and of those closed by parity."""
    hit, by_sign, by_parity = 0, 0, 0
    for i in range(signed.shape[0]):
        for j in range(signed.shape[1]):
            total, count = 0, 0
            for k in range(signed.shape[2]):
                total += signed[i, j, k]
                count += unsigned[i, j, k]
            if count > 0:
                hit += 1
                by_sign += total == 0
                by_parity += count % 2 == 0
    return hit, by_sign, by_parity


@njit(cache=True, nogil=True)
def vote(signed, unsigned, axis, use_parity, inside, trusted):
    """Add one axis's votes (inside or not) for every voxel on a closed ray."""
    nw = signed.shape[2] - 1
    u, v = (axis + 1) % 3, (axis + 2) % 3
    at = np.zeros(3, np.int64)
    for i in range(signed.shape[0]):
        for j in range(signed.shape[1]):
            total, count = 0, 0
            for k in range(nw + 1):
                total += signed[i, j, k]
                count += unsigned[i, j, k]
            closed = count % 2 == 0 if use_parity else total == 0
            if not closed:
                continue
            at[u], at[v] = i, j
            winding = 0
            for k in range(nw):
                winding += unsigned[i, j, k] if use_parity else signed[i, j, k]
                at[axis] = k
                trusted[at[0], at[1], at[2]] += 1
                if (winding % 2 != 0) if use_parity else (winding != 0):
                    inside[at[0], at[1], at[2]] += 1


@njit(cache=True, inline="always")
def closest_on_triangle(a, b, c, p, out):
    """Write the point of triangle abc nearest to p; Ericson, Real-Time Collision Detection, 5.1.5."""
    ab0, ab1, ab2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    ac0, ac1, ac2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    ap0, ap1, ap2 = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2
    d2 = ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    bp0, bp1, bp2 = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3 = ab0 * bp0 + ab1 * bp1 + ab2 * bp2
    d4 = ac0 * bp0 + ac1 * bp1 + ac2 * bp2
    cp0, cp1, cp2 = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5 = ab0 * cp0 + ab1 * cp1 + ab2 * cp2
    d6 = ac0 * cp0 + ac1 * cp1 + ac2 * cp2
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = (d1 / (d1 - d3) if d1 != d3 else 0.0), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, (d2 / (d2 - d6) if d2 != d6 else 0.0)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6)) if (d4 - d3) + (d5 - d6) != 0.0 else 0.0
        s, t = 1.0 - w, w
    else:
        total = va + vb + vc
        s, t = (vb / total, vc / total) if total != 0.0 else (0.0, 0.0)
    out[0] = a[0] + s * ab0 + t * ac0
    out[1] = a[1] + s * ab1 + t * ac1
    out[2] = a[2] + s * ab2 + t * ac2


@njit(cache=True, nogil=True)
def mark_surface(vertices, faces, best, point):
    """Mark voxels that triangles pass through, each with the surface point nearest to its centre.

    Triangles are sampled at less than half a voxel. `vertices` are in voxel units; `best` (nx, ny, nz) are
    squared distances (infinite without a surface), `point` (nx, ny, nz, 3) the points.
    """
    nx, ny, nz = best.shape
    centre, q = np.zeros(3), np.zeros(3)
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        longest = 0.0
        for k in range(3):
            longest = max(longest, abs(b[k] - a[k]), abs(c[k] - a[k]), abs(c[k] - b[k]))
        steps = min(int(longest * 2.2) + 1, 4096)
        li, lj, lk = -1, -1, -1
        for s in range(steps + 1):
            for t in range(steps + 1 - s):
                x, y = s / steps, t / steps
                i = int(a[0] + x * (b[0] - a[0]) + y * (c[0] - a[0]))
                j = int(a[1] + x * (b[1] - a[1]) + y * (c[1] - a[1]))
                k = int(a[2] + x * (b[2] - a[2]) + y * (c[2] - a[2]))
                if i == li and j == lj and k == lk:
                    continue
                li, lj, lk = i, j, k
                if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
                    continue
                centre[0], centre[1], centre[2] = i + 0.5, j + 0.5, k + 0.5
                closest_on_triangle(a, b, c, centre, q)
                d = (q[0] - centre[0]) ** 2 + (q[1] - centre[1]) ** 2 + (q[2] - centre[2]) ** 2
                if d < best[i, j, k]:
                    best[i, j, k] = d
                    point[i, j, k, 0], point[i, j, k, 1], point[i, j, k, 2] = q[0], q[1], q[2]


@njit(cache=True, nogil=True)
def _envelope(cost, label, n, spot, start, out_cost, out_label):
    """Lower envelope of parabolas along one line; Felzenszwalb and Huttenlocher (2012), with labels."""
    top = -1
    for q in range(n):
        if cost[q] >= FAR:
            continue
        s = -1e18
        while top >= 0:
            p = spot[top]
            s = ((cost[q] + q * q) - (cost[p] + p * p)) / (2.0 * (q - p))
            if s > start[top]:
                break
            top -= 1
        top += 1
        spot[top] = q
        start[top] = s if top > 0 else -1e18
    if top < 0:
        for q in range(n):
            out_cost[q], out_label[q] = FAR, -1
        return
    k = 0
    for q in range(n):
        while k < top and start[k + 1] < q:
            k += 1
        p = spot[k]
        out_cost[q] = cost[p] + (q - p) * (q - p)
        out_label[q] = label[p]


@njit(cache=True, nogil=True)
def nearest_seed(seeds):
    """Return the (nx, ny, nz) int32 flat index of the nearest marked voxel (-1: none)."""
    nx, ny, nz = seeds.shape
    cost = np.empty((nx, ny, nz), np.int32)
    label = np.empty((nx, ny, nz), np.int32)
    n = max(nx, ny, nz)
    spot, start = np.empty(n, np.int32), np.empty(n, np.float64)
    c_in, l_in = np.empty(n, np.int32), np.empty(n, np.int32)
    c_out, l_out = np.empty(n, np.int32), np.empty(n, np.int32)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                seeded = seeds[i, j, k]
                c_in[k] = 0 if seeded else FAR
                l_in[k] = (i * ny + j) * nz + k if seeded else -1
            _envelope(c_in, l_in, nz, spot, start, c_out, l_out)
            for k in range(nz):
                cost[i, j, k], label[i, j, k] = c_out[k], l_out[k]
    for i in range(nx):
        for k in range(nz):
            for j in range(ny):
                c_in[j], l_in[j] = cost[i, j, k], label[i, j, k]
            _envelope(c_in, l_in, ny, spot, start, c_out, l_out)
            for j in range(ny):
                cost[i, j, k], label[i, j, k] = c_out[j], l_out[j]
    for j in range(ny):
        for k in range(nz):
            for i in range(nx):
                c_in[i], l_in[i] = cost[i, j, k], label[i, j, k]
            _envelope(c_in, l_in, nx, spot, start, c_out, l_out)
            for i in range(nx):
                label[i, j, k] = l_out[i]
    return label


@njit(cache=True, nogil=True)
def signed_distance(label, point, inside, sdf):
    """Write `sdf` (voxels): distance from voxel centres to the surface point of the nearest surface voxel."""
    nx, ny, nz = label.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                seed = label[i, j, k]
                si, rest = seed // (ny * nz), seed % (ny * nz)
                sj, sk = rest // nz, rest % nz
                dx = i + 0.5 - point[si, sj, sk, 0]
                dy = j + 0.5 - point[si, sj, sk, 1]
                dz = k + 0.5 - point[si, sj, sk, 2]
                d = math.sqrt(dx * dx + dy * dy + dz * dz)
                sdf[i, j, k] = -d if inside[i, j, k] else d


@njit(cache=True, inline="always")
def sample_field(field, x, y, z):
    """Trilinear value and gradient of a grid (voxel units); outside it the edge value plus the distance."""
    nx, ny, nz = field.shape
    qx, qy, qz = x - 0.5, y - 0.5, z - 0.5
    cx = min(max(qx, 0.0), nx - 1.000001)
    cy = min(max(qy, 0.0), ny - 1.000001)
    cz = min(max(qz, 0.0), nz - 1.000001)
    i, j, k = int(cx), int(cy), int(cz)
    fx, fy, fz = cx - i, cy - j, cz - k
    v000, v001 = field[i, j, k], field[i, j, k + 1]
    v010, v011 = field[i, j + 1, k], field[i, j + 1, k + 1]
    v100, v101 = field[i + 1, j, k], field[i + 1, j, k + 1]
    v110, v111 = field[i + 1, j + 1, k], field[i + 1, j + 1, k + 1]
    v00, v01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    v10, v11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    v0, v1 = v00 + fy * (v01 - v00), v10 + fy * (v11 - v10)
    value = v0 + fx * (v1 - v0)
    gx = v1 - v0
    gy = (v01 - v00) + fx * ((v11 - v10) - (v01 - v00))
    gz0 = (v001 - v000) + fy * ((v011 - v010) - (v001 - v000))
    gz1 = (v101 - v100) + fy * ((v111 - v110) - (v101 - v100))
    gz = gz0 + fx * (gz1 - gz0)
    ox, oy, oz = qx - cx, qy - cy, qz - cz
    out = math.sqrt(ox * ox + oy * oy + oz * oz)
    if out > 1e-5:
        value += out
        gx, gy, gz = ox / out, oy / out, oz / out
    return value, gx, gy, gz


@njit(cache=True, nogil=True)
def sample_many(field, points):
    """Return (n,) trilinear values of `field` at (n, 3) points in voxel units."""
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        out[i] = sample_field(field, points[i, 0], points[i, 1], points[i, 2])[0]
    return out
