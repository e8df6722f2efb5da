"""Read STL, binary and ASCII; equal corners are merged to one vertex."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import lazy_pattern
from roboyard.shapes.distinct_rows import distinct_rows
from roboyard.shapes.readers.parts import Part, check_triangles

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET_BYTES = 60
"""Fewer than the shortest facet of an ASCII file has."""
_VERTEX = lazy_pattern(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(data: bytes, file: Path) -> list[Part]:
    """Return the file's triangles as one part without normals (facet normals follow from the faces)."""
    corners = _ascii(data) if _is_ascii(data) else _binary(data)
    vertices, faces = merge_equal(corners)
    return [Part(vertices=vertices.astype(np.float64), faces=faces.reshape(-1, 3))]


def merge_equal(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return the distinct rows of (n, 3) `points`, in order of first use, and the (n,) row of each point."""
    bits = np.ascontiguousarray(points + np.float32(0.0)).view(np.uint32).astype(np.int64)  # -0 is 0
    first, place = distinct_rows(bits)
    return points[first], place


def _is_ascii(data: bytes) -> bool:
    """Whether the file is ASCII: binary files may start with "solid" too, but match their count in size."""
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return False
    head = data[:1024].lstrip()
    return head[:5].lower() == b"solid" and (b"facet" in data[:65536] or b"endsolid" in data)


def _binary(data: bytes) -> NDArray[np.float32]:
    if len(data) < 84:
        raise ValueError(f"{len(data)} bytes are shorter than an STL header (84)")
    count = int.from_bytes(data[80:84], "little")
    held = (len(data) - 84) // 50
    check_triangles(min(count, held))
    if count > held:
        raise ValueError(f"its header counts {count} triangles, but it has {held}")
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=84)
    return records["corners"].reshape(-1, 3)


def _ascii(data: bytes) -> NDArray[np.float32]:
    check_triangles(len(data) // _FACET_BYTES)
    found = _VERTEX.findall(data)
    facets = len(re.findall(rb"endfacet", data, re.IGNORECASE))
    if len(found) != 3 * facets:
        raise ValueError(f"{facets} facets, but {len(found)} vertices; the file is truncated or broken")
    return np.array(found, dtype=np.float64).astype(np.float32).reshape(-1, 3)
