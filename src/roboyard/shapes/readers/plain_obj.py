"""Plain OBJ files read by compiled loops, many times faster than line by line."""

from __future__ import annotations

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.shapes.readers.parts import Floats, Indices, check_triangles
from roboyard.shapes.readers.plain_numbers import POWERS
from roboyard.shapes.readers.worth import is_large, is_worth

kernels = lazy_module("roboyard.shapes.readers.obj_kernels")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PlainObj:
    """The lines of a file as arrays."""

    positions: Floats
    """(v, 3)"""
    uvs: Floats
    """(t, 2)"""
    normals: Floats
    """(k, 3)"""
    triangles: Indices
    """(m, 3, 3) zero-based vertex, texture coordinate, normal of each corner, -1 for none."""
    face_of_triangle: Indices
    """(m,)"""
    face_material: Indices
    """(f,) index into `materials` of each face."""
    materials: list[str]
    """Names, the first one empty."""
    libraries: list[str]
    colors: Floats | None
    """(v, 4) RGBA in 0..1 where every vertex has a colour."""


def is_worth_it(data: bytes) -> bool:
    """Return whether compiled loops should read a file."""
    return is_large(len(data)) and is_worth(kernels().read_lines, len(data))


def read_plain(data: bytes) -> PlainObj | None:
    """Return the contents of a file, or None for one that is not plain; see `obj_kernels.read_lines`.

    Raises:
        TooManyTrianglesError: there are too many.
    """
    read = kernels().read_lines
    text = np.frombuffer(data, dtype=np.uint8)
    at, counts = np.zeros(1, dtype=np.int64), np.zeros(7, dtype=np.int64)
    arrays = _arrays(counts)
    if not read(text, 0, POWERS, at, counts, *arrays):
        return None
    check_triangles(int(counts[3]) // 3)
    arrays = positions, uvs, normals, tints, corners, ends, events = _arrays(counts)
    read(text, 1, POWERS, at, counts, *arrays)
    triangles, face_of_triangle = _fans(corners[: counts[3]], ends)
    check_triangles(len(triangles))
    materials, libraries = [""], list[str]()
    numbers, starts, in_turn = {"": 0}, [0], [0]
    for begin, end, face, is_library in events.tolist():
        word, _, rest = data[begin:end].partition(b" ")
        name = rest.decode("utf-8", "replace").strip()
        if word == b"mtllib" and is_library:
            libraries.append(name)
        elif word == b"usemtl":
            number = numbers.setdefault(name, len(numbers))
            if number == len(materials):
                materials.append(name)
            starts.append(face)
            in_turn.append(number)
    face_material = np.repeat(np.array(in_turn, dtype=np.int64), np.diff([*starts, len(ends)]))
    return PlainObj(
        positions=positions,
        uvs=uvs,
        normals=normals,
        triangles=triangles,
        face_of_triangle=face_of_triangle,
        face_material=face_material,
        materials=materials,
        libraries=libraries,
        colors=np.column_stack([tints, np.ones(len(tints))]) if len(tints) else None,
    )


def _arrays(counts: Indices) -> tuple[Floats, Floats, Floats, Floats, Indices, Indices, Indices]:
    vertices, coordinates, directions, corners, faces, events, colors = counts.tolist()
    return (
        np.empty((vertices, 3)),
        np.empty((coordinates, 2)),
        np.empty((directions, 3)),
        np.empty((colors, 3)),
        np.empty((corners + 2, 3), dtype=np.int64),  # a line's corners are written before they are dropped
        np.empty(faces, dtype=np.int64),
        np.empty((events, 4), dtype=np.int64),
    )


def _fans(corners: Indices, ends: Indices) -> tuple[Indices, Indices]:
    """Return (m, 3, 3) triangles of all faces, each a fan from its first corner, and (m,) their faces."""
    sizes = np.diff(ends, prepend=0)
    if (sizes == 3).all():
        return corners.reshape(-1, 3, 3), np.arange(len(ends))
    count = np.maximum(sizes - 2, 0)
    face = np.repeat(np.arange(len(ends)), count)
    first = (ends - sizes)[face]
    place = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
    return np.stack([corners[first], corners[first + place + 1], corners[first + place + 2]], axis=1), face
