"""Write a render shape as binary glTF: vertices, colours and texture in one file for a browser.

Source of the format: Khronos Group, glTF 2.0 Specification, sections 3 and 4 (GLB). Colours of a shape are
sRGB; colour factors in glTF are linear.
"""

from __future__ import annotations

import io
import json
import struct
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.rendering.mesh_arrays import MeshArrays, unsorted_arrays
from roboyard.rendering.scene import RenderShape
from roboyard.rendering.smoothing import is_closed

FLOAT, UNSIGNED = 5126, 5125
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
NEAREST, LINEAR, TRILINEAR = 9728, 9729, 9987
REPEAT = 10497
DARKEST = 0.03
"""Least linear light of the brightest channel: black surfaces would show no shape."""
CHECKER_PIXELS = 64
"""Side of the texture of a checkerboard, which has two by two squares (pixels)."""


def glb(shape: RenderShape) -> bytes:
    """Return a shape as binary glTF, its scale applied, in the mesh frame."""
    arrays = unsorted_arrays(shape.mesh)
    file = _File()
    corners = arrays.vertices[arrays.faces].reshape(-1, 3) * np.asarray(shape.scale, dtype=np.float32)
    normals = _scaled_normals(arrays.normals.reshape(-1, 3), shape.scale)
    if np.prod(shape.scale) < 0:  # mirroring reverses the order of the corners
        corners, normals = (a.reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3) for a in (corners, normals))
    image, uv = _picture(shape, arrays, corners)
    if uv is not None and image is not None:
        file.add_image(image, sharp=shape.checker is not None)
    else:
        uv = None
    rows, index = _joined(corners, normals, uv)
    attributes = {
        "POSITION": file.add_array(rows[:, :3], "VEC3", bounds=True),
        "NORMAL": file.add_array(rows[:, 3:6], "VEC3"),
    }
    if uv is not None:
        attributes["TEXCOORD_0"] = file.add_array(rows[:, 6:8], "VEC2")
    faces = index.reshape(-1, 3)
    file.is_closed = is_closed(arrays.vertices, arrays.faces)
    colors = arrays.colors if shape.use_mesh_colors else None
    factor = np.asarray(shape.rgba, dtype=float)
    if colors is None:
        file.add_primitive(attributes, faces, factor, textured=uv is not None, specular=shape.specular)
    else:
        distinct, of_face = np.unique(colors, axis=0, return_inverse=True)
        for k, color in enumerate(distinct):
            file.add_primitive(
                attributes,
                faces[of_face.ravel() == k],
                factor * color / 255.0,
                textured=uv is not None,
                specular=shape.specular,
            )
    return file.to_bytes()


def triangles(shape: RenderShape) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return (k, 3) vertices (m), scale applied, and (n, 3) faces of a shape in the mesh frame."""
    arrays = unsorted_arrays(shape.mesh)
    vertices = arrays.vertices * np.asarray(shape.scale, dtype=np.float32)
    return vertices.astype(np.float32), np.asarray(arrays.faces, dtype=np.uint32)


def linear_rgb(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light of (..., 3) sRGB colours, both 0 to 1. Source: IEC 61966-2-1."""
    c = np.clip(srgb, 0.0, 1.0)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def _scaled_normals(normals: NDArray, scale: tuple[float, float, float]) -> NDArray[np.float32]:
    """Return (n, 3) unit normals of the scaled surface."""
    given = np.asarray(scale, dtype=np.float32)
    turned = normals / np.where(given == 0.0, 1.0, given)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0], dtype=np.float32)
    return np.where(length > 1e-12, turned / np.maximum(length, 1e-12), up).astype(np.float32)


def _picture(
    shape: RenderShape, arrays: MeshArrays, corners: NDArray
) -> tuple[NDArray[np.uint8] | None, NDArray | None]:
    """Return the texture and (n, 2) coordinates of the corners, v downwards as in glTF; None: no texture."""
    image = shape.texture if shape.texture is not None or not shape.use_mesh_colors else shape.mesh.texture
    if image is not None and arrays.uv is not None:
        return image, arrays.uv.reshape(-1, 2) * (1.0, -1.0) + (0.0, 1.0)
    if shape.checker is None:
        return None, None
    second, square = shape.checker
    tile = np.full((CHECKER_PIXELS, CHECKER_PIXELS, 4), 255, dtype=np.uint8)
    half = CHECKER_PIXELS // 2
    # the colour factor is linear and multiplies the texture, so the ratio of the colours is linear too
    share = linear_rgb(np.asarray(second, dtype=float)) / np.maximum(
        linear_rgb(np.asarray(shape.rgba[:3], dtype=float)), 1e-6
    )
    tile[:half, half:, :3] = tile[half:, :half, :3] = np.round(255 * _srgb(share))
    return tile, corners[:, :2] / (2.0 * square)


