"""Points of links' shapes that are kept on disk, by the content of the mesh files: who infers a robot again
reads none of its meshes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboyard.description.model import Collision, Mesh, Visual
from roboyard.errors import MeshError
from roboyard.shapes.cache import content_key, load_arrays, store_arrays
from roboyard.shapes.mesh_stats import mesh_stats
from roboyard.transforms import Array

VERSION = 1
"""Part of the keys: increase it when the same shapes give other points than before."""
WHOLE = (".stl", ".obj", ".dae", ".ply", ".glb")
"""Suffixes of mesh files that hold their vertices themselves."""


def kept_points(what: str, shapes: Sequence[Visual | Collision], make: Callable[[], Array]) -> Array:
    """Return (k, 3) points of shapes, from the disk if they were made before.

    Args:
        what: which points they are; part of the key.
        shapes: what they are made of.
        make: makes the points.
    """
    key = _key(what, shapes)
    if key is None:
        return make()
    arrays = load_arrays("points", key)
    if arrays is not None and "points" in arrays:
        return arrays["points"]
    points = make()
    store_arrays("points", key, {"points": points})
    return points


def _key(what: str, shapes: Sequence[Visual | Collision]) -> str | None:
    """Return what decides the points; None where they need no mesh file, or are not decided by it."""
    parts: list[object] = [what, VERSION]
    files = 0
    for shape in shapes:
        geometry = shape.geometry
        parts += [type(geometry).__name__, shape.origin.position, shape.origin.quaternion]
        if not isinstance(geometry, Mesh):
            parts.append(geometry)
        elif geometry.data is not None:
            return None
        elif geometry.path is not None:
            suffix = geometry.path.suffix.lower()
            if suffix not in WHOLE:
                return None
            try:
                content = mesh_stats(geometry.path).content
            except MeshError:  # who makes the points says so
                return None
            parts += [suffix, content, tuple(geometry.scale)]
            files += 1
    return content_key(*parts) if files else None
