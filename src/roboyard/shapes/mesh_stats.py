"""Statistics of a mesh file for audits: size, closedness, volume, hull; cached by content.

The cache is in the user's cache folder, by the SHA-256 of the file's bytes; without write access the
statistics are computed again.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import MeshError
from roboyard.shapes.cache import cache_folder
from roboyard.shapes.inertia import (
    SolidInertia,
    convex_hull,
    hull_or_box,
    inside_of,
    is_closed,
    volume_integrals,
)
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.shapes.readers.references import names_in
from roboyard.untrusted.arrays import ArraysError, read_arrays

Array = NDArray[np.float64]

_VERSION = 4
"""Part of the cache key; raise it when the meaning of the values changes."""
_MAX_HULL_POINTS = 400
_MAX_IN_MEMORY = 2000
_in_memory: dict[tuple[str, int, int], MeshStats] = {}
"""Statistics by path, time and size of the file: one import needs them several times."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshStats:
    """Statistics of one mesh file, in its own units, before any scale."""

    content: str
    """SHA-256 of the file."""
    triangles: int
    """Number of triangles."""
    vertices: int
    """Number of vertices."""
    is_finite: bool
    """Whether all vertices are finite; otherwise the values below are zero."""
    is_closed: bool
    """Whether every edge has one opposite edge."""
    bounds: Array
    """(2, 3) lower and upper corner of the bounding box."""
    volume: float
    """Volume inside a closed surface, else of the hull; 0 where it is flat."""
    hull_volume: float
    """Volume of the convex hull; 0 where it is flat."""
    hull: Array
    """(k, 3) points, at most 400, with (nearly) the hull of the mesh."""
    center: Array
    """(3,) centre of mass at uniform density."""
    inertia: Array
    """(3, 3) inertia about the centre of mass at density 1."""
    solid: str
    """Kind of shape of the mass properties (see `roboyard.shapes.inertia`)."""
    mass: float
    """Mass at density 1."""
    names: tuple[str, ...] = ()
    """Names of material libraries, images and buffers, as written."""

    @property
    def is_flat(self) -> bool:
        """Whether the vertices span no volume."""
        return self.hull_volume <= 0.0

    @cached_property
    def mass_properties(self) -> SolidInertia:
        """Mass properties at density 1, in the file's units."""
        solid = self.solid
        assert solid in ("closed mesh", "convex hull", "bounding box")
        return SolidInertia(mass=self.mass, center=self.center, inertia=self.inertia, solid=solid)

    def scaled_properties(self, scale: tuple[float, ...]) -> SolidInertia:
        """Return the mass properties at density 1 of the mesh scaled along its axes."""
        factors = np.abs(np.asarray(scale, dtype=float))
        own = self.mass_properties
        # ∫ x xᵀ dm from the tensor, scaled component by component
        second = 0.5 * np.trace(own.inertia) * np.eye(3) - own.inertia
        signed = np.asarray(scale, dtype=float)
        second = second * np.outer(signed, signed) * float(np.prod(factors))
        inertia = np.trace(second) * np.eye(3) - second
        mass = own.mass * float(np.prod(factors))
        return SolidInertia(mass=mass, center=own.center * signed, inertia=inertia, solid=own.solid)


def mesh_stats(path: Path) -> MeshStats:
    """Return the statistics of a mesh file, from the cache if possible.

    Raises:
        MeshError: the file cannot be read as a mesh or is empty.
    """
    from roboyard.shapes.load import MAX_FILE_BYTES, MESH_SUFFIXES, load_mesh

    if path.suffix.lower() not in MESH_SUFFIXES or not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
        return stats_of(load_mesh(path))  # raises the error
    state = path.stat()
    key = (str(path.absolute()), state.st_mtime_ns, state.st_size)
    if key in _in_memory:
        return _in_memory[key]
    content = _digest(path)
    kept = cache_folder() / "mesh-stats" / f"{content}-{path.suffix.lower().lstrip('.')}-{_VERSION}.npz"
    stats = _load(kept, content)
    if stats is None:
        stats = dataclasses.replace(stats_of(load_mesh(path), content), names=tuple(names_in(path)))
        _store(kept, stats)
    if len(_in_memory) >= _MAX_IN_MEMORY:
        _in_memory.clear()
    _in_memory[key] = stats
    return stats


