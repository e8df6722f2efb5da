"""Read STL, binary and ASCII; equal corners become one vertex."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboyard.shapes.readers.parts import Part

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(data: bytes, file: Path) -> list[Part]:
    """The file's triangles as one part, flat (facet normals are left to whoever draws)."""
    corners = _ascii(data) if _is_ascii(data) else _binary(data)
    vertices, faces = merge_equal(corners)
    return [Part(vertices=vertices.astype(np.float64), faces=faces.reshape(-1, 3))]


def merge_equal(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Distinct rows of (n, 3) `points`, in order of first use, and (n,) which of them each point is."""
    bits = np.ascontiguousarray(points + np.float32(0.0)).view(np.uint32).astype(np.uint64)  # -0 is 0
    _, xy = np.unique(bits[:, 0] << np.uint64(32) | bits[:, 1], return_inverse=True)
    _, first, which = np.unique(
        xy.astype(np.uint64) << np.uint64(32) | bits[:, 2], return_index=True, return_inverse=True
    )
    order = np.argsort(first)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return points[first[order]], place[which]


def _is_ascii(data: bytes) -> bool:
    """True for ASCII: binary files too may begin with "solid", but then their size fits their count."""
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return False
    head = data[:1024].lstrip()
    return head[:5].lower() == b"solid" and (b"facet" in data[:65536] or b"endsolid" in data)


def _binary(data: bytes) -> NDArray[np.float32]:
    if len(data) < 84:
        raise ValueError("shorter than an STL header")
    count = int.from_bytes(data[80:84], "little")
    held = (len(data) - 84) // 50
    if count > held:
        raise ValueError(f"its header counts {count} triangles, but it holds {held}")
    records = np.frombuffer(data, dtype=_RECORD, count=count, offset=84)
    return records["corners"].reshape(-1, 3)


def _ascii(data: bytes) -> NDArray[np.float32]:
    found = _VERTEX.findall(data)
    facets = len(re.findall(rb"endfacet", data, re.IGNORECASE))
    if len(found) != 3 * facets:
        raise ValueError(f"{facets} facets, but {len(found)} vertices; the file is cut or broken")
    return np.array(found, dtype=np.float64).astype(np.float32).reshape(-1, 3)
