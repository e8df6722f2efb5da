"""Simplify dense meshes for small images."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.mesh import TriangleMesh, read_only

DENSE = 20_000
"""Number of triangles above which a mesh is simplified."""
CELLS = 256
"""Cells along the mesh's longest side: in an image 300 pixels wide a cell is little more than a pixel."""
UV_CELLS = 64
"""Merged vertices differ in texture coordinates by less than 1 / `UV_CELLS`."""

_known: WeakKeyDictionary[TriangleMesh, TriangleMesh] = WeakKeyDictionary()


def for_small_pictures(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh itself if it is small, else `clustered`, cached for the life of the mesh."""
    if len(mesh.faces) <= DENSE:
        return mesh
    found = _known.get(mesh)
    if found is None:
        found = _known[mesh] = clustered(mesh, CELLS)
    return found


def clustered(mesh: TriangleMesh, cells: int) -> TriangleMesh:
    """Return the mesh with all vertices of each grid cell merged at their mean, without collapsed faces.

    No vertex moves by more than the diagonal of a cell. Faces keep their order, colours and texture; normals
    are dropped, since merged vertices have no common normal.

    Args:
        mesh: any triangles with finite vertices.
        cells: number of cells along the longest side of the mesh's bounding box.
    """
    if not len(mesh.vertices):
        return mesh
    lower, upper = mesh.bounds
    size = max(float((upper - lower).max()) / cells, 1e-300)
    cell = np.minimum(np.floor((mesh.vertices - lower) / size), cells - 1).astype(np.int64)
    key = (cell[:, 0] * cells + cell[:, 1]) * cells + cell[:, 2]
    if mesh.uv is not None:
        patch = np.floor(np.clip(mesh.uv, -8.0, 8.0) * UV_CELLS).astype(np.int64) + 8 * UV_CELLS
        key = (key * (16 * UV_CELLS + 1) + patch[:, 0]) * (16 * UV_CELLS + 1) + patch[:, 1]
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[mesh.faces]
    kept = _first_of_each(faces)
    return TriangleMesh(
        vertices=read_only(_means(mesh.vertices, number.reshape(-1), len(first)), np.float64),
        faces=read_only(faces[kept], np.int32),
        uv=None if mesh.uv is None else read_only(mesh.uv[first], np.float64),
        colors=None if mesh.colors is None else read_only(mesh.colors[kept], np.uint8),
        texture=mesh.texture,
    )


def _means(values: NDArray[np.float64], number: NDArray[np.int64], count: int) -> NDArray[np.float64]:
    """Return the (count, 3) mean of the values of each number."""
    sums = [np.bincount(number, weights=values[:, axis], minlength=count) for axis in range(3)]
    return np.stack(sums, axis=1) / np.bincount(number, minlength=count)[:, None]


def _first_of_each(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the rows of faces with three different corners, the first of each corner cycle."""
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    rows = np.flatnonzero(whole)
    if not len(rows):
        return rows
    turn = faces[rows].argmin(axis=1)
    a, b, c = (faces[rows, (turn + k) % 3] for k in range(3))
    order = np.lexsort((rows, c, b, a))
    same = (np.diff(a[order]) == 0) & (np.diff(b[order]) == 0) & (np.diff(c[order]) == 0)
    return np.sort(rows[order[np.concatenate([[True], ~same])]])