def stats_of(triangles: TriangleMesh, content: str = "") -> MeshStats:
    """Return the statistics of a mesh in memory."""
    vertices, faces = np.asarray(triangles.vertices), np.asarray(triangles.faces)
    vertices = vertices[np.unique(faces)] if len(faces) and len(faces) * 3 < len(vertices) else vertices
    if vertices.shape[0] == 0 or not np.isfinite(vertices).all() or np.abs(vertices).max() > 1e100:
        zeros = np.zeros(3)
        return MeshStats(
            content=content, triangles=len(faces), vertices=len(vertices), is_finite=False, is_closed=False,
            bounds=np.zeros((2, 3)), volume=0.0, hull_volume=0.0, hull=np.zeros((0, 3)),
            center=zeros, inertia=np.zeros((3, 3)), solid="bounding box", mass=0.0,
        )  # fmt: skip
    points, corners = np.asarray(triangles.vertices), faces
    closed = is_closed(points, corners)
    hull = convex_hull(points)
    hull_volume = 0.0 if hull is None else volume_integrals(*hull)[0]
    volume = volume_integrals(points, corners)[0] if closed else hull_volume
    own = inside_of(points, corners, density=1.0) if closed else None
    if own is None:
        own = hull_or_box(hull, points, density=1.0)
    return MeshStats(
        content=content,
        triangles=len(faces),
        vertices=len(points),
        is_finite=True,
        is_closed=closed,
        bounds=bounding_box(points),
        volume=volume,
        hull_volume=hull_volume,
        hull=_thinned(points if hull is None else hull[0]),
        center=own.center,
        inertia=own.inertia,
        solid=own.solid,
        mass=own.mass,
    )


def _thinned(points: Array) -> Array:
    """Return at most 400 of the points: the extremes along evenly distributed directions."""
    if len(points) <= _MAX_HULL_POINTS:
        return points
    k = np.arange(_MAX_HULL_POINTS) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / _MAX_HULL_POINTS), np.pi * (1.0 + 5.0**0.5) * k
    directions = np.stack(
        [np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)], axis=-1
    )
    return points[np.unique(np.argmax(points @ directions.T, axis=0))]


# ----------------------------------------------------------------------------------------------- the cache


def _digest(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise MeshError(f"cannot be read: {error.strerror or error}", file=path) from None


_SCALARS = ("triangles", "vertices", "is_finite", "is_closed", "volume", "hull_volume", "solid", "mass")
_MAX_STORED = 16 << 20
_ARRAYS = ("bounds", "hull", "center", "inertia")


def _load(file: Path, content: str) -> MeshStats | None:
    try:
        stored = read_arrays(file, _MAX_STORED)
        kept = {name: stored[name].item() for name in _SCALARS}
        kept |= {name: stored[name] for name in _ARRAYS}
        kept["names"] = tuple(str(name) for name in stored["names"])
        return MeshStats(content=content, **kept)
    except (OSError, ValueError, TypeError, KeyError, ArraysError):
        return None


def _store(file: Path, stats: MeshStats) -> None:
    stored = {name: np.asarray(getattr(stats, name)) for name in (*_SCALARS, *_ARRAYS)}
    stored["names"] = np.asarray(stats.names, dtype=np.str_)
    partial = file.with_name(f"{file.name}.{os.getpid()}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with partial.open("wb") as stream:
            np.savez(stream, **stored)  # pyright: ignore[reportArgumentType]
        partial.replace(file)
    except OSError:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
