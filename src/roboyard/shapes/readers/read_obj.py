"""Read Wavefront OBJ with its MTL materials.

Groups, objects, smoothing groups, curves and lines are skipped; polygons become fans.
Source of the format: Wavefront's "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import lazy_pattern
from roboyard._records import dataclass
from roboyard.shapes.readers.parts import (
    Floats,
    Indices,
    Part,
    check_indices,
    check_triangles,
    part_from_corners,
)
from roboyard.shapes.readers.plain_obj import is_worth_it, read_plain
from roboyard.shapes.readers.read_mtl import SurfaceMaterial, read_mtl

_KEYWORDS = (b"v", b"vn", b"vt", b"f", b"usemtl", b"mtllib")
MAX_CORNERS = 10_000
"""Most corners of a face; larger ones would become millions of overlapping triangles."""
FEW_CORNERS = 1_000
"""Length of a text of corners up to which they are read one by one, faster than patterns are compiled."""
# v, v/vt, v//vn, v/vt/vn, and the columns (vertex, uv, normal) of each
_CORNER_STYLES = (
    (lazy_pattern(rb"(?:\s+-?\d+)++\s*"), [0]),
    (lazy_pattern(rb"(?:\s+-?\d+/-?\d+)++\s*"), [0, 1]),
    (lazy_pattern(rb"(?:\s+-?\d+//-?\d+)++\s*"), [0, 2]),
    (lazy_pattern(rb"(?:\s+-?\d+/-?\d+/-?\d+)++\s*"), [0, 1, 2]),
)


@dataclass(slots=True)
class _Lines:
    """The lines of the file by kind."""

    positions: list[bytes] = field(default_factory=list)
    uvs: list[bytes] = field(default_factory=list)
    normals: list[bytes] = field(default_factory=list)
    faces: list[bytes] = field(default_factory=list)
    face_material: list[int] = field(default_factory=list)
    counts: dict[int, tuple[int, int, int]] = field(default_factory=dict)
    """Face number to the vertices, uvs and normals before it, for faces with negative indices."""
    materials: list[str] = field(default_factory=lambda: [""])
    libraries: list[str] = field(default_factory=list)


def read_obj(data: bytes, file: Path, *, for_texture: bool = False) -> list[Part]:
    """Return one part for each material in use (m).

    Args:
        data: of the file.
        file: where its materials are looked for.
        for_texture: whether all parts have their texture coordinates, and none has an image of the file.
    """
    plain = read_plain(data) if is_worth_it(data) else None
    if plain is not None:
        positions, uv, normals, vertex_colors = plain.positions, plain.uvs, plain.normals, plain.colors
        triangles, material = plain.triangles, plain.face_material[plain.face_of_triangle]
        names, libraries = plain.materials, plain.libraries
    else:
        lines = _sort_lines(data)
        positions, vertex_colors = _positions(lines.positions)
        uv, normals = _table(lines.uvs, 2), _table(lines.normals, 3)
        triangles, face_of_triangle = _triangles(lines)
        material = np.array(lines.face_material, dtype=np.int64)[face_of_triangle]
        names, libraries = lines.materials, lines.libraries
    if not len(triangles):
        return []
    in_use = np.unique(material)
    materials = read_mtl(file, libraries, {names[number] for number in in_use})
    parts: list[Part] = []
    for number in in_use:
        own = triangles[material == number]
        check_indices("vertex", own[:, :, 0], len(positions))
        surface = materials.get(names[number], SurfaceMaterial())
        color = surface.color
        if color is None and vertex_colors is not None:
            color = np.rint(255 * vertex_colors[own[:, :, 0]].mean(axis=1)).clip(0, 255).astype(np.uint8)
        has_uv = (for_texture or surface.texture is not None) and bool((own[:, :, 1] >= 0).all())
        has_normals = bool((own[:, :, 2] >= 0).all())
        parts.append(
            part_from_corners(
                positions,
                own[:, :, 0],
                normals=(normals, own[:, :, 2]) if has_normals else None,
                uv=(uv, own[:, :, 1]) if has_uv else None,
                color=color,
                texture=surface.texture if has_uv and not for_texture else None,
            )
        )
    return parts


def read_obj_surface(data: bytes) -> tuple[Floats, Indices]:
    """Return the (n, 3) vertices of a file that faces use (m), in its order, and the (m, 3) triangles.

    Unlike in `read_obj`, vertices are not split where normals or texture coordinates differ.

    Raises:
        ValueError: a number or index is wrong, or there is no face.
    """
    lines = _sort_lines(data)
    positions, _ = _positions(lines.positions)
    corners = _triangles(lines)[0][:, :, 0]
    if not len(corners):
        raise ValueError("it has no faces")
    check_indices("vertex", corners, len(positions))
    used, places = np.unique(corners, return_inverse=True)
    return positions[used], places.reshape(-1, 3)


def _sort_lines(data: bytes) -> _Lines:
    out = _Lines()
    material = 0
    numbers: dict[str, int] = {"": 0}
    for raw in data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        line = raw.lstrip()
        kind, _, rest = line.partition(b" ")
        if kind == b"v":
            out.positions.append(rest)
        elif kind == b"vn":
            out.normals.append(rest)
        elif kind == b"vt":
            out.uvs.append(rest)
        elif kind == b"f":
            if b"-" in rest:
                out.counts[len(out.faces)] = (len(out.positions), len(out.uvs), len(out.normals))
            out.faces.append(rest.partition(b"#")[0])
            out.face_material.append(material)
        elif kind == b"usemtl":
            name = _name(rest)
            material = numbers.setdefault(name, len(numbers))
            if material == len(out.materials):
                out.materials.append(name)
        elif kind == b"mtllib":
            out.libraries.append(_name(rest))
        elif b"\t" in kind and kind.partition(b"\t")[0] in _KEYWORDS:
            return _sort_lines(data.replace(b"\t", b" "))
    return out


def _name(rest: bytes) -> str:
    return rest.decode("utf-8", "replace").strip()


def _table(lines: Sequence[bytes], width: int) -> Floats:
    """Return (n, width) numbers, one row per line; further columns are ignored, missing ones are zero."""
    tokens = b" ".join(lines).split()
    count = len(lines)
    if count and len(tokens) % count == 0 and len(tokens) // count >= width:
        columns = len(tokens) // count
        first = len(lines[0].split())
        if first == columns and (columns == width or all(len(line.split()) == columns for line in lines)):
            return np.array(tokens, dtype=np.float64).reshape(count, columns)[:, :width]
    out = np.zeros((count, width))
    for row, line in enumerate(lines):
        values = line.partition(b"#")[0].split()[:width]
        out[row, : len(values)] = [float(value) for value in values]
    return out


def _positions(lines: Sequence[bytes]) -> tuple[Floats, Floats | None]:
    """Return (n, 3) positions, and (n, 4) RGBA in 0..1 if every line has r g b after x y z."""
    if lines and len(lines[0].split()) >= 6 and all(len(line.split()) >= 6 for line in lines):
        table = _table(lines, 6)
        return np.ascontiguousarray(table[:, :3]), np.column_stack([table[:, 3:6], np.ones(len(table))])
    short = next((line for line in lines if len(line.split()) < 3), None)
    if short is not None:
        raise ValueError(f"a vertex has fewer than three numbers: v {short.decode('utf-8', 'replace')}")
    return _table(lines, 3), None


def _triangles(lines: _Lines) -> tuple[Indices, NDArray[np.int64]]:
    """Return (m, 3, 3) zero-based vertex, uv, normal of each corner (-1: none), and (m,) their face lines."""
    groups: dict[tuple[int, int, bool], list[int]] = {}
    total = 0
    for number, line in enumerate(lines.faces):
        corners = len(line.split())
        if corners > MAX_CORNERS:
            raise ValueError(f"a face has {corners} corners (at most {MAX_CORNERS}); split it into triangles")
        if corners >= 3:
            total += corners - 2
            check_triangles(total)
            groups.setdefault((corners, line.count(b"/"), b"//" in line), []).append(number)
    tables: list[Indices] = []
    owners: list[NDArray[np.int64]] = []
    for (corners, *_), numbers in groups.items():
        table = _corner_table([lines.faces[number] for number in numbers], corners)
        _resolve_indices(table, numbers, lines.counts)
        fan = np.array([(0, k, k + 1) for k in range(1, corners - 1)])
        tables.append(table[:, fan].reshape(-1, 3, 3))
        owners.append(np.repeat(np.array(numbers, dtype=np.int64), corners - 2))
    if not tables:
        return np.empty((0, 3, 3), dtype=np.int64), np.empty(0, dtype=np.int64)
    triangles, owner = np.concatenate(tables), np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return triangles[order], owner[order]


def _corner_table(rows: Iterable[bytes], corners: int) -> Indices:
    """Return (k, corners, 3) one-based indices of faces with this number of corners; 0 for none."""
    joined = b" " + b" ".join(rows)
    for pattern, columns in _CORNER_STYLES if len(joined) > FEW_CORNERS else ():
        if pattern.fullmatch(joined):
            values = joined.replace(b"//", b" ").replace(b"/", b" ").split()
            out = np.zeros((len(values) // len(columns), 3), dtype=np.int64)
            out[:, columns] = np.array(values, dtype=np.int64).reshape(-1, len(columns))
            return out.reshape(-1, corners, 3)
    # corners in different styles: one by one
    flat = [[int(part) if part else 0 for part in token.split(b"/")[:3]] for token in joined.split()]
    padded = [corner + [0] * (3 - len(corner)) for corner in flat]
    return np.array(padded, dtype=np.int64).reshape(-1, corners, 3)


def _resolve_indices(table: Indices, numbers: Sequence[int], counts: dict[int, tuple[int, int, int]]) -> None:
    """Convert one-based and negative (relative) indices to zero-based ones in place; 0 becomes -1."""
    if counts and (table < 0).any():
        before = np.array([counts.get(number, (0, 0, 0)) for number in numbers], dtype=np.int64)
        negative = table < 0
        absolute = table + before[:, None, :] + 1
        if (absolute[negative] < 1).any():
            raise ValueError(f"the relative index {int(table.min())} of a face is before the first vertex")
        table[negative] = absolute[negative]
    table -= 1
