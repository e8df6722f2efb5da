"""Load mesh files, with a cache.

Formats: OBJ (with MTL), STL (ASCII and binary), DAE, glTF/GLB, PLY. The file's axes are kept, even if it
declares another up axis, as robot tools do; a DAE's `<unit>` is applied. Files are untrusted: sizes are
bounded, indices checked, XML is parsed without DTD, and external files (materials, images) are opened only
inside the mesh's own folders.
"""

from __future__ import annotations

from _thread import allocate_lock
from collections import OrderedDict
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._digests import blake2b
from roboyard.errors import MeshError
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.readers.external_files import clear_images, external_names, find_external_file
from roboyard.shapes.readers.parts import (
    Part,
    TooManyTrianglesError,
    check_triangles,
    check_vertices,
    combine,
)
from roboyard.untrusted.files import read_file

MAX_FILE_BYTES = 512 * 1024 * 1024
"""Largest mesh file (bytes)."""
CACHE_BYTES = 1024 * 1024 * 1024
"""Size of the cache (bytes); the least recently used meshes are dropped first."""

_READERS = {
    ".obj": "read_obj",
    ".stl": "read_stl",
    ".dae": "read_dae",
    ".glb": "read_scene",
    ".gltf": "read_scene",
    ".ply": "read_scene",
}
MESH_SUFFIXES = tuple(_READERS)

_cache: OrderedDict[tuple[str, int, int], TriangleMesh] = OrderedDict()
_cached = [0]
"""Bytes of the meshes in `_cache`."""
_by_content: WeakValueDictionary[tuple[str, bytes], TriangleMesh] = WeakValueDictionary()
"""Meshes in memory by the suffix and a digest of their files: a copy of a file is not read again."""
_external: WeakKeyDictionary[TriangleMesh, tuple[tuple[str, bytes], ...]] = WeakKeyDictionary()
"""Names that a mesh's file gives of external files, and a digest of each; empty where there is none."""
_cache_lock = allocate_lock()


def load_mesh(path: Path | str) -> TriangleMesh:
    """Return the triangles of a mesh file, all its objects in one mesh, in the file's own frame (m).

    Vertices are split where normals or texture coordinates differ; unused vertices are skipped. `colors` are
    the material (or mean vertex) colours of the faces, or the factors of the texture on textured faces.
    Several textures are packed into one. A file is read again only after its time or size has changed.

    Raises:
        MeshError: the file is missing, unreadable, of an unknown format, has no triangle, a vertex that is
            not finite or an index out of range, or exceeds 512 MiB, 2 million triangles or 1.5 million
            vertices.
    """
    file = Path(path)
    try:
        state = file.stat()
    except (OSError, ValueError):
        raise MeshError(f"no such mesh file: {str(path)!r}; check the path", file=file) from None
    key = (str(file.absolute()), state.st_mtime_ns, state.st_size)
    with _cache_lock:
        if key in _cache:
            _cache.move_to_end(key)
            return _cache[key]
    mesh = _read(file, state.st_size)
    with _cache_lock:
        if key not in _cache:
            _cached[0] += _bytes(mesh)
        _cache[key] = mesh
        while len(_cache) > 1 and _cached[0] > CACHE_BYTES:
            _cached[0] -= _bytes(_cache.popitem(last=False)[1])
    return mesh


def scaled(mesh: TriangleMesh, scale: ArrayLike) -> TriangleMesh:
    """Return the mesh scaled by (3,) factors along its axes; mirrored faces are flipped to face outwards.

    Raises:
        ValueError: a factor is zero or not finite.
    """
    factors = np.broadcast_to(np.asarray(scale, dtype=float), (3,))
    if not np.all(np.isfinite(factors)) or not np.all(factors):
        raise ValueError(f"scale must have finite factors other than 0, got {tuple(factors.tolist())}")
    if np.all(factors == 1.0):
        return mesh
    mirrored = np.prod(np.sign(factors)) < 0
    normals = None
    if mesh.normals is not None:
        scaled_normals = mesh.normals / factors
        length = np.linalg.norm(scaled_normals, axis=1, keepdims=True)
        normals = read_only(scaled_normals / np.where(length > 0, length, 1.0), np.float64)
    return TriangleMesh(
        vertices=read_only(mesh.vertices * factors, np.float64),
        faces=read_only(mesh.faces[:, ::-1] if mirrored else mesh.faces, np.int32),
        normals=normals,
        uv=mesh.uv,
        colors=mesh.colors,
        texture=mesh.texture,
        hull_points=None if mesh.hull_points is None else read_only(mesh.hull_points * factors, np.float64),
    )


