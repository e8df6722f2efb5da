"""Volumes and masses of a urdf's shapes, in the link frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.description.urdf.elements import LinkElement, ShapeElement
from roboyard.shapes import inertia
from roboyard.shapes.inertia import SolidInertia
from roboyard.transforms import Array


def shape_solid(shape: ShapeElement) -> SolidInertia | None:
    """Mass properties at density 1 in the link frame; None where the size is not known or zero."""
    own = _own_solid(shape)
    if own is None or not (np.isfinite(own.mass) and own.mass > 0 and np.isfinite(own.inertia).all()):
        return None
    return own.moved(shape.origin[:3, 3], shape.origin[:3, :3])


def _own_solid(shape: ShapeElement) -> SolidInertia | None:
    if shape.mesh is not None:
        facts = shape.mesh.stats
        if facts is None or not facts.is_finite or not all(shape.mesh.scale):
            return None
        with np.errstate(all="ignore"):
            return facts.scaled_properties(shape.mesh.scale)
    if shape.size is None or shape.geometry is None or min(shape.size) <= 0 or max(shape.size) > 1e6:
        return None
    match shape.geometry.tag:
        case "box":
            return inertia.box(shape.size, 1.0)
        case "sphere":
            return inertia.sphere(shape.size[0], 1.0)
        case "cylinder":
            return inertia.cylinder(*shape.size, density=1.0)
        case "capsule":
            return inertia.capsule(*shape.size, density=1.0)
    return None


def link_solid(link: LinkElement) -> SolidInertia | None:
    """Of the link's collision shapes, or its visual ones where it has none of known size; at density 1."""
    for shapes in (link.collisions, link.visuals):
        parts = [solid for shape in shapes if (solid := shape_solid(shape)) is not None]
        if parts:
            return inertia.combined(parts)
    return None


def link_volumes(link: LinkElement) -> tuple[float, float] | None:
    """Smallest and largest volume (m³) that the link's visual or collision shapes take up."""
    volumes = [
        sum(part.mass for part in parts)
        for shapes in (link.collisions, link.visuals)
        if (parts := [solid for shape in shapes if (solid := shape_solid(shape)) is not None])
    ]
    if not volumes:
        return None
    boxes = [] if link.bounds is None else [float(np.prod(link.bounds[1] - link.bounds[0]))]
    return min(volumes), max(volumes + boxes)


def shape_points(shape: ShapeElement) -> Array | None:
    """(k, 3) points in the link frame whose hull is (nearly) the shape; None where it is not known."""
    if shape.mesh is not None:
        facts = shape.mesh.stats
        if facts is None or not facts.is_finite or len(facts.hull) == 0:
            return None
        points = facts.hull * np.asarray(shape.mesh.scale)
    else:
        local = _primitive_points(shape)
        if local is None:
            return None
        points = local
    return points @ shape.origin[:3, :3].T + shape.origin[:3, 3]


def _primitive_points(shape: ShapeElement) -> Array | None:
    bounds = shape.bounds
    if bounds is None or shape.geometry is None or shape.size is None:
        return None
    if shape.geometry.tag == "box":
        return np.array(
            [[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
        )
    radius, *rest = shape.size
    if shape.geometry.tag == "cylinder":
        ring = _ring(24) * radius
        half = rest[0] / 2.0
        return np.concatenate([np.column_stack([ring, np.full(24, z)]) for z in (-half, half)])
    ball = _ball() * radius
    if shape.geometry.tag == "sphere":
        return ball
    shift = np.array([0.0, 0.0, rest[0] / 2.0])
    return np.concatenate([ball - shift, ball + shift])


def _ring(count: int) -> Array:
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _ball() -> Array:
    rings = [
        np.column_stack([_ring(16) * np.cos(a), np.full(16, np.sin(a))]) for a in np.linspace(-1.2, 1.2, 7)
    ]
    return np.concatenate([*rings, [[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]]])


def hulls_meet(a: Array, b: Array, steps: int = 64) -> bool:
    """True where the convex hulls of two point sets ((n, 3) and (m, 3)) intersect.

    Looks for the point of the Minkowski difference nearest to the origin; a plane that parts the hulls ends
    the search. Undecided after `steps` counts as apart.
    Source: Gilbert, Johnson and Keerthi, "A fast procedure for computing the distance" (1988).
    """
    if (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any():
        return False
    scale = float(max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max(), 1e-12))
    nearest = a.mean(axis=0) - b.mean(axis=0)
    simplex: list[Array] = []
    for _ in range(steps):
        if nearest @ nearest < (1e-9 * scale) ** 2:
            return True
        support = a[np.argmin(a @ nearest)] - b[np.argmax(b @ nearest)]
        if support @ nearest > 0.0:
            return False
        simplex = [*simplex, support]
        nearest, simplex = _nearest_on(simplex)
        if len(simplex) == 4:
            return True
    return False


def _nearest_on(simplex: Sequence[Array]) -> tuple[Array, list[Array]]:
    """Point of a simplex of 1 to 4 corners nearest to the origin, and the corners that carry it."""
    best: tuple[float, Array, list[Array]] | None = None
    count = len(simplex)
    for subset in range(1, 1 << count):
        corners = [simplex[k] for k in range(count) if subset >> k & 1]
        base, edges = corners[0], np.array([corner - corners[0] for corner in corners[1:]]).reshape(-1, 3)
        if len(edges):
            gram = edges @ edges.T
            if np.linalg.det(gram) <= 1e-30 * max(1e-300, float(np.trace(gram))) ** len(edges):
                continue
            weights = np.linalg.solve(gram, -edges @ base)
            if (weights < 0).any() or weights.sum() > 1:
                continue
            point = base + weights @ edges
        else:
            point = base
        distance = float(point @ point)
        if best is None or distance < best[0] * (1 - 1e-12):
            best = (distance, point, corners)
    assert best is not None  # a single corner always qualifies
    return best[1], best[2]
