"""Meshes inside a MuJoCo spec: each distinct one once, as long as something uses it.

Meshes that are named by their content are files of the spec's own (in memory), since MuJoCo keeps what it
computes of a mesh that comes from a file: another compile of the process takes a tenth of the time.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._digests import blake2b
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.sim.build.hull_order import on_grid, ordered_hull
from roboyard.sim.build.hull_store import load_group, load_hull, store_group, store_hull
from roboyard.sim.build.prisms import prism_faces
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco

_HULLS: dict[bytes, tuple[Array, np.ndarray]] = {}
_HULLS_LIMIT = 4096
_searched = [0]
"""Number of hulls that were not known and are not found sooner than a file is read."""
_MSH_HEADER = struct.Struct("<4i")
FEWEST_TOGETHER = 2
"""Fewest hulls that are kept in one file."""
MOST_PRISM_CORNERS = 512
"""Meshes with more corners are searched for their hull."""
MOST_POINTS = 128
"""Points whose hull on a grid is found sooner than a file is read."""
MOST_KEPT = 256 * 2**20
"""Bytes of computed meshes that MuJoCo may keep of all worlds."""
MAYBE_FLAT = 1e-3
"""Volume of a hull, as a share of a cube of its largest extent, above which it is not flat."""
THICKNESS = 1e-3
"""Thickness (m) added to flat collision meshes, since MuJoCo collides solids only."""


class MeshAssets:
    """Counts the users of each mesh in a spec and deletes a mesh with its last user."""

    def __init__(self, spec: mujoco.MjSpec, hull_steps: int = 0) -> None:
        """Start with none.

        Args:
            spec: the spec.
            hull_steps: number of steps over a hull's extent to which its corners are rounded; 0: none.
        """
        self._spec, self._hull_steps = spec, hull_steps
        self._meshes: dict[str, tuple[Any, int]] = {}
        self._own = 0
        """Number of meshes of `add_own` so far."""

    def has(self, name: str) -> bool:
        """Return whether the spec has a mesh of this name."""
        return name in self._meshes

    @property
    def count(self) -> int:
        """Number of distinct meshes."""
        return len(self._meshes)

    def add(self, mesh: TriangleMesh, *, hull: bool, single: bool = True) -> str:
        """Return the name of the spec's mesh for these triangles, or their hull; count one more user.

        See `convex_hull` for `single`.
        """
        from roboyard._mujoco import mujoco

        vertices, faces = (
            convex_hull(mesh, self._hull_steps, single=single) if hull else (mesh.vertices, mesh.faces)
        )
        name = ("hull-" if hull else "mesh-") + _digest(vertices, faces).hex()[:24]
        found = self._meshes.get(name)
        if found is not None:
            self._meshes[name] = (found[0], found[1] + 1)
            return name
        inertia = mujoco.mjtMeshInertia
        element = self._spec.add_mesh(name=name)
        element.inertia = inertia.mjMESH_INERTIA_CONVEX if hull else inertia.mjMESH_INERTIA_SHELL
        element.file = _file(name)
        self._spec.assets[element.file] = _msh(vertices, faces)
        self._meshes[name] = (element, 1)
        return name

    def add_own(self, vertices: Array, faces: np.ndarray) -> str:
        """Return the name of a new mesh with one user, whose rows in MuJoCo's arrays may be overwritten.

        Args:
            vertices: (n, 3) of a convex mesh (m).
            faces: (m, 3) vertex indices.
        """
        from roboyard._mujoco import mujoco

        self._own += 1
        name = f"own-{self._own}"
        element = self._spec.add_mesh(name=name)
        # lists, which MuJoCo's module takes over in a third of the time
        element.uservert = np.asarray(vertices, dtype=np.float32).ravel().tolist()
        element.userface = np.asarray(faces, dtype=np.int32).ravel().tolist()
        element.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
        self._meshes[name] = (element, 1)
        return name

    def retain(self, name: str) -> None:
        """Count one more user of an existing mesh."""
        element, users = self._meshes[name]
        self._meshes[name] = (element, users + 1)

    def release(self, name: str) -> None:
        """Count one user less, and delete the mesh of the last user."""
        element, users = self._meshes[name]
        if users > 1:
            self._meshes[name] = (element, users - 1)
            return
        del self._meshes[name]
        self._spec.assets.pop(_file(name), None)
        self._spec.delete(element)


class HullGroup:
    """The hulls of several meshes that are built together, kept on disk in one file."""

    def __init__(self, meshes: Sequence[tuple[TriangleMesh, bool]], steps: int) -> None:
        """Look up those that are not in memory.

        Args:
            meshes: each with whether its coordinates are taken in single precision; see `convex_hull`.
            steps: see `convex_hull`.
        """
        keys = [_hull_key(mesh, steps, single=single) for mesh, single in meshes]
        self._keys = [key for key in dict.fromkeys(keys) if key not in _HULLS]
        self._searched = _searched[0]
        if len(self._keys) < FEWEST_TOGETHER:
            self._keys = []
            return
        self._key = blake2b(b"".join(self._keys), digest_size=16).digest()
        found = load_group(self._key)
        if found is not None and len(found) == len(self._keys):
            for key, hull in zip(self._keys, found, strict=True):
                _keep_hull(key, hull)
            self._keys = []

    def store(self) -> None:
        """Keep those that were computed since, once all were, unless all are found sooner than a file."""
        if _searched[0] == self._searched:
            return
        found = [_HULLS[key] for key in self._keys if key in _HULLS]
        if found and len(found) == len(self._keys):
            store_group(self._key, found)


def forget_meshes() -> None:
    """Let MuJoCo forget what it computed of meshes, where it keeps more than `MOST_KEPT`."""
    from roboyard._mujoco import mujoco

    cache = mujoco.mj_getCache()
    if mujoco.mj_getCacheSize(cache) > MOST_KEPT:
        mujoco.mj_clearCache(cache)


def _file(name: str) -> str:
    return f"{name}.msh"


def _msh(vertices: Array, faces: np.ndarray) -> bytes:
    """Return a file of MuJoCo's own mesh format.

    Source:
        MuJoCo, XML reference, asset/mesh: counts of vertices, normals, texture coordinates and faces, then
        the numbers.
    """
    header = _MSH_HEADER.pack(len(vertices), 0, 0, len(faces))
    return header + np.asarray(vertices, "<f4").tobytes() + np.asarray(faces, "<i4").tobytes()


def convex_hull(mesh: TriangleMesh, steps: int = 0, *, single: bool = True) -> tuple[Array, np.ndarray]:
    """Return vertices (n, 3) (m) and outward faces (m, 3) of the convex hull, kept in memory and on disk.

    Flat meshes get a thickness of 1 mm.

    Args:
        mesh: the triangles.
        steps: number of steps over each extent to which the corners are rounded towards the middle, as an
            impulse engine does whose hulls have integer coordinates; 0: they are not rounded. With steps the
            vertices are in the order of that engine, and those that are in a face or an edge are no corners.
        single: whether the coordinates are taken in single precision; without steps they are in any case.
    """
    key = _hull_key(mesh, steps, single=single)
    found = _HULLS.get(key)
    if found is None:
        points, counts = _points(mesh, single=single or not steps, all_counts=steps > 0)
        found = _soon_found(points, counts, steps)
        if found is None:
            _searched[0] += 1
            found = load_hull(key)
        if found is None:
            found = _hull_on_grid(points, counts, steps) if steps else _hull(_thickened(points))
            store_hull(key, *found)
        _keep_hull(key, found)
    return found


def _hull_key(mesh: TriangleMesh, steps: int, *, single: bool) -> bytes:
    points = mesh.hull_points if steps else None
    return _digest(mesh.vertices, mesh.faces, 2 * steps + (single or not steps), points)


def _keep_hull(key: bytes, hull: tuple[Array, np.ndarray]) -> None:
    if len(_HULLS) >= _HULLS_LIMIT:
        _HULLS.clear()
    _HULLS[key] = hull


def _points(mesh: TriangleMesh, *, single: bool, all_counts: bool) -> tuple[Array, np.ndarray | None]:
    """Return the (n, 3) points (m) that a mesh gives to its hull, and how often; None: each once.

    all_counts: whether each triangle gives its corners; else each vertex is given once.
    """
    points, counts = mesh.hull_points if all_counts else None, None
    if points is None:
        counts = np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices))
        used = np.flatnonzero(counts)
        points, counts = mesh.vertices[used], counts[used]
    return points.astype(np.float32).astype(float) if single else points, counts


def _soon_found(points: Array, counts: np.ndarray | None, steps: int) -> tuple[Array, np.ndarray] | None:
    """Return a hull that is found sooner than a file is read; None of others."""
    if steps:
        return _hull_on_grid(points, counts, steps) if len(points) <= MOST_POINTS else None
    faces = prism_faces(points) if len(points) <= MOST_PRISM_CORNERS else None
    return None if faces is None else (points, faces)


def _hull_on_grid(points: Array, counts: np.ndarray | None, steps: int) -> tuple[Array, np.ndarray]:
    """Return the hull of points that were given so often; see `convex_hull`."""
    corners, faces, fullness = ordered_hull(points, steps, counts)
    if fullness < MAYBE_FLAT and (fullness == 0.0 or len(_thickened(corners)) > len(corners)):
        thick = _thickened(points)
        corners, faces, fullness = ordered_hull(thick, steps)
        if fullness == 0.0:
            return _hull(rounded(thick, steps))
    return corners, faces


def _hull(points: Array) -> tuple[Array, np.ndarray]:
    from roboyard._qhull import qhull

    hull = qhull()[0](points, qhull_options="Qt")
    order = np.unique(hull.simplices)
    index = np.full(len(points), -1)
    index[order] = np.arange(len(order))
    vertices, faces = points[order], index[hull.simplices]
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normal, hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces.astype(np.int32)


def rounded(points: Array, steps: int) -> Array:
    """Return (n, 3) points on a grid of so many steps over each extent, rounded towards the middle (m)."""
    lower, upper = bounding_box(points)
    grid, size, middle = on_grid(points, lower, upper, steps)
    return grid * size + middle


def _thickened(points: Array) -> Array:
    """Return the points with copies shifted along directions in which they have no extent."""
    centre = points.mean(axis=0)
    _, axes = np.linalg.eigh((points - centre).T @ (points - centre))
    directions = axes.T
    extent = np.abs((points - centre) @ axes).max(axis=0)
    size = max(extent.max(), 1e-6)
    for k in range(3):
        if extent[k] < max(1e-5 * size, 1e-9):
            shift = directions[k] * min(THICKNESS, 0.1 * size) / 2
            points = np.concatenate([points - shift, points + shift])
    return points


def _digest(vertices: Array, faces: np.ndarray, steps: int = 0, points: Array | None = None) -> bytes:
    digest = blake2b(digest_size=16)
    digest.update(np.ascontiguousarray(vertices).data)
    digest.update(np.ascontiguousarray(faces).data)
    if points is not None:
        digest.update(b"points")
        digest.update(np.ascontiguousarray(points).data)
    if steps:
        digest.update(steps.to_bytes(8, "little"))
    return digest.digest()
