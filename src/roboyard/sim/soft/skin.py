"""The visible surface of a soft body: a mesh whose vertices follow the nodes."""

from __future__ import annotations

import numpy as np

from roboyard._records import dataclass
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.sim.soft.rest_shape import Ints
from roboyard.transforms import Array

_NEAREST = 24
"""Elements with the nearest centres among which the one around a vertex is looked for."""
_CHUNK = 2**20
_ROUNDING = 1e-9
"""Weights below this are 0."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Skin:
    """A mesh whose vertices are weighted sums of nodes."""

    mesh: TriangleMesh
    """At rest (m)."""
    nodes: Ints
    """(v, k) nodes of each vertex."""
    weights: Array
    """(v, k), with a sum of 1 each."""

    def deformed(self, positions: Array) -> TriangleMesh:
        """Return the mesh for nodes (n, 3) (m)."""
        mesh = self.mesh
        return TriangleMesh(
            vertices=read_only(self.vertices(positions), np.float64),
            faces=mesh.faces, uv=mesh.uv, colors=mesh.colors, texture=mesh.texture,
        )  # fmt: skip

    def vertices(self, positions: Array) -> Array:
        """Return the (v, 3) vertices for nodes (n, 3) (m)."""
        return np.einsum("vk,vkc->vc", self.weights, positions[self.nodes])


def surface_skin(positions: Array, triangles: Ints) -> Skin:
    """Return the skin that consists of the nodes themselves: (n, 3) (m), (m, 3).

    An image shows its middle on it.
    """
    count = len(positions)
    mesh = TriangleMesh(
        vertices=read_only(positions, np.float64),
        faces=read_only(triangles, np.int32),
        uv=read_only(np.full((count, 2), 0.5), np.float64),
    )
    return Skin(mesh=mesh, nodes=np.arange(count, dtype=np.int32)[:, None], weights=np.ones((count, 1)))


def embedded_skin(mesh: TriangleMesh, positions: Array, elements: Ints) -> Skin:
    """Return the skin of a mesh whose vertices keep their place in the elements around or nearest to them.

    Args:
        mesh: at rest (m).
        positions: (n, 3) nodes at rest (m).
        elements: (m, 3) triangles or (m, 4) tetrahedra.
    """
    vertices = np.asarray(mesh.vertices)
    corners = positions[elements]
    centres = corners.mean(axis=1)
    near = min(_NEAREST, len(elements))
    nodes = np.empty((len(vertices), elements.shape[1]), dtype=np.int32)
    weights = np.empty((len(vertices), elements.shape[1]))
    size = max(1, _CHUNK // max(1, len(elements)))
    for start in range(0, len(vertices), size):
        chunk = vertices[start : start + size]
        distance = ((chunk[:, None] - centres[None]) ** 2).sum(axis=2)
        chosen = np.argpartition(distance, near - 1, axis=1)[:, :near]
        found = _weights(chunk, corners[chosen])
        # negative weights are outside; triangles also count the distance from their plane
        outside = -found.min(axis=2)
        placed = np.einsum("vek,vekc->vec", found, corners[chosen])
        outside = np.maximum(outside, 0.0) + np.linalg.norm(placed - chunk[:, None], axis=2)
        best = outside.argmin(axis=1)
        rows = np.arange(len(chunk))
        nodes[start : start + size] = elements[chosen[rows, best]]
        weights[start : start + size] = found[rows, best]
    return Skin(mesh=mesh, nodes=nodes, weights=weights)


def _weights(points: Array, corners: Array) -> Array:
    """Return (v, e, k) barycentric weights of points (v, 3) in elements (v, e, k, 3), or in their planes."""
    sides = corners[:, :, 1:] - corners[:, :, :1]
    squares = sides @ np.swapaxes(sides, 2, 3)
    squares += 1e-12 * np.trace(squares, axis1=2, axis2=3)[..., None, None] * np.eye(squares.shape[-1])
    rest = np.linalg.solve(squares, sides @ (points[:, None] - corners[:, :, 0])[..., None])[..., 0]
    rest[np.abs(rest) < _ROUNDING] = 0.0
    first = 1.0 - rest.sum(axis=2, keepdims=True)
    first[np.abs(first) < _ROUNDING] = 0.0
    found = np.concatenate([first, rest], axis=2)
    return found / found.sum(axis=2, keepdims=True)
