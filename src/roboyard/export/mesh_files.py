"""Triangles to OBJ and STL files, fast."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from roboyard.shapes.mesh import TriangleMesh

STL_MAX_FACES = 200_000
"""What MuJoCo takes from one STL file."""
_CHUNK = 20_000


def write_stl(mesh: TriangleMesh, path: Path) -> None:
    """Write a binary STL: positions as 32-bit numbers, flat normals, nothing else."""
    corners = mesh.vertices[mesh.faces].astype("<f4")
    record = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("bytes", "<u2")]
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    record["normal"] = normal / np.where(length > 0, length, 1.0)
    record["corners"] = corners
    path.write_bytes(b"binary STL".ljust(80) + struct.pack("<I", len(corners)) + record.tobytes())


def write_obj(mesh: TriangleMesh, path: Path, *, normals: bool = True) -> None:
    """Write an OBJ with texture coordinates and, if asked, normals where the mesh has them. No materials."""
    lines = [_rows("v", mesh.vertices)]
    slots = ["%d"]
    if mesh.uv is not None:
        lines.append(_rows("vt", mesh.uv))
    has_normals = normals and mesh.normals is not None
    if has_normals:
        assert mesh.normals is not None
        lines.append(_rows("vn", mesh.normals))
    if mesh.uv is not None:
        slots.append("%d/%d" if has_normals else "%d")
    elif has_normals:
        slots.append("/%d")
    corner = "/".join(slots)
    row = f"f {corner} {corner} {corner}\n"
    index = np.repeat(mesh.faces.astype(np.int64).ravel() + 1, corner.count("%d"))
    numbers = index.reshape(len(mesh.faces), -1)
    for start in range(0, len(numbers), _CHUNK):
        block = numbers[start : start + _CHUNK]
        lines.append((row * len(block)) % tuple(block.ravel().tolist()))
    path.write_text("".join(lines), encoding="ascii")


def _rows(tag: str, values: np.ndarray) -> str:
    """One line a row, nine significant digits: what a 32-bit reader needs to get the same number."""
    row = tag + " %.9g" * values.shape[1] + "\n"
    blocks = [values[start : start + _CHUNK] for start in range(0, len(values), _CHUNK)]
    return "".join((row * len(block)) % tuple((block + 0.0).ravel().tolist()) for block in blocks)
