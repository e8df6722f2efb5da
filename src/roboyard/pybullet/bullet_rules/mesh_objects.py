"""The objects of OBJ files: Bullet makes a convex hull of each, not one of the whole file.

Those of a file that names no others are kept on disk, so that a program that starts again need not read it.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

import numpy as np

from roboyard._digests import blake2b
from roboyard._lazy import lazy_pattern
from roboyard.description.model import Collision, Geometry, Mesh, RobotDescription
from roboyard.errors import MeshError
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.sim.build.hull_store import load_group, store_group
from roboyard.sim.build.planned import mesh_of_file
from roboyard.untrusted.files import read_file

_HEADING = lazy_pattern(rb"^[ \t]*[og]\s", re.MULTILINE)
_FACE = lazy_pattern(rb"^ *f ", re.MULTILINE)
_CACHE_SIZE = 256
_MAX_BYTES = 128 << 20
_read: OrderedDict[tuple[str, int, int], tuple[TriangleMesh, ...]] = OrderedDict()
_were_kept: set[tuple[str, int, int]] = set()
"""Those of `_read` that were kept on disk."""
_FORMAT = b"objects1"
"""Begins what keys are digests of; another number for another way to read objects."""
_FIRST, _LIBRARY = (b"o ", b"g "), b"mtllib"


def split_objects(collisions: tuple[Collision, ...]) -> tuple[Collision, ...]:
    """Return collision shapes with one shape per object of an OBJ file, except concave ones."""
    if not any(isinstance(shape.geometry, Mesh) for shape in collisions):
        return collisions
    return tuple(
        replace(shape, geometry=part)
        for shape in collisions
        for part in ((shape.geometry,) if shape.concave else split_geometry(shape.geometry))
    )


def is_obj(shape: Collision) -> bool:
    """Return whether a shape is the hulls of an OBJ file's objects."""
    mesh = shape.geometry
    if not isinstance(mesh, Mesh) or mesh.path is None or shape.concave:
        return False
    return mesh.path.suffix.lower() == ".obj"


def split_geometry(geometry: Geometry) -> tuple[Geometry, ...]:
    """Return a mesh for each object (`o`, `g`) of an OBJ file; any other geometry unchanged."""
    if not isinstance(geometry, Mesh) or geometry.data is not None or geometry.path is None:
        return (geometry,)
    if geometry.path.suffix.lower() != ".obj":
        return (geometry,)
    found = _objects(geometry.path)
    if len(found) < 2:
        return (geometry,)
    return tuple(replace(geometry, path=None, data=mesh) for mesh in found)


def is_known(path: Path) -> bool:
    """Return whether a file has several objects that are kept: `load_mesh` was able to read it."""
    if path.suffix.lower() != ".obj":
        return False
    try:
        key = _key(path)
        if key not in _read:
            kept = _stored(read_file(path, _MAX_BYTES))
            if kept is not None:
                _keep(key, kept)
                _were_kept.add(key)
        return key in _were_kept
    except (OSError, ValueError):
        return False


def mesh_contents(description: RobotDescription) -> tuple[object, ...]:
    """Return what the meshes of all collision shapes contain now, the same objects until a file changes.

    They are none where one is missing.
    """
    meshes = [
        shape.geometry
        for link in description.links
        for shape in link.collisions
        if isinstance(shape.geometry, Mesh)
    ]
    found: list[object] = []
    for mesh in meshes:
        if mesh.data is not None or mesh.path is None:
            content: object = mesh.data
        else:
            content = _objects(mesh.path) if is_known(mesh.path) else mesh_of_file(mesh.path)
        if content is None:
            return ()
        found.append(content)
    return tuple(found)


def _objects(path: Path) -> tuple[TriangleMesh, ...]:
    """Return the file's objects; none if it cannot be read or has only one."""
    try:
        key = _key(path)
        found = _read.get(key)
        if found is None:
            data = read_file(path, _MAX_BYTES)
            found = _stored(data)
            if found is None:
                found = _split(data)
                _store(data, found, path)
            _keep(key, found)
    except (OSError, ValueError, IndexError):
        return ()
    return found


def _key(path: Path) -> tuple[str, int, int]:
    state = path.stat()
    return str(path.absolute()), state.st_mtime_ns, state.st_size


def _keep(key: tuple[str, int, int], objects: tuple[TriangleMesh, ...]) -> None:
    _read[key] = objects
    while len(_read) > _CACHE_SIZE:
        _were_kept.discard(_read.popitem(last=False)[0])


def _stored(data: bytes) -> tuple[TriangleMesh, ...] | None:
    """Return the objects of a file's content that are kept on disk; None where they are not."""
    found = load_group(_digest(data)) if data.startswith(_FIRST) or _HEADING.search(data) else None
    if found is None or len(found) < 2:
        return None
    return tuple(_mesh(vertices, faces) for vertices, faces in found)


def _store(data: bytes, objects: tuple[TriangleMesh, ...], path: Path) -> None:
    """Keep the objects of a file's content, where nothing else is needed to read it, and it can be."""
    from roboyard.shapes.load import load_mesh

    if len(objects) < 2 or _LIBRARY in data:
        return
    try:
        load_mesh(path)
    except MeshError:
        return
    store_group(_digest(data), [(mesh.vertices, mesh.faces) for mesh in objects])


def _digest(data: bytes) -> bytes:
    digest = blake2b(_FORMAT, digest_size=16)
    digest.update(data)
    return digest.digest()


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> TriangleMesh:
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return TriangleMesh(vertices=vertices, faces=faces)


def _split(data: bytes) -> tuple[TriangleMesh, ...]:
    if len(_HEADING.findall(data)) < 2:
        return ()
    found = _split_plain(data)
    if found is not None:
        return found
    positions: list[list[float]] = []
    faces: list[list[int]] = []
    objects = [faces]
    for line in data.splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == b"v":
            positions.append([float(word) for word in words[1:4]])
        elif words[0] == b"f":
            corners = [int(word.partition(b"/")[0]) for word in words[1:]]
            corners = [k - 1 if k > 0 else len(positions) + k for k in corners]
            faces += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
        elif words[0] in (b"o", b"g") and faces:
            faces = []
            objects.append(faces)
    points = np.array(positions, dtype=np.float32).astype(float)  # as Bullet reads them
    return tuple(_part(points, np.array(faces)) for faces in objects if faces)


def _split_plain(data: bytes) -> tuple[TriangleMesh, ...] | None:
    """Return the objects of a file that compiled loops can read; None for any other."""
    from roboyard.shapes.readers import plain_obj

    read = plain_obj.read_plain(data) if plain_obj.is_worth_it(data) else None
    faces = [line.start() for line in _FACE.finditer(data)]
    if read is None or len(faces) != len(read.face_material):
        return None
    headings = [line.start() for line in _HEADING.finditer(data)]
    objects = np.searchsorted(headings, faces)[read.face_of_triangle]
    ends = np.flatnonzero(np.diff(objects)) + 1
    points = read.positions.astype(np.float32).astype(float)  # as Bullet reads them
    parts = np.split(read.triangles[:, :, 0], ends)
    return tuple(_part(points, part) for part in parts if len(part))


def _part(points: np.ndarray, faces: np.ndarray) -> TriangleMesh:
    used, corners = np.unique(faces, return_inverse=True)
    if used[0] < 0 or used[-1] >= len(points):
        raise IndexError(f"face corners must be 0 to {len(points) - 1}, got {used[0]} to {used[-1]}")
    return TriangleMesh(
        vertices=read_only(points[used], np.float64), faces=read_only(corners.reshape(-1, 3), np.int32)
    )
