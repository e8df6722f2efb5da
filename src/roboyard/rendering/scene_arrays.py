"""A scene as flat arrays: gathered once for each revision, so that a frame sends only transforms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboyard.rendering import textures
from roboyard.rendering.mesh_arrays import MeshArrays, mesh_arrays
from roboyard.rendering.scene import RenderScene, RenderShape

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

CACHE_KEY = "software"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneArrays:
    """Instances are the scene's shapes, in order; faces and vertices are those of the distinct meshes."""

    revision: int
    vertices: NDArray[np.float32]
    faces: Ints
    """Vertex numbers inside the face's own mesh."""
    normals: NDArray[np.float32]
    uv: NDArray[np.float32]
    colors: NDArray[np.uint8]
    texels: NDArray[np.uint32]
    texture_table: Ints

    frame: Ints
    """(instances,) row of the frame arrays."""
    position: Array
    """(instances, 3) of the mesh in its frame; m"""
    shape: Array
    """(instances, 3, 3) of the mesh in its frame: rotation times scale."""
    shape_inverse: Array
    boxes: Array
    """(instances, 2, 3) bounds of the mesh in its own coordinates."""
    opaque: Ints
    """(draws, 6): instance, vertices from, to, faces from, to, side to cull."""
    clear: Ints
    """Draws that let light through."""
    casters: Ints
    """Draws that throw shadows."""
    planes: Ints
    """Instances that are endless planes and opaque."""
    clear_planes: Ints
    looks: Array
    """(instances, 11): rgba, specular, second rgb and size of the checker (0: none), scale along x and y."""
    links: Ints
    """(instances, 7): body id, link index, texture or -1, first mesh color or -1, first uv or -1, first face
    of the mesh, first vertex of the mesh."""
    most_vertices: int


def scene_arrays(scene: RenderScene) -> SceneArrays:
    """The arrays of `scene`, remembered in it until its revision changes."""
    kept = scene.extra.get(CACHE_KEY)
    if isinstance(kept, SceneArrays) and kept.revision == scene.revision:
        return kept
    arrays = _gather(scene.shapes, scene.revision)
    scene.extra[CACHE_KEY] = arrays
    return arrays


def _gather(shapes: Sequence[RenderShape], revision: int) -> SceneArrays:
    meshes: dict[int, tuple[MeshArrays, int, int, int, int]] = {}
    order: list[MeshArrays] = []
    counts = np.zeros(4, dtype=int)  # vertices, faces, uv, colors so far
    images: dict[int, int] = {}
    pictures: list[NDArray[np.uint8]] = []
    looks = np.zeros((len(shapes), 11))
    links = np.full((len(shapes), 7), -1, dtype=np.int32)
    boxes = np.zeros((len(shapes), 2, 3))
    local = np.tile(np.eye(3), (len(shapes), 1, 1))
    draws: dict[str, list[tuple[int, ...]]] = {"opaque": [], "clear": [], "casters": []}
    planes: dict[bool, list[int]] = {False: [], True: []}
    for i, shape in enumerate(shapes):
        arrays = mesh_arrays(shape.mesh)
        if id(arrays) not in meshes:
            meshes[id(arrays)] = (arrays, *counts)
            order.append(arrays)
            counts += (
                len(arrays.vertices),
                len(arrays.faces),
                0 if arrays.uv is None else len(arrays.faces),
                0 if arrays.colors is None else len(arrays.faces),
            )
        _, vertex, face, uv, color = meshes[id(arrays)]
        image = (
            shape.texture if shape.texture is not None or not shape.use_mesh_colors else shape.mesh.texture
        )
        see_through = shape.rgba[3] < 1.0
        texture = -1
        if image is not None and arrays.uv is not None:
            if id(image) not in images:
                images[id(image)] = len(pictures)
                pictures.append(textures.as_rgba(image))
            texture = images[id(image)]
            see_through |= textures.lets_light_through(pictures[texture], arrays.uv)
        colored = shape.use_mesh_colors and arrays.colors is not None
        looks[i, :4] = shape.rgba
        looks[i, 4] = shape.specular
        if shape.checker is not None:
            looks[i, 5:8], looks[i, 8] = shape.checker
        looks[i, 9:] = np.abs(shape.scale[:2])
        links[i] = (*shape.owner, texture, color if colored else -1, uv if texture >= 0 else -1, face, vertex)
        boxes[i] = arrays.bounds
        if shape.rgba[3] <= 0.0 or 0.0 in shape.scale:
            continue
        local[i] = np.asarray(shape.rotation, dtype=float) * np.asarray(shape.scale, dtype=float)
        if shape.infinite:
            planes[see_through].append(i)
            continue
        front = -1 if np.prod(shape.scale) < 0 else 1
        for run in range(4):
            a, b = arrays.runs[run], arrays.runs[run + 1]
            if a == b:
                continue
            kind = "clear" if see_through or (colored and run >= 2) else "opaque"
            draw = (i, vertex, vertex + len(arrays.vertices), face + a, face + b, 0 if run % 2 else front)
            draws[kind].append(draw)
            if kind == "opaque":
                draws["casters"].append(draw)
    return SceneArrays(
        revision=revision,
        vertices=_join([m.vertices for m in order], (0, 3), np.float32),
        faces=_join([m.faces for m in order], (0, 3), np.int32),
        normals=_join([m.normals for m in order], (0, 3, 3), np.float32),
        uv=_join([m.uv for m in order if m.uv is not None], (0, 3, 2), np.float32),
        colors=_join([m.colors for m in order if m.colors is not None], (0, 4), np.uint8),
        texels=(packed := textures.pack(pictures))[0],
        texture_table=packed[1],
        frame=np.array([shape.frame for shape in shapes], dtype=np.int32),
        position=np.array([shape.position for shape in shapes], dtype=float).reshape(-1, 3),
        shape=local,
        shape_inverse=np.asarray(np.linalg.inv(local), dtype=float),
        boxes=boxes,
        opaque=np.array(draws["opaque"], dtype=np.int32).reshape(-1, 6),
        clear=np.array(draws["clear"], dtype=np.int32).reshape(-1, 6),
        casters=np.array(draws["casters"], dtype=np.int32).reshape(-1, 6),
        planes=np.array(planes[False], dtype=np.int32),
        clear_planes=np.array(planes[True], dtype=np.int32),
        looks=looks,
        links=links,
        most_vertices=max((len(m.vertices) for m in order), default=0),
    )


def _join(arrays: Sequence[NDArray], empty: tuple[int, ...], dtype: type) -> NDArray:
    if not arrays:
        return np.zeros(empty, dtype=dtype)
    return np.ascontiguousarray(np.concatenate(arrays), dtype=dtype)
