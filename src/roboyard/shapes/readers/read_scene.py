"""Read glTF, GLB and PLY through trimesh, in the file's axes (glTF's y stays y)."""

from __future__ import annotations

import contextlib
import io
import logging
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.readers.external_files import MAX_PIXELS, find_external_file, pixels
from roboyard.shapes.readers.parts import Part, check_triangles
from roboyard.untrusted.files import read_file
from roboyard.untrusted.json_reading import parse_json

MAX_ITEMS = 40_000_000
"""Most numbers of all accessors of a glTF file."""
_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MAX_EXTERNAL_BYTES = 256 * 1024 * 1024
"""Largest buffer or image beside a glTF file (bytes)."""


def read_scene(data: bytes, file: Path) -> list[Part]:
    """Return one part for each object of the scene, in the scene's frame (m)."""
    import trimesh

    kind = file.suffix.lower().lstrip(".")
    if kind == "ply":
        _check_ply(data)
    else:
        _check_gltf(data)
    resolver = cast(Any, _Resolver(file))
    with _quiet():
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=kind, resolver=resolver, process=False, maintain_order=True
        )
    parts: list[Part] = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            parts.append(_part(geometry, np.asarray(transform)))
    return parts


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the reader's warnings; its errors are raised."""
    log = logging.getLogger("trimesh")
    level = log.level
    log.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(level)


class _Resolver:
    """Resolves a scene's external files for trimesh, inside the mesh's folders only."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def get(self, name: str) -> bytes:
        """Return the content of a file.

        Raises:
            FileNotFoundError: it is not in the mesh's folders.
        """
        found = find_external_file(self.file, name)
        if found is None:
            raise FileNotFoundError(f"{name} was not found in the mesh's folders")
        return read_file(found, MAX_EXTERNAL_BYTES)

    __getitem__ = get

    def keys(self) -> list[str]:
        return []


def _part(geometry: Any, transform: NDArray[np.float64]) -> Part:
    vertices = np.asarray(geometry.vertices) @ transform[:3, :3].T + transform[:3, 3]
    faces = np.asarray(geometry.faces, dtype=np.int64)
    if np.linalg.det(transform[:3, :3]) < 0:
        faces = faces[:, ::-1]
    normals: NDArray[np.float64] | None = None
    if "vertex_normals" in geometry._cache.cache:  # read from the file, not derived
        inverse = np.linalg.pinv(transform[:3, :3]).astype(np.float64)
        normals = np.asarray(geometry.vertex_normals, dtype=np.float64) @ inverse
    color, uv, texture = _appearance(geometry)
    return Part(vertices=vertices, faces=faces, normals=normals, color=color, uv=uv, texture=texture)


def _appearance(
    geometry: Any,
) -> tuple[NDArray[np.uint8] | None, NDArray[np.float64] | None, NDArray[np.uint8] | None]:
    visual = geometry.visual
    if visual.kind in ("vertex", "face"):
        return np.asarray(visual.face_colors, dtype=np.uint8), None, None
    if visual.kind != "texture":
        return None, None, None
    material = visual.material
    factor = getattr(material, "baseColorFactor", None)
    color = None if factor is None else np.asarray(factor, dtype=np.uint8)
    image = getattr(material, "baseColorTexture", None)
    if image is None:
        image = getattr(material, "image", None)
    if image is not None and image.width * image.height > MAX_PIXELS:
        image = None
    if image is None or visual.uv is None:
        return (color if factor is not None else np.asarray(material.main_color, np.uint8)), None, None
    return color, np.asarray(visual.uv, dtype=np.float64), pixels(image)


def _check_ply(data: bytes) -> None:
    """Check that the header counts no more items than the file can have.

    Raises:
        ValueError: it does, or there is no header.
    """
    head = data[: data.find(b"end_header")] if b"end_header" in data[:65536] else b""
    if not data.startswith(b"ply") or not head:
        raise ValueError(f"no PLY header; starts with {data[:16]!r}")
    for name, count in re.findall(rb"element\s+(\S+)\s+(\d+)", head):
        if int(count) > len(data):
            raise ValueError(
                f"its header counts {int(count)} of {name.decode('ascii', 'replace')}, more than its size"
            )


def _check_gltf(data: bytes) -> None:
    """Check that the accessors declare no more data than fits in memory.

    Raises:
        ValueError: they do, or the file is not a glTF scene.
    """
    text = data
    if data.startswith(b"glTF"):
        length = int.from_bytes(data[12:16], "little")
        text = data[20 : 20 + length]
    tree = parse_json(text)
    if not isinstance(tree, dict):
        raise ValueError(f"not a glTF scene but {type(tree).__name__}")
    accessors = tree.get("accessors", [])
    counts = [int(a.get("count", 0)) * _NUMBERS.get(str(a.get("type")), 16) for a in accessors]
    lengths = [int(buffer.get("byteLength", 0)) for buffer in tree.get("buffers", [])]
    if min(counts, default=0) < 0 or sum(counts) > MAX_ITEMS or max(lengths, default=0) > 1 << 30:
        raise ValueError(f"it declares {sum(counts)} numbers and buffers of {max(lengths, default=0)} bytes")
    corners = [_corners(mesh, accessors) for mesh in tree.get("meshes", [])]
    shown = [int(node["mesh"]) for node in tree.get("nodes", []) if "mesh" in node]
    check_triangles(sum(corners[mesh] for mesh in shown if 0 <= mesh < len(corners)) // 3)


def _corners(mesh: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    """Corners of a mesh's triangles, at most; strips and fans have one for each after the second."""
    total = 0
    for primitive in mesh.get("primitives", []):
        index = primitive.get("indices", primitive.get("attributes", {}).get("POSITION"))
        if isinstance(index, int) and 0 <= index < len(accessors):
            per_item = 3 if primitive.get("mode") in (5, 6) else 1
            total += per_item * int(accessors[index].get("count", 0))
    return total
