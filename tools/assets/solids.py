"""Closed solids to build robots from: rounded boxes, solids of revolution, lofts, tubes, plates.

All are generated from a few numbers; every function returns counter-clockwise faces seen from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from assets.mesh import Array, Mesh, merge

Point = tuple[float, float, float]


def rounded_rectangle(half_x: float, half_y: float, radius: float, steps: int = 4) -> Array:
    """Return a (4 (steps + 1), 2) outline, counter-clockwise; a circle if the radius equals both halves."""
    radius = min(radius, half_x, half_y)
    corner = [(half_x - radius, half_y - radius), (radius - half_x, half_y - radius),
              (radius - half_x, radius - half_y), (half_x - radius, radius - half_y)]  # fmt: skip
    angle = np.linspace(0.0, pi / 2, steps + 1)
    rows = []
    for quarter, (x, y) in enumerate(corner):
        t = angle + quarter * pi / 2
        rows.append(np.stack([x + radius * np.cos(t), y + radius * np.sin(t)], axis=1))
    return np.concatenate(rows)


def skin(rings: Sequence[Array]) -> Mesh:
    """Return a surface through closed rings of equally many points, its ends closed by fans.

    Rings run counter-clockwise seen from the end of the sequence.
    """
    n = len(rings[0])
    k = np.arange(n)
    nxt = np.roll(k, -1)
    faces = []
    for i in range(len(rings) - 1):
        low, high = i * n, (i + 1) * n
        faces.append(np.stack([low + k, low + nxt, high + nxt], axis=1))
        faces.append(np.stack([low + k, high + nxt, high + k], axis=1))
    first, last = len(rings) * n, len(rings) * n + 1
    top = (len(rings) - 1) * n
    faces.append(np.stack([nxt, k, np.full(n, first)], axis=1))
    faces.append(np.stack([top + k, top + nxt, np.full(n, last)], axis=1))
    vertices = np.concatenate([*rings, rings[0].mean(axis=0)[None], rings[-1].mean(axis=0)[None]])
    return Mesh(vertices=vertices, faces=np.concatenate(faces))


def loft(sections: Sequence[tuple[float, ...]], steps: int = 4, fillet: float = 0.0, rounds: int = 3) -> Mesh:
    """Return a solid along z through rounded rectangles `(z, x, y, half_x, half_y, radius)`, z rising.

    The two ends are rounded with `fillet`.
    """
    rows = [np.asarray(s, dtype=float) for s in sections]
    if fillet > 0.0:
        low, high = [], []
        for i in range(rounds):
            t = i / rounds * pi / 2
            inset, lift = fillet * (1 - sin(t)), fillet * (1 - cos(t))
            low.append(_inset(rows[0], inset, rows[0][0] + lift))
            high.append(_inset(rows[-1], inset, rows[-1][0] - lift))
        first, last = rows[0].copy(), rows[-1].copy()
        first[0] += fillet
        last[0] -= fillet
        rows = [*low, first, *rows[1:-1], last, *reversed(high)]
    rings = []
    for z, x, y, half_x, half_y, radius in rows:
        outline = rounded_rectangle(half_x, half_y, radius, steps) + np.array([x, y])
        rings.append(np.column_stack([outline, np.full(len(outline), z)]))
    return skin(rings)


def disc(z: float, radius: float) -> tuple[float, ...]:
    """Return a circular section about the axis, for `loft`."""
    return (z, 0.0, 0.0, radius, radius, radius)


def _inset(row: Array, inset: float, z: float) -> Array:
    _, x, y, half_x, half_y, radius = row
    least = 1e-4
    return np.array(
        [z, x, y, max(half_x - inset, least), max(half_y - inset, least), max(radius - inset, least)]
    )


def rounded_box(half: Point, radius: float, steps: int = 3, corner: float | None = None) -> Mesh:
    """Return a box about the origin with half extents `half`; `corner` is the radius of the upright edges."""
    x, y, z = half
    corner = radius if corner is None else corner
    return loft([(-z, 0, 0, x, y, corner), (z, 0, 0, x, y, corner)], steps, min(radius, z * 0.999), steps)


def revolve(profile: Sequence[tuple[float, float]], segments: int = 32) -> Mesh:
    """Return the solid of revolution about z of `(radius, z)`, z rising outside; ends close on the axis."""
    angle = np.arange(segments) * (2 * pi / segments)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = [np.column_stack([circle * r, np.full(segments, z)]) for r, z in profile]
    return skin(rings)


def hoop(profile: Sequence[tuple[float, float]], segments: int = 32) -> Mesh:
    """Return the solid of revolution about z of a closed outline `(radius, z)` away from the axis.

    The outline runs upwards on the outside.
    """
    angle = np.arange(segments) * (2 * pi / segments)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _closed([np.column_stack([circle * r, np.full(segments, z)]) for r, z in profile])


def drum(
    radius: float, low: float, high: float, fillet: float = 0.004, segments: int = 32, rounds: int = 2
) -> Mesh:
    """Return a cylinder about z from `low` to `high` with rounded rims."""
    profile = []
    for i in range(rounds + 1):
        t = i / rounds * pi / 2
        profile.append((radius - fillet * (1 - sin(t)), low + fillet * (1 - cos(t))))
    for i in range(rounds + 1):
        t = (1 - i / rounds) * pi / 2
        profile.append((radius - fillet * (1 - sin(t)), high - fillet * (1 - cos(t))))
    return revolve(profile, segments)


def ring(radius: float, tube: float, low: float, high: float, segments: int = 32) -> Mesh:
    """Return a band about z: outer `radius`, wall `tube`, square section."""
    return hoop([(radius, low), (radius, high), (radius - tube, high), (radius - tube, low)], segments)


def torus(radius: float, tube: float, segments: int = 32, sides: int = 10, squash: float = 1.0) -> Mesh:
    """Return a ring of circular section about z; `squash` scales its height."""
    around = [2 * pi * i / sides for i in range(sides)]
    return hoop([(radius + tube * cos(t), tube * squash * sin(t)) for t in around], segments)


def _closed(rings: Sequence[Array]) -> Mesh:
    """Return the surface through rings, the last joined to the first."""
    n, m = len(rings[0]), len(rings)
    k = np.arange(n)
    nxt = np.roll(k, -1)
    faces = []
    for i in range(m):
        low, high = i * n, (i + 1) % m * n
        faces.append(np.stack([low + k, low + nxt, high + nxt], axis=1))
        faces.append(np.stack([low + k, high + nxt, high + k], axis=1))
    return Mesh(vertices=np.concatenate(rings), faces=np.concatenate(faces))


def tube(points: Sequence[Point], radius: float, sides: int = 10, caps: int = 2) -> Mesh:
    """Return a round bar along a polyline, mitred at its bends, with domed ends."""
    path = np.asarray(points, dtype=float)
    steps = np.diff(path, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    tangents = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents[0], (0, 0, 1) if abs(tangents[0][2]) < 0.9 else (1, 0, 0))
    angle = np.arange(sides) * (2 * pi / sides)
    rings = []

    def add(center: Array, tangent: Array, size: float) -> None:
        u = side - tangent * (side @ tangent)
        u /= np.linalg.norm(u)
        w = np.cross(tangent, u)
        rings.append(center + size * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * w))

    for i in range(caps):
        t = i / caps * pi / 2
        add(path[0] - tangents[0] * radius * cos(t), tangents[0], radius * sin(t))
    for i, (center, tangent) in enumerate(zip(path, tangents, strict=True)):
        stretch = 1.0 if i in (0, len(path) - 1) else 1.0 / max(tangent @ steps[i - 1], 0.5)
        side = side - tangent * (side @ tangent)
        add(center, tangent, radius * (0.5 + 0.5 * stretch))
    for i in range(caps):
        t = (1 - (i + 1) / caps) * pi / 2
        add(path[-1] + tangents[-1] * radius * cos(t), tangents[-1], radius * sin(t))
    return skin(rings)


def bend(points: Sequence[Point], radius: float, steps: int = 4) -> list[Point]:
    """Return the polyline with its inner corners replaced by arcs that start `radius` before each corner."""
    path = [np.asarray(p, dtype=float) for p in points]
    out = [path[0]]
    for before, corner, after in zip(path, path[1:], path[2:], strict=False):
        a = corner + (before - corner) / np.linalg.norm(before - corner) * radius
        b = corner + (after - corner) / np.linalg.norm(after - corner) * radius
        for i in range(steps + 1):
            t = i / steps
            out.append((1 - t) ** 2 * a + 2 * t * (1 - t) * corner + t**2 * b)
    out.append(path[-1])
    return [tuple(float(x) for x in p) for p in out]  # type: ignore[misc]


def ball(radius: float, segments: int = 24, rings: int = 12) -> Mesh:
    """Return a sphere about the origin."""
    latitudes = [pi * (i / rings - 0.5) for i in range(rings + 1)]
    return revolve([(radius * cos(t), radius * sin(t)) for t in latitudes], segments)


def dome(radius: float, height: float, segments: int = 32, rings: int = 8) -> Mesh:
    """Return half an ellipsoid above z = 0."""
    latitudes = [pi / 2 * i / rings for i in range(rings + 1)]
    return revolve([(radius * cos(t), height * sin(t)) for t in latitudes], segments)


def plate(outline: Sequence[tuple[float, float]], low: float, high: float, bevel: float = 0.0) -> Mesh:
    """Return a flat piece from z `low` to `high` with bevelled edges; its outline runs counter-clockwise."""
    points = np.asarray(outline, dtype=float)
    inner = _shrink(points, bevel) if bevel > 0 else points
    rings = [(inner, low), (points, low + bevel), (points, high - bevel), (inner, high)]
    if bevel == 0.0:
        rings = [rings[0], rings[3]]
    n = len(points)
    k = np.arange(n)
    nxt = np.roll(k, -1)
    faces = []
    for i in range(len(rings) - 1):
        a, b = i * n, (i + 1) * n
        faces += [np.stack([a + k, a + nxt, b + nxt], axis=1), np.stack([a + k, b + nxt, b + k], axis=1)]
    lid = np.array(_ears(points))
    top = (len(rings) - 1) * n
    faces += [lid[:, ::-1], lid + top]
    vertices = np.concatenate([np.column_stack([p, np.full(n, z)]) for p, z in rings])
    return Mesh(vertices=vertices, faces=np.concatenate(faces))


def _shrink(points: Array, distance: float) -> Array:
    """Return the outline with every edge moved inwards by `distance`."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    before /= np.linalg.norm(before, axis=1, keepdims=True)
    after /= np.linalg.norm(after, axis=1, keepdims=True)
    normal = np.stack([-before[:, 1] - after[:, 1], before[:, 0] + after[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    cosine = -normal[:, 0] * before[:, 1] + normal[:, 1] * before[:, 0]
    return points + normal * (distance / np.maximum(cosine, 0.3))[:, None]


def _ears(points: Array) -> list[tuple[int, int, int]]:
    """Return the triangles of a simple counter-clockwise polygon, by ear clipping."""

    def cross(o: int, a: int, b: int) -> float:
        u, v = points[a] - points[o], points[b] - points[o]
        return float(u[0] * v[1] - u[1] * v[0])

    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        for i, b in enumerate(left):
            a, c = left[i - 1], left[(i + 1) % len(left)]
            if cross(a, b, c) <= 1e-12:
                continue
            others = (p for p in left if p not in (a, b, c))
            if any(cross(a, b, p) >= 0 and cross(b, c, p) >= 0 and cross(c, a, p) >= 0 for p in others):
                continue
            triangles.append((a, b, c))
            left.pop(i)
            break
        else:
            raise ValueError("the outline crosses itself")
    return [*triangles, (left[0], left[1], left[2])]


def mirrored(mesh: Mesh, axis: str = "y") -> Mesh:
    """Return the mesh and its mirror image."""
    sign = {"x": (-1, 1, 1), "y": (1, -1, 1), "z": (1, 1, -1)}[axis]
    return merge(mesh, mesh.scaled(*sign))


def arrayed(mesh: Mesh, count: int, phase: float = 0.0) -> Mesh:
    """Return `count` copies evenly around the z axis."""
    return merge(*(mesh.moved(rpy=(0, 0, phase + 2 * pi * i / count)) for i in range(count)))
