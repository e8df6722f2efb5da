"""Parts, the output of mesh readers, and their combination to one `TriangleMesh`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import LazyLogger
from roboyard._records import dataclass
from roboyard.shapes.distinct_rows import sorted_rows
from roboyard.shapes.mesh import TriangleMesh, read_only, shared
from roboyard.shapes.readers.texture_atlas import pack_textures

_log = LazyLogger(__name__)

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


MAX_TRIANGLES = 2_000_000
"""Most triangles of a mesh, instances counted: what a gibibyte of memory holds while it is read."""

MAX_VERTICES = 1_500_000
"""Most vertices of a mesh; a closed one has half as many as triangles."""


class TooManyTrianglesError(Exception):
    """A mesh has more triangles or vertices than are read."""


def check_triangles(count: int) -> None:
    """Check a number of triangles before memory is taken for them.

    Raises:
        TooManyTrianglesError: it is above `MAX_TRIANGLES`.
    """
    if count > MAX_TRIANGLES:
        raise TooManyTrianglesError(
            f"{count} triangles are too many (at most {MAX_TRIANGLES}); simplify the mesh"
        )


def check_vertices(count: int) -> None:
    """Check a number of distinct vertices.

    Raises:
        TooManyTrianglesError: it is above `MAX_VERTICES`.
    """
    if count > MAX_VERTICES:
        raise TooManyTrianglesError(
            f"{count} vertices are too many (at most {MAX_VERTICES}); merge the corners that "
            "triangles share, or simplify the mesh"
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Part:
    """Triangles of one material."""

    vertices: Floats
    """(n, 3) positions (m)."""
    faces: Indices
    """(m, 3) vertex indices."""
    normals: Floats | None = None
    """(n, 3) vertex normals of any length."""
    uv: Floats | None = None
    """(n, 2) texture coordinates."""
    color: NDArray[np.uint8] | None = None
    """(4,) or (m, 4) RGBA."""
    texture: NDArray[np.uint8] | None = None
    """(h, w, 4) RGBA; parts with the same texture share the array object."""


def part_from_corners(
    positions: Floats,
    corners: Indices,
    *,
    normals: tuple[Floats, Indices] | None = None,
    uv: tuple[Floats, Indices] | None = None,
    color: NDArray[np.uint8] | None = None,
    texture: NDArray[np.uint8] | None = None,
) -> Part:
    """Return a part from corners that index positions, normals and texture coordinates separately (OBJ, DAE).

    Args:
        positions: (n, 3) m.
        corners: (m, 3) indices into `positions`.
        normals: (k, 3) values and (m, 3) indices.
        uv: (k, 2) values and (m, 3) indices.
        color: (4,) or (m, 4) RGBA.
        texture: (h, w, 4) RGBA.

    Normals and texture coordinates with indices out of range are ignored, with a log message.

    Raises:
        ValueError: an index of `corners` is out of range.
    """
    check_indices("vertex", corners, len(positions))
    normals, uv = _if_valid("normal", normals), _if_valid("texture coordinate", uv)
    rows = np.zeros((corners.size, 3), np.int64)
    rows[:, 0] = corners.ravel()
    for column, pair in ((1, normals), (2, uv)):
        if pair is not None:
            rows[:, column] = pair[1].ravel()
    first, faces = sorted_rows(rows, len(positions))
    distinct = rows[first]
    return Part(
        vertices=positions[distinct[:, 0]],
        faces=faces.reshape(-1, 3),
        normals=None if normals is None else normals[0][distinct[:, 1]],
        uv=None if uv is None else uv[0][distinct[:, 2]],
        color=color,
        texture=texture,
    )


def _if_valid(kind: str, pair: tuple[Floats, Indices] | None) -> tuple[Floats, Indices] | None:
    if pair is not None:
        try:
            check_indices(kind, pair[1], len(pair[0]))
        except ValueError as error:
            _log.info("%s; ignored", error)
            return None
    return pair


def check_indices(kind: str, indices: Indices, count: int) -> None:
    """Check that all (...,) indices are between 0 and `count` - 1.

    Raises:
        ValueError: an index is out of range.
    """
    if indices.size and (indices.min() < 0 or indices.max() >= count):
        wrong = int(indices.max()) if indices.max() >= count else int(indices.min())
        raise ValueError(f"a face refers to {kind} {wrong + 1}, but there are {count}")


def combine(parts: Sequence[Part]) -> TriangleMesh | None:
    """Return one mesh of all parts, without unused vertices; None if there is no face."""
    parts = [_used(part) for part in parts if len(part.faces)]
    if not parts:
        return None
    texture = None
    if any(part.texture is not None and part.uv is not None for part in parts):
        parts, texture = _with_one_texture(parts)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])[:-1]
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    normals = None
    if any(part.normals is not None for part in parts):
        normals = read_only(np.concatenate([_unit_normals(part) for part in parts]), np.float64)
    uv = None
    if texture is not None or all(part.uv is not None for part in parts):
        uv = read_only(np.concatenate([part.uv for part in parts if part.uv is not None]), np.float64)
    return TriangleMesh(
        vertices=read_only(np.concatenate([part.vertices for part in parts]), np.float64),
        faces=read_only(np.concatenate(faces), np.int32),
        normals=normals,
        uv=uv,
        colors=_colors(parts),
        texture=None if texture is None else shared(texture, np.uint8),
    )


def face_normals(vertices: Floats, faces: Indices) -> Floats:
    """Return (m, 3) normals with lengths of twice the faces' areas."""
    corners = vertices[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _used(part: Part) -> Part:
    """Return the part without unused vertices."""
    check_indices("vertex", part.faces, len(part.vertices))
    used = np.zeros(len(part.vertices), dtype=bool)
    used[part.faces.ravel()] = True
    if used.all():
        return part
    renumbered = np.cumsum(used) - 1
    return replace(
        part,
        vertices=part.vertices[used],
        faces=renumbered[part.faces],
        normals=None if part.normals is None else part.normals[used],
        uv=None if part.uv is None else part.uv[used],
    )


def _unit_normals(part: Part) -> Floats:
    """Return the part's unit normals; missing ones and those of zero length are derived from the faces."""
    given = np.zeros_like(part.vertices) if part.normals is None else part.normals
    length = np.linalg.norm(given, axis=1)
    good = np.isfinite(length) & (length > 1e-12)
    if not good.all():
        derived = np.zeros_like(part.vertices)
        flat = face_normals(part.vertices, part.faces)
        for corner in range(3):
            np.add.at(derived, part.faces[:, corner], flat)
        given = np.where(good[:, None], given, derived)
        length = np.linalg.norm(given, axis=1)
    direction = given / np.where(length > 0, length, 1.0)[:, None]
    direction[length <= 0] = (0.0, 0.0, 1.0)
    return direction


def _colors(parts: Sequence[Part]) -> NDArray[np.uint8] | None:
    if all(part.color is None for part in parts):
        return None
    white = np.full(4, 255, dtype=np.uint8)
    rows = [
        np.broadcast_to(white if part.color is None else part.color, (len(part.faces), 4)) for part in parts
    ]
    return read_only(np.concatenate(rows), np.uint8)


def _with_one_texture(parts: Sequence[Part]) -> tuple[list[Part], NDArray[np.uint8]]:
    """Return parts whose texture coordinates refer to one packed image, and that image."""
    images: list[NDArray[np.uint8]] = []
    for part in parts:
        if part.texture is not None and part.uv is not None and not any(part.texture is im for im in images):
            images.append(part.texture)
    if len(images) == 1 and all(part.texture is not None and part.uv is not None for part in parts):
        return list(parts), images[0]
    atlas, places = pack_textures(images)
    out: list[Part] = []
    for part in parts:
        number = next((i for i, im in enumerate(images) if im is part.texture), None)
        if number is None or part.uv is None:
            blank = np.broadcast_to(places.blank, (len(part.vertices), 2))
            out.append(replace(part, uv=blank))
            continue
        part = _unwrapped(part)
        assert part.uv is not None
        out.append(replace(part, uv=places.map(number, part.uv)))
    return out, atlas


def _unwrapped(part: Part) -> Part:
    """Return the part with each face's texture coordinates shifted by integers to start in 0..1."""
    assert part.uv is not None
    if part.uv.min() >= -1e-6 and part.uv.max() <= 1 + 1e-6:
        return part
    corners = part.faces.ravel()
    uv = part.uv[corners].reshape(-1, 3, 2)
    uv = uv - np.floor(uv.min(axis=1, keepdims=True))
    return replace(
        part,
        vertices=part.vertices[corners],
        normals=None if part.normals is None else part.normals[corners],
        faces=np.arange(len(corners)).reshape(-1, 3),
        uv=uv.reshape(-1, 2),
    )
