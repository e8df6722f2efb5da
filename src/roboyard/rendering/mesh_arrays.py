"""`MeshArrays`: the arrays that the renderer needs of a mesh, computed once for all shapes that use it."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.rendering.smoothing import closed_faces, creased_normals, face_forward, join_corners
from roboyard.shapes.mesh import TriangleMesh, bounding_box


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MeshArrays:
    """Arrays of one mesh.

    The faces are sorted into four runs: opaque closed, opaque open, transparent closed, transparent open.
    """

    vertices: NDArray[np.float32]
    """(n, 3) merged vertices in the mesh frame (m)."""
    faces: NDArray[np.int32]
    """(m, 3) vertex indices."""
    normals: NDArray[np.float32]
    """(m, 3, 3) unit normal at each corner, on the front side of its face."""
    uv: NDArray[np.float32] | None
    """(m, 3, 2) texture coordinates of the corners; None: no texture."""
    colors: NDArray[np.uint8] | None
    """(m, 4) RGBA of the faces; None: the mesh has no colours."""
    runs: tuple[int, int, int, int, int]
    """Bounds of the four runs of faces."""
    bounds: NDArray[np.float64]
    """(2, 3) lower and upper corner of the bounding box (m)."""


_prepared: WeakKeyDictionary[TriangleMesh, MeshArrays] = WeakKeyDictionary()


def mesh_arrays(mesh: TriangleMesh) -> MeshArrays:
    """Return the arrays of `mesh`, cached as long as the mesh exists."""
    arrays = _prepared.get(mesh)
    if arrays is None:
        arrays = _prepared[mesh] = _prepare(mesh)
    return arrays


def unsorted_arrays(mesh: TriangleMesh) -> MeshArrays:
    """Return `mesh_arrays` if they exist, else the same arrays with all faces in one run, not cached."""
    arrays = _prepared.get(mesh)
    return _prepare(mesh, is_sorted=False) if arrays is None else arrays


def _prepare(mesh: TriangleMesh, *, is_sorted: bool = True) -> MeshArrays:
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(mesh.vertices).all(axis=1))
    places, joined = join_corners(np.where(finite[:, None], mesh.vertices, 0.0), mesh.faces)
    whole = (
        finite[mesh.faces].all(axis=1)
        & (joined[:, 0] != joined[:, 1])
        & (joined[:, 1] != joined[:, 2])
        & (joined[:, 2] != joined[:, 0])
    )
    index = np.flatnonzero(whole)
    faces = joined[index]
    counts = np.array([0, len(faces), 0, 0])
    if is_sorted:
        closed = closed_faces(places, faces)
        clear = np.zeros(len(index), dtype=bool)
        if mesh.colors is not None:
            clear = mesh.colors[index, 3] < 255
        order = np.lexsort((~closed, clear))
        counts = np.bincount(2 * clear + ~closed, minlength=4)
        index, faces = index[order], faces[order]
    bounds = bounding_box(places) if len(places) else np.zeros((2, 3))
    return MeshArrays(
        vertices=np.ascontiguousarray(places, dtype=np.float32),
        faces=np.ascontiguousarray(faces, dtype=np.int32),
        normals=_corner_normals(mesh, index, places, faces),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[mesh.faces[index]], dtype=np.float32),
        colors=None if mesh.colors is None else np.ascontiguousarray(mesh.colors[index]),
        runs=(0, *(int(n) for n in np.cumsum(counts))),  # pyright: ignore[reportArgumentType]
        bounds=bounds,
    )


def _corner_normals(
    mesh: TriangleMesh, index: NDArray, places: NDArray, faces: NDArray
) -> NDArray[np.float32]:
    """Return (m, 3, 3) corner normals on the front side: the file's, or computed ones if these are bad."""
    if mesh.normals is None:
        return creased_normals(places, faces)
    corners = np.ascontiguousarray(mesh.faces[index], dtype=np.int64)
    out = np.empty((len(faces), 3, 3), dtype=np.float32)
    numbers = np.ascontiguousarray(faces, dtype=np.int64)
    given = np.ascontiguousarray(mesh.normals, dtype=np.float64)
    is_usable = face_forward(given, corners, np.ascontiguousarray(places, dtype=np.float64), numbers, out)
    return out if is_usable else creased_normals(places, faces)
