"""Read tetrahedra of legacy VTK files in text form, as Gmsh and fTetWild write them.

Source of the format: "The VTK User's Guide", 11th edition, section "VTK File Formats", simple legacy formats.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import MeshError
from roboyard.shapes.readers.parts import TooManyTrianglesError, check_triangles, check_vertices
from roboyard.untrusted.files import read_file

MAX_FILE_BYTES = 64 * 1024 * 1024
"""Largest file (bytes)."""
TETRAHEDRON = 10
"""VTK's number of this kind of cell."""


def load_tetrahedra(path: Path | str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return the (n, 3) points (m) and (m, 4) tetrahedra of an unstructured grid; other cells are skipped.

    Raises:
        MeshError: the file is missing, larger than 64 MiB, binary, or not an unstructured grid with
            tetrahedra; an index is out of range, or a point is not finite.
    """
    file = Path(path)
    try:
        return _parse(read_file(file, MAX_FILE_BYTES))
    except MeshError:
        raise
    except (OSError, ValueError, OverflowError, TooManyTrianglesError) as problem:
        reason = " ".join(str(problem).split())[:200]
        raise MeshError(f"not a VTK file with tetrahedra: {reason}", file=file) from None


def _parse(data: bytes) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    head, _, rest = data.partition(b"DATASET")
    if b"vtk DataFile" not in head.partition(b"\n")[0] or not rest:
        raise ValueError('it does not begin with "# vtk DataFile", or has no DATASET')
    if b"ASCII" not in head.split():
        raise ValueError("it is binary; save it as ASCII")
    words = rest.split()
    if words[:1] != [b"UNSTRUCTURED_GRID"]:
        raise ValueError("its DATASET is no UNSTRUCTURED_GRID")
    points = _points(words)
    cells = _cells(words)
    if not len(cells):
        raise ValueError("it has no tetrahedra")
    if cells.min() < 0 or cells.max() >= len(points):
        raise ValueError(f"a tetrahedron has a point beyond 0 to {len(points) - 1}")
    if not np.isfinite(points).all():
        raise ValueError("a point is not finite")
    return points, cells.astype(np.int32)


def _points(words: list[bytes]) -> NDArray[np.float64]:
    at, count = _section(words, b"POINTS")
    check_vertices(count)
    numbers = words[at + 3 : at + 3 + 3 * count]
    if len(numbers) < 3 * count:
        raise ValueError(f"it has fewer than {count} POINTS")
    return np.array(numbers, dtype=np.float64).reshape(-1, 3)


def _cells(words: list[bytes]) -> NDArray[np.int64]:
    """Return the (m, 4) points of the cells with four points that are tetrahedra.

    Where CELL_TYPES are missing or incomplete, all cells with four points are.
    """
    at, count = _section(words, b"CELLS")
    check_triangles(count)
    start = at + 3
    table = words[start : start + 5 * count]
    if len(table) == 5 * count and all(word == b"4" for word in table[::5]):
        return _of_kind(words, np.array(table, dtype=np.int64).reshape(-1, 5)[:, 1:])
    rows: list[list[int]] = []
    for _ in range(count):
        size = int(words[start]) if start < len(words) else -1
        row = [int(word) for word in words[start + 1 : start + 1 + max(size, 0)]]
        if size < 0 or len(row) < size:
            raise ValueError(f"it has fewer than {count} CELLS")
        rows.append(row if size == 4 else [-1] * 4)
        start += 1 + size
    found = _of_kind(words, np.array(rows, dtype=np.int64).reshape(-1, 4))
    return found[(found >= 0).any(axis=1)]


def _of_kind(words: list[bytes], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    if b"CELL_TYPES" not in words:
        return cells
    at, count = _section(words, b"CELL_TYPES")
    kinds = np.array(words[at + 2 : at + 2 + count], dtype=np.int64)
    return cells[kinds == TETRAHEDRON] if len(kinds) == len(cells) else cells


def _section(words: list[bytes], name: bytes) -> tuple[int, int]:
    """Return the place of a keyword and the count behind it."""
    if name not in words:
        raise ValueError(f"it has no {name.decode()}")
    at = words.index(name)
    count = int(words[at + 1]) if at + 1 < len(words) else -1
    if count < 0:
        raise ValueError(f"{name.decode()} has no count")
    return at, count
