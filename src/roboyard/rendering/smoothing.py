"""Shading normals, closed parts and merged vertices of a triangle mesh."""

from __future__ import annotations

import math

import numpy as np

from roboyard._arrays import NDArray
from roboyard.native import compiled
from roboyard.shapes.distinct_rows import distinct_rows

CREASE_COSINE = 0.76
"""Cosine of the crease angle: edges sharper than about 40 degrees are not smoothed."""
_SHARED = 64
"""Where edges share their first vertex with more others than so many on average, they are sorted."""


def join_corners(vertices: NDArray, faces: NDArray) -> tuple[NDArray, NDArray]:
    """Merge the (n, 3) vertices that coincide within 1e-6 of the extent.

    Returns (k, 3) distinct vertices and the (m, 3) faces that index them.
    """
    if not len(vertices):
        return vertices, faces
    extent = float(np.ptp(vertices, axis=0).max())
    grid = np.round(vertices / max(extent * 1e-6, 1e-12)).astype(np.int64)
    keep, number = distinct_rows(np.ascontiguousarray(grid - grid.min(axis=0)))
    return vertices[keep], number.astype(np.int32)[faces]


def closed_faces(vertices: NDArray, faces: NDArray) -> NDArray[np.bool_]:
    """Return (m,) whether each of the (m, 3) faces belongs to a closed part that faces outward.

    The back of such a face is never visible from outside. `vertices` is (n, 3) (m).
    """
    if not len(faces):
        return np.zeros(0, dtype=bool)
    n, edges = len(vertices), faces.size
    corners = np.ascontiguousarray(faces, dtype=np.int64)
    start, stop = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    part = np.empty(n, dtype=np.int64)
    count = number_parts(start, stop, part)
    volume, is_open = np.zeros(count), np.zeros(count, dtype=np.uint8)
    order, bounds = np.empty(edges, dtype=np.int64), np.empty(n + 1, dtype=np.int64)
    sort_corners(start, order, bounds)
    if (np.diff(bounds) ** 2).sum() <= _SHARED * edges:
        find_open_parts(start, stop, part, order, bounds, is_open)
    elif count == 1 and not _may_be_paired(start, stop, n):
        return np.zeros(len(faces), dtype=bool)
    else:  # many edges begin at the same vertices
        forward, counts = np.unique(start * n + stop, return_counts=True)
        back = stop * n + start
        paired = forward[np.minimum(np.searchsorted(forward, back), len(forward) - 1)] == back
        once = counts[np.searchsorted(forward, start * n + stop)] == 1
        is_open[part[start[~(paired & once)]]] = 1
    centre = vertices.mean(axis=0)
    add_volumes(np.ascontiguousarray(vertices - centre, dtype=np.float64), corners, part, volume)
    return ((is_open == 0) & (volume > 0))[part[corners[:, 0]]]


def is_closed(vertices: NDArray, faces: NDArray) -> bool:
    """Return whether the (m, 3) faces close around a volume and face outward; `vertices` is (n, 3) (m).

    Faces that coincide with faces of the other side may be missing: the surface is closed all the same.
    """
    if not len(faces):
        return False
    start = faces.ravel().astype(np.int64)
    if not _may_be_paired(start, np.roll(faces, -1, axis=1).ravel().astype(np.int64), len(vertices)):
        return False
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    return bool(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0.0)


def _may_be_paired(start: NDArray, stop: NDArray, count: int) -> bool:
    """Return False if some directed edge has no opposite; open meshes are detected without sorting.

    Edges and their opposites cancel in a sum of random numbers whose sign depends on the edge's direction.
    """
    one, two = _scattered(np.arange(2 * count, dtype=np.uint64)).reshape(2, count)
    return int((one[start] * two[stop] - one[stop] * two[start]).sum(dtype=np.uint64)) == 0


