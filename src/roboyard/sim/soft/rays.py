"""Rays against the surfaces of soft bodies."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from roboyard._records import NamedTuple
from roboyard.sim.soft.rest_shape import Ints
from roboyard.transforms import Array

_CHUNK = 2**20
_PARALLEL = 1e-15


class SoftHits(NamedTuple):
    """The first surfaces of soft bodies along k rays."""

    fraction: Array
    """(k,) 0 at the ray's start, 1 at its end; infinite for a miss."""
    body: np.ndarray
    """(k,) body ids; -1 for a miss."""
    normal: Array
    """(k, 3) unit normals against the ray."""


def first_hits(surfaces: Iterable[tuple[int, Array, Ints]], starts: Array, ways: Array) -> SoftHits:
    """Return the first triangle along each ray.

    Source: T. Möller, B. Trumbore, "Fast, minimum storage ray-triangle intersection", JGT 2(1), 1997.

    Args:
        surfaces: body id, (n, 3) nodes (m) and (m, 3) triangles of each soft body.
        starts: (k, 3) points in the world frame (m).
        ways: (k, 3) vectors from there to the rays' ends (m).
    """
    count = len(ways)
    best = SoftHits(np.full(count, np.inf), np.full(count, -1, dtype=np.int32), np.zeros((count, 3)))
    for body, nodes, triangles in surfaces:
        corners = nodes[triangles]
        first, one, two = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        size = max(1, _CHUNK // max(1, len(triangles)))
        for at in range(0, count, size):
            rows = slice(at, at + size)
            fraction, triangle = _nearest(first, one, two, starts[rows], ways[rows])
            nearer = np.flatnonzero(fraction < best.fraction[rows])
            chosen, places = triangle[nearer], nearer + at
            normal = np.cross(one[chosen], two[chosen])
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            normal *= -np.sign(np.einsum("ij,ij->i", normal, ways[places]))[:, None]
            best.fraction[places], best.body[places], best.normal[places] = fraction[nearer], body, normal
    return best


def _nearest(first: Array, one: Array, two: Array, starts: Array, ways: Array) -> tuple[Array, np.ndarray]:
    """Return the fraction (k,) of the nearest triangle along each ray, infinite for none, and its index."""
    across = np.cross(ways[:, None], two[None])
    determinant = np.einsum("tc,ktc->kt", one, across)
    inverse = np.divide(
        1.0, determinant, out=np.zeros_like(determinant), where=np.abs(determinant) > _PARALLEL
    )
    offset = starts[:, None] - first[None]
    u = np.einsum("ktc,ktc->kt", offset, across) * inverse
    around = np.cross(offset, one[None])
    v = np.einsum("kc,ktc->kt", ways, around) * inverse
    fraction = np.einsum("tc,ktc->kt", two, around) * inverse
    inside = (
        (inverse != 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (fraction >= 0.0) & (fraction <= 1.0)
    )
    fraction = np.where(inside, fraction, np.inf)
    triangle = fraction.argmin(axis=1)
    return fraction[np.arange(len(fraction)), triangle], triangle
