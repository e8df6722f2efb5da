"""Write triangle meshes as OBJ and STL files."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from roboyard.shapes.mesh import TriangleMesh

STL_MAX_FACES = 200_000
"""Most faces that MuJoCo reads from one STL file."""
_CHUNK = 20_000
"""Rows formatted at once."""
_NO_COLORS = np.zeros((0, 4), dtype=np.uint8)


def write_stl(mesh: TriangleMesh, path: Path) -> None:
    """Write a binary STL: positions as 32-bit numbers and flat normals; colours and texture are not
    written.
    """
    corners = mesh.vertices[mesh.faces].astype("<f4")
    record = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bytes", "<u2")]
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    record["normal"] = normal / np.where(length > 0, length, 1.0)
    record["corners"] = corners
    path.write_bytes(b"binary STL".ljust(80) + struct.pack("<I", len(corners)) + record.tobytes())


def write_obj(mesh: TriangleMesh, path: Path, *, normals: bool = True, materials: bool = False) -> None:
    """Write an OBJ with the mesh's texture coordinates and normals.

    Args:
        mesh: what to write.
        path: the OBJ; folders that do not exist are created.
        normals: whether to write normals where the mesh has them.
        materials: whether to write colours and texture into an MTL and a PNG of the same stem.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    colors, color_of_face = _face_colors(mesh) if materials else (_NO_COLORS, None)
    parts = [f"mtllib {path.stem}.mtl\n"] if len(colors) else []
    parts.append(_rows("v", mesh.vertices))
    if mesh.uv is not None:
        parts.append(_rows("vt", mesh.uv))
    normal_rows = mesh.normals if normals else None
    if normal_rows is not None:
        parts.append(_rows("vn", normal_rows))
    corner = _corner(has_uv=mesh.uv is not None, has_normal=normal_rows is not None)
    if color_of_face is None:
        parts += _faces(mesh.faces, corner)
    for index in range(len(colors)):
        parts.append(f"usemtl material_{index}\n")
        parts += _faces(mesh.faces[color_of_face == index], corner)
    path.write_text("".join(parts), encoding="ascii")
    if len(colors):
        _write_mtl(mesh, colors, path)


def _corner(*, has_uv: bool, has_normal: bool) -> str:
    """Return the format of a face's corner, one `%d` for each index."""
    if has_uv:
        return "%d/%d/%d" if has_normal else "%d/%d"
    return "%d//%d" if has_normal else "%d"


def _faces(faces: np.ndarray, corner: str) -> Iterator[str]:
    """Yield the lines of (m, 3) faces in chunks."""
    row = f"f {corner} {corner} {corner}\n"
    numbers = np.repeat(faces.astype(np.int64) + 1, corner.count("%d"), axis=1)
    for start in range(0, len(numbers), _CHUNK):
        block = numbers[start : start + _CHUNK]
        yield (row * len(block)) % tuple(block.ravel().tolist())


def _face_colors(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray | None]:
    """Return (k, 4) distinct colours and the (m,) index of each face's; white for a mesh with only a texture,
    none without either.
    """
    if mesh.colors is not None:
        colors, color_of_face = np.unique(mesh.colors, axis=0, return_inverse=True)
        return colors, color_of_face.reshape(-1)
    if mesh.texture is not None:
        return np.full((1, 4), 255, dtype=np.uint8), np.zeros(len(mesh.faces), dtype=int)
    return _NO_COLORS, None


def _write_mtl(mesh: TriangleMesh, colors: np.ndarray, path: Path) -> None:
    """Write a material for each colour, and the texture as PNG."""
    lines: list[str] = []
    for index, (r, g, b, a) in enumerate(colors.astype(float) / 255.0):
        lines += [f"newmtl material_{index}", f"Kd {r:.6g} {g:.6g} {b:.6g}", f"d {a:.6g}"]
        if mesh.texture is not None:
            lines.append(f"map_Kd {path.stem}.png")
    path.with_suffix(".mtl").write_text("\n".join(lines) + "\n", encoding="ascii")
    if mesh.texture is not None:
        from PIL import Image

        Image.fromarray(np.ascontiguousarray(mesh.texture)).save(path.with_suffix(".png"))


def _rows(tag: str, values: np.ndarray) -> str:
    """Return one line a row, with the nine significant digits that keep a 32-bit number exact."""
    row = tag + " %.9g" * values.shape[1] + "\n"
    blocks = [values[start : start + _CHUNK] for start in range(0, len(values), _CHUNK)]
    return "".join((row * len(block)) % tuple((block + 0.0).ravel().tolist()) for block in blocks)
