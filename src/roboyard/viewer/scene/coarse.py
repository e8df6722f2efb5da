"""Coarser meshes for the first picture of a page, and for browsers that draw in software."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from roboyard.rendering.scene import RenderShape
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.simplify import clustered

BUDGET = 24_000
"""Triangles that the dense meshes of a scene have together when they are coarse, if `COARSEST` allows it."""
FEW = 600
"""Number of triangles up to which a mesh stays as it is."""
FINEST, COARSEST = 1 / 500, 1 / 60
"""Bounds of a cell, within which vertices are merged, as fractions of the size of the shape's body."""
STEP = 1.3
"""Least ratio of two sizes of cells that are tried."""


class CoarseMeshes:
    """Merges the vertices of dense meshes within cells that are as large as the number of triangles demands.

    The cells of a body are a fraction of its size, about two pixels of a picture in low quality.
    """

    def __init__(self, budget: int = BUDGET) -> None:
        """Start without meshes; see `BUDGET`."""
        self._budget = budget
        self._known: dict[tuple[int, tuple[float, float, float]], tuple[TriangleMesh, TriangleMesh]] = {}

    def prepare(self, shapes: Iterable[RenderShape]) -> None:
        """Make the coarse meshes of all shapes of a scene; those that exist are kept."""
        dense = [shape for shape in shapes if len(shape.mesh.faces) > FEW and not shape.infinite]
        wanted = {_key(shape) for shape in dense}
        if wanted == self._known.keys():
            return
        if sum(len(shape.mesh.faces) for shape in dense) <= self._budget:
            self._known = {_key(shape): (shape.mesh, shape.mesh) for shape in dense}
            return
        sizes = _sizes(dense)
        for key in self._known.keys() - wanted:
            del self._known[key]
        share = FINEST
        while True:
            for key, shape in {_key(shape): shape for shape in dense}.items():
                _, merged = self._known.get(key, (shape.mesh, _without_unused(shape)))
                cell = share * sizes[shape.owner[0]]
                self._known[key] = shape.mesh, _merged(merged, shape.scale, cell)
            count = sum(len(self._known[_key(shape)][1].faces) for shape in dense)
            if count <= self._budget or share >= COARSEST:
                return
            # the number of triangles falls with the square of the cell at most
            share = min(max(STEP, (count / self._budget) ** 0.5) * share, COARSEST)

    def of(self, shape: RenderShape) -> RenderShape:
        """Return a shape with its coarse mesh, or the shape itself where it has none."""
        found = self._known.get(_key(shape))
        return shape if found is None or found[1] is found[0] else replace(shape, mesh=found[1])


def _key(shape: RenderShape) -> tuple[int, tuple[float, float, float]]:
    return id(shape.mesh), tuple(shape.scale)  # type: ignore[return-value]


def _without_unused(shape: RenderShape) -> TriangleMesh:
    """Return the mesh of a shape, without texture coordinates that no picture needs: they split vertices."""
    mesh = shape.mesh
    has_picture = shape.texture is not None or (shape.use_mesh_colors and mesh.texture is not None)
    return mesh if has_picture or mesh.uv is None else replace(mesh, uv=None)


def _sizes(shapes: Iterable[RenderShape]) -> dict[int, float]:
    """Return the sizes (m) of the bodies: the sum over the links of their largest extent, at most 2 m.

    Poses play no part, so that a body has the same meshes in every posture.
    """
    links: dict[tuple[int, int], float] = {}
    for shape in shapes:
        extent = float(np.ptp(shape.mesh.vertices, axis=0).max() * np.abs(shape.scale).max())
        links[shape.owner] = max(links.get(shape.owner, 0.0), extent)
    bodies: dict[int, float] = {}
    for (body, _), extent in links.items():
        bodies[body] = min(bodies.get(body, 0.0) + extent, 2.0)
    return bodies


def _merged(mesh: TriangleMesh, scale: Sequence[float], cell: float) -> TriangleMesh:
    """Return a scaled mesh with vertices merged within cells of this size (m); itself if that is no gain."""
    extent = float(np.ptp(mesh.vertices, axis=0).max() * np.abs(scale).max())
    if not (np.isfinite(extent) and extent > 0 and cell > 0) or len(mesh.faces) <= FEW:
        return mesh
    merged = clustered(mesh, int(np.clip(extent / cell, 4, 1000)))
    return merged if len(merged.faces) < 0.8 * len(mesh.faces) else mesh
