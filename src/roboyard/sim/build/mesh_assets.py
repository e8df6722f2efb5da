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
from roboyard.sim.build.hull_store import load_group, load_hull, store_group, store_hull
from roboyard.sim.build.prisms import prism_faces
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard._mujoco import mujoco

_HULLS: dict[bytes, tuple[Array, np.ndarray]] = {}
_HULLS_LIMIT = 4096
_searched = [0]
"""Number of hulls that were not known and are no prisms."""
_MSH_HEADER = struct.Struct("<4i")
FEWEST_TOGETHER = 2
"""Fewest hulls that are kept in one file."""
MOST_PRISM_CORNERS = 512
"""Meshes with more corners are searched for their hull."""
MOST_KEPT = 256 * 2**20
"""Bytes of computed meshes that MuJoCo may keep of all worlds."""
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
        """Keep those that were computed since, once all were, unless all are prisms."""
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
            impulse engine does whose hulls have integer coordinates; 0: they are not rounded.
        single: whether the coordinates are taken in single precision; without steps they are in any case.
    """
    key = _hull_key(mesh, steps, single=single)
    found = _HULLS.get(key)
    if found is None:
        found = _prism(mesh, steps, single=single or not steps)
        if found is None:
            _searched[0] += 1
            found = load_hull(key)
        if found is None:
            found = _hull(_corners(mesh, single=single or not steps), steps)
            store_hull(key, *found)
        _keep_hull(key, found)
    return found


def _hull_key(mesh: TriangleMesh, steps: int, *, single: bool) -> bytes:
    return _digest(mesh.vertices, mesh.faces, 2 * steps + (single or not steps))


def _keep_hull(key: bytes, hull: tuple[Array, np.ndarray]) -> None:
    if len(_HULLS) >= _HULLS_LIMIT:
        _HULLS.clear()
    _HULLS[key] = hull


def _corners(mesh: TriangleMesh, *, single: bool) -> Array:
    points = mesh.vertices[np.unique(mesh.faces)]
    return points.astype(np.float32).astype(float) if single else points


def _prism(mesh: TriangleMesh, steps: int, *, single: bool) -> tuple[Array, np.ndarray] | None:
    """Return the convex hull of an upright prism, to be found without a search; None of other meshes."""
    if len(mesh.vertices) > MOST_PRISM_CORNERS:
        return None
    points = _corners(mesh, single=single)
    points = rounded(points, steps) if steps else points
    faces = prism_faces(points)
    return None if faces is None else (points, faces)


def _hull(points: Array, steps: int) -> tuple[Array, np.ndarray]:
    from roboyard._qhull import qhull

    points = _thickened(points)
    if steps:
        points = rounded(points, steps)
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
    size = (upper - lower) * (1.0 / steps)  # Bullet divides so; a corner at a step depends on the last bit
    middle = (lower + upper) * 0.5
    per_step = np.divide(1.0, size, out=np.zeros(3), where=size > 0.0)
    return np.trunc((points - middle) * per_step) * size + middle


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


def _digest(vertices: Array, faces: np.ndarray, steps: int = 0) -> bytes:
    digest = blake2b(digest_size=16)
    digest.update(np.ascontiguousarray(vertices).data)
    digest.update(np.ascontiguousarray(faces).data)
    if steps:
        digest.update(steps.to_bytes(8, "little"))
    return digest.digest()