def _srgb(linear: NDArray) -> NDArray:
    c = np.clip(linear, 0.0, 1.0)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)


def _joined(
    corners: NDArray, normals: NDArray, uv: NDArray | None
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return distinct vertices as rows, and the row of each corner."""
    columns = [corners, normals] if uv is None else [corners, normals, uv]
    rows = np.ascontiguousarray(np.hstack(columns), dtype=np.float32)
    if not len(rows):
        return rows, np.zeros(0, dtype=np.uint32)
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    # in the order of their first use: neighbours are near each other in memory
    order = np.argsort(first)
    place = np.empty(len(first), dtype=np.uint32)
    place[order] = np.arange(len(first), dtype=np.uint32)
    return rows[first[order]], place[index.ravel()]


class _File:
    """A glTF document with one buffer, being written."""

    def __init__(self) -> None:
        self.is_closed = False
        """Whether the backs of all faces are out of sight."""
        self._data = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._materials: list[dict[str, Any]] = []
        self._primitives: list[dict[str, Any]] = []
        self._images: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []

    def _view(self, data: bytes, target: int | None = None) -> int:
        self._data.extend(b"\0" * (-len(self._data) % 4))
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)}
        self._views.append(view if target is None else {**view, "target": target})
        self._data.extend(data)
        return len(self._views) - 1

    def add_array(self, values: NDArray, kind: str, *, bounds: bool = False) -> int:
        """Add (n, k) vertex data; returns the index of its accessor."""
        floats = np.ascontiguousarray(values, dtype="<f4")
        accessor: dict[str, Any] = {
            "bufferView": self._view(floats.tobytes(), ARRAY_BUFFER),
            "componentType": FLOAT,
            "count": len(floats),
            "type": kind,
        }
        if bounds and len(floats):
            accessor |= {"min": floats.min(axis=0).tolist(), "max": floats.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add_image(self, image: NDArray[np.uint8], *, sharp: bool) -> None:
        """Add the texture of all primitives, (h, w, 4) RGBA."""
        from PIL import Image

        png = io.BytesIO()
        Image.fromarray(np.ascontiguousarray(image)).save(png, format="PNG", compress_level=3)
        self._images.append({"bufferView": self._view(png.getvalue()), "mimeType": "image/png"})
        self._samplers.append(
            {
                "magFilter": NEAREST if sharp else LINEAR,
                "minFilter": TRILINEAR,
                "wrapS": REPEAT,
                "wrapT": REPEAT,
            }
        )

    def add_primitive(
        self, attributes: dict[str, int], faces: NDArray, rgba: NDArray, *, textured: bool, specular: float
    ) -> None:
        """Add (n, 3) faces of one colour."""
        index = np.ascontiguousarray(faces, dtype="<u4")
        self._accessors.append(
            {
                "bufferView": self._view(index.tobytes(), ELEMENT_BUFFER),
                "componentType": UNSIGNED,
                "count": index.size,
                "type": "SCALAR",
            }
        )
        alpha = float(np.clip(rgba[3], 0.0, 1.0))
        linear = linear_rgb(rgba[:3])
        surface: dict[str, Any] = {
            "baseColorFactor": [*(float(c) for c in linear + max(DARKEST - linear.max(), 0.0)), alpha],
            "metallicFactor": 0.0,
            "roughnessFactor": float(np.clip(1.0 - specular, 0.3, 1.0)),
        }
        if textured:
            surface["baseColorTexture"] = {"index": 0}
        both = not self.is_closed or alpha < 1.0
        material: dict[str, Any] = {"pbrMetallicRoughness": surface, "doubleSided": both}
        if alpha < 1.0:
            material["alphaMode"] = "BLEND"
        self._materials.append(material)
        self._primitives.append(
            {
                "attributes": attributes,
                "indices": len(self._accessors) - 1,
                "material": len(self._materials) - 1,
            }
        )

    def to_bytes(self) -> bytes:
        self._data.extend(b"\0" * (-len(self._data) % 4))
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Roboyard"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": self._primitives}],
            "materials": self._materials,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data)}],
        }
        if self._images:
            document |= {
                "images": self._images,
                "samplers": self._samplers,
                "textures": [{"source": 0, "sampler": 0}],
            }
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + len(self._data)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, total),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(self._data), b"BIN\0"),
                bytes(self._data),
            ]
        )