def _scattered(numbers: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return a pseudorandom number for each number, without NumPy's generators, which take long to import.

    Source:
        splitmix64, by S. Vigna (public domain).
    """
    mixed = (numbers + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return mixed ^ (mixed >> np.uint64(31))


def creased_normals(vertices: NDArray, faces: NDArray, cosine: float = CREASE_COSINE) -> NDArray[np.float32]:
    """Return (m, 3, 3) unit normals of the corners of the faces.

    A corner's normal is the mean over the faces around its vertex, weighted by their angle there, of those
    that meet this face at less than the crease angle, whose cosine is given.
    """
    corners = np.ascontiguousarray(faces, dtype=np.int64)
    normals, angle = np.empty((len(faces), 3)), np.empty((len(faces), 3))
    measure_faces(np.ascontiguousarray(vertices, dtype=np.float64), corners, normals, angle)
    order = np.empty(corners.size, dtype=np.int64)
    start = np.empty(len(vertices) + 1, dtype=np.int64)
    sort_corners(corners.ravel(), order, start)
    out = np.empty((len(faces), 3, 3), dtype=np.float32)
    _average(normals, angle, order, start, float(cosine), out)
    return out


@compiled("f8[:,::1] i8[:,::1] f8[:,::1] i8[:,::1] f4[:,:,::1] -> i8", releases_gil=True)
def face_forward(given, places, vertices, faces, out):
    """Write the unit normal of each corner, on the front side of its face; return whether all can be used.

    given: (k, 3) normals of any length. places: (m, 3), those of the corners. vertices: (n, 3) (m).
    faces: (m, 3). out: (m, 3, 3), written. None can be used that is not finite or shorter than 1e-6.
    """
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        x0, y0, z0 = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        x1, y1, z1 = (
            vertices[c, 0] - vertices[a, 0],
            vertices[c, 1] - vertices[a, 1],
            vertices[c, 2] - vertices[a, 2],
        )
        x, y, z = y0 * z1 - z0 * y1, z0 * x1 - x0 * z1, x0 * y1 - y0 * x1
        for corner in range(3):
            normal = places[face, corner]
            u, v, w = given[normal, 0], given[normal, 1], given[normal, 2]
            length = math.sqrt(u * u + v * v + w * w)
            if not (1e-6 < length < math.inf):
                return 0
            u, v, w = u / length, v / length, w / length
            if u * x + v * y + w * z < 0.0:
                u, v, w = -u, -v, -w
            out[face, corner, 0] = u
            out[face, corner, 1] = v
            out[face, corner, 2] = w
    return 1


@compiled("i8[::1] i8[::1] i8[::1] -> i8", releases_gil=True)
def number_parts(start, stop, part):
    """Number the connected parts of vertices in the order of their first ones; returns how many there are.

    start, stop: (e,) vertices that edges join. part: (n,), written: the number of each vertex's part.
    """
    for vertex in range(len(part)):
        part[vertex] = vertex
    for edge in range(len(start)):
        a, b = start[edge], stop[edge]
        while part[a] != a:
            part[a] = part[part[a]]
            a = part[a]
        while part[b] != b:
            part[b] = part[part[b]]
            b = part[b]
        if a < b:
            part[b] = a
        else:
            part[a] = b
    # each vertex now points to one before it, or to itself if it is the first of its part
    count = 0
    for vertex in range(len(part)):
        if part[vertex] == vertex:
            part[vertex] = count
            count += 1
        else:
            part[vertex] = part[part[vertex]]
    return count


@compiled("i8[::1] i8[::1] i8[::1]", releases_gil=True)
def sort_corners(flat, order, start):
    """Sort corners by their vertices, those of a vertex in the order in which they are given.

    flat: (k,) vertex of each corner. order: (k,), written: the corners. start: (n + 1,), written: the bounds
    of each vertex's corners in `order`.
    """
    for vertex in range(len(start)):
        start[vertex] = 0
    for corner in range(len(flat)):
        start[flat[corner]] += 1
    total = 0
    for vertex in range(len(start)):
        count = start[vertex]
        start[vertex] = total
        total += count
    for corner in range(len(flat)):
        vertex = flat[corner]
        order[start[vertex]] = corner
        start[vertex] += 1
    for vertex in range(len(start) - 1, 0, -1):
        start[vertex] = start[vertex - 1]
    start[0] = 0


@compiled("i8[::1] i8[::1] i8[::1] i8[::1] i8[::1] u1[::1]", releases_gil=True)
def find_open_parts(start, stop, part, order, bounds, is_open):
    """Write 1 for parts of which an edge is there twice, or has no opposite.

    start, stop: (e,) vertices of edges. part: (n,) of vertices. order, bounds: of `sort_corners`.
    """
    for edge in range(len(start)):
        a, b = start[edge], stop[edge]
        same, opposite = 0, False
        for k in range(bounds[a], bounds[a + 1]):
            if stop[order[k]] == b:
                same += 1
        for k in range(bounds[b], bounds[b + 1]):
            if stop[order[k]] == a:
                opposite = True
        if same > 1 or not opposite:
            is_open[part[a]] = 1


@compiled("f8[:,::1] i8[:,::1] i8[::1] f8[::1]", releases_gil=True)
def add_volumes(vertices, faces, part, volume):
    """Add six times the signed volume between each face and the origin to that of its part."""
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        x = vertices[b, 1] * vertices[c, 2] - vertices[b, 2] * vertices[c, 1]
        y = vertices[b, 2] * vertices[c, 0] - vertices[b, 0] * vertices[c, 2]
        z = vertices[b, 0] * vertices[c, 1] - vertices[b, 1] * vertices[c, 0]
        volume[part[a]] += vertices[a, 0] * x + vertices[a, 1] * y + vertices[a, 2] * z


@compiled("f8[:,::1] i8[:,::1] f8[:,::1] f8[:,::1]", releases_gil=True)
def measure_faces(vertices, faces, normals, angle):
    """Write the unit normal of each face, zero for one without area, and the angles of its corners (rad)."""
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        x0, y0, z0 = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        x1, y1, z1 = (
            vertices[c, 0] - vertices[b, 0],
            vertices[c, 1] - vertices[b, 1],
            vertices[c, 2] - vertices[b, 2],
        )
        x2, y2, z2 = (
            vertices[a, 0] - vertices[c, 0],
            vertices[a, 1] - vertices[c, 1],
            vertices[a, 2] - vertices[c, 2],
        )
        x, y, z = z0 * y2 - y0 * z2, x0 * z2 - z0 * x2, y0 * x2 - x0 * y2
        length = math.sqrt(x * x + y * y + z * z)
        inverse = 1.0 / length if length > 0.0 else 0.0
        normals[face, 0], normals[face, 1], normals[face, 2] = x * inverse, y * inverse, z * inverse
        ab = math.sqrt(x0 * x0 + y0 * y0 + z0 * z0)
        bc = math.sqrt(x1 * x1 + y1 * y1 + z1 * z1)
        ca = math.sqrt(x2 * x2 + y2 * y2 + z2 * z2)
        angle[face, 0] = angle_between(-(x0 * x2 + y0 * y2 + z0 * z2), ab * ca)
        angle[face, 1] = angle_between(-(x1 * x0 + y1 * y0 + z1 * z0), bc * ab)
        angle[face, 2] = angle_between(-(x2 * x1 + y2 * y1 + z2 * z1), ca * bc)


def angle_between(product, lengths):
    """Return the angle (rad) of two edges with a scalar product, given the product of their lengths."""
    cosine = product / lengths if lengths > 0.0 else 0.0
    return math.acos(min(max(cosine, -1.0), 1.0))


@compiled("f8[:,::1] f8[:,::1] i8[::1] i8[::1] f8 f4[:,:,::1]")
def _average(normals, angle, order, start, cosine, out):
    """Write the normal of each corner of each face.

    normals: (m, 3) of the faces. angle: (m, 3) of their corners (rad). order: (3 m,) corners sorted by
    vertex. start: (n + 1,) their bounds in `order`. out: (m, 3, 3), written.
    """
    for vertex in range(len(start) - 1):
        for i in range(start[vertex], start[vertex + 1]):
            face, corner = order[i] // 3, order[i] % 3
            x, y, z = 0.0, 0.0, 0.0
            for j in range(start[vertex], start[vertex + 1]):
                other = order[j] // 3
                n0, n1, n2 = normals[other, 0], normals[other, 1], normals[other, 2]
                if (
                    normals[face, 0] * n0 + normals[face, 1] * n1 + normals[face, 2] * n2 >= cosine
                    or other == face
                ):
                    weight = angle[other, order[j] % 3]
                    x += weight * n0
                    y += weight * n1
                    z += weight * n2
            length = np.sqrt(x * x + y * y + z * z)
            if length < 1e-12:
                x, y, z, length = normals[face, 0], normals[face, 1], normals[face, 2], 1.0
            out[face, corner, 0] = x / length
            out[face, corner, 1] = y / length
            out[face, corner, 2] = z / length