def clear_cache() -> None:
    """Empty the cache of meshes and images."""
    with _cache_lock:
        _cache.clear()
        _cached[0] = 0
    clear_images()


def load_for_texture(file: Path) -> TriangleMesh | None:
    """Return the mesh (m) of an OBJ file with its texture coordinates, for an image that is not the file's.

    `load_mesh` omits coordinates without an image. None: it has none, or is no OBJ file.
    """
    if file.suffix.lower() != ".obj":
        return None
    try:
        return _loaded_for_texture(file, file.stat().st_mtime_ns)
    except (OSError, ValueError, TooManyTrianglesError):
        return None


@lru_cache(16)
def _loaded_for_texture(file: Path, _: int) -> TriangleMesh | None:
    from roboyard.shapes.readers.read_obj import read_obj

    found = combine(read_obj(read_file(file, MAX_FILE_BYTES), file, for_texture=True))
    return found if found is not None and found.uv is not None else None


def _bytes(mesh: TriangleMesh) -> int:
    arrays = (mesh.vertices, mesh.faces, mesh.normals, mesh.uv, mesh.colors, mesh.texture)
    return sum(array.nbytes for array in arrays if array is not None)


def _read(file: Path, size: int) -> TriangleMesh:
    name = _READERS.get(file.suffix.lower())
    if file.is_dir():
        raise MeshError(f"{file.name!r} is a folder; give a mesh file", file=file)
    if name is None:
        known = ", ".join(MESH_SUFFIXES)
        raise MeshError(f"unknown mesh format {file.suffix!r}; convert it to one of {known}", file=file)
    if size > MAX_FILE_BYTES:
        raise MeshError(f"{size / 2**20:.0f} MiB is too large for a mesh (at most 512 MiB)", file=file)
    reader: Callable[[bytes, Path], list[Part]] = getattr(
        import_module(f"roboyard.shapes.readers.{name}"), name
    )
    try:
        data = read_file(file, MAX_FILE_BYTES)
    except OSError as error:
        raise MeshError(f"cannot be read: {error.strerror}", file=file) from None
    if not data.strip():
        raise MeshError(f"the file is empty ({size} bytes); export the mesh again", file=file)
    if data.startswith(b"version https://git-lfs"):
        pointer = f"the file is a git-lfs pointer of {size} bytes"
        raise MeshError(f"{pointer}, not the mesh; fetch it with: git lfs pull", file=file)
    content = (file.suffix.lower(), blake2b(data).digest())
    with _cache_lock:
        known = _by_content.get(content)
    if known is not None and _has_same_external(known, file):
        return known
    try:
        with external_names() as asked:
            parts = reader(data, file)
        check_triangles(sum(len(part.faces) for part in parts))
        check_vertices(sum(len(part.vertices) for part in parts))
        mesh = _checked(combine(parts), file)
        if all(mesh_file == file for mesh_file, _ in asked):
            names = dict.fromkeys(name for _, name in asked)
            external = tuple((name, _external_content(file, name)) for name in names)
            with _cache_lock:
                _by_content[content], _external[mesh] = mesh, external
        return mesh
    except TooManyTrianglesError as error:
        raise MeshError(str(error), file=file) from None
    except MeshError:
        raise
    except Exception as error:  # third-party readers raise many types for broken files
        kind = file.suffix.lower().lstrip(".").upper()
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise MeshError(f"not a readable {kind} file ({reason}); export the mesh again", file=file) from error


def _has_same_external(mesh: TriangleMesh, file: Path) -> bool:
    """Return whether a file's external files are those of a mesh that was read from an equal file."""
    return all(_external_content(file, name) == content for name, content in _external[mesh])


def _external_content(file: Path, name: str) -> bytes:
    """Return a digest of an external file of a mesh file; empty where there is none."""
    found = find_external_file(file, name)
    try:
        return b"" if found is None else blake2b(read_file(found, MAX_FILE_BYTES)).digest()
    except OSError:
        return b""


def _checked(mesh: TriangleMesh | None, file: Path) -> TriangleMesh:
    if mesh is None or len(mesh.faces) == 0:
        kept = 0 if mesh is None else len(mesh.vertices)
        raise MeshError(
            f"the mesh has no triangles ({kept} vertices); export it again",
            file=file,
        )
    if not np.all(np.isfinite(mesh.vertices)):
        count = int(np.sum(~np.isfinite(mesh.vertices).all(axis=1)))
        raise MeshError(f"{count} vertices are not finite numbers; export the mesh again", file=file)
    return mesh
