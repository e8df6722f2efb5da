"""Surfaces of revolution."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.shapes.mesh import TriangleMesh, read_only


def revolve(profile: ArrayLike, segments: int = 28) -> TriangleMesh:
    """Revolve an (n, 2) profile of radius and height (m) about z, with the solid on its left.

    A cup's profile starts in the middle of its foot, goes outwards, up the outside, over the rim and down the
    inside. Edges are sharp: each ring of faces has its own normals.

    Args:
        profile: (n, 2) points.
        segments: number of segments around z.

    """
    points = np.asarray(profile, dtype=float)
    angle = 2.0 * np.pi * np.arange(segments + 1) / segments
    cos, sin = np.cos(angle), np.sin(angle)
    vertices, normals, faces = [], [], []
    for (r0, z0), (r1, z1) in pairwise(points):
        start = sum(len(v) for v in vertices)
        length = np.hypot(r1 - r0, z1 - z0)
        outward, upward = (z1 - z0) / length, -(r1 - r0) / length
        for r, z in ((r0, z0), (r1, z1)):
            vertices.append(np.stack([r * cos, r * sin, np.full_like(cos, z)], axis=1))
            normals.append(np.stack([outward * cos, outward * sin, np.full_like(cos, upward)], axis=1))
        a = start + np.arange(segments)
        b = a + segments + 1
        if r0 > 0:
            faces.append(np.stack([a, a + 1, b + 1], axis=1))
        if r1 > 0:
            faces.append(np.stack([a, b + 1, b], axis=1))
    return TriangleMesh(
        vertices=read_only(np.concatenate(vertices), np.float64),
        faces=read_only(np.concatenate(faces), np.int32),
        normals=read_only(np.concatenate(normals), np.float64),
    )
