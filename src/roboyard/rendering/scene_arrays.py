"""A scene as flat arrays, collected once per revision, so that a frame needs only transforms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.rendering import textures
from roboyard.rendering.mesh_arrays import MeshArrays, mesh_arrays
from roboyard.rendering.scene import RenderScene, RenderShape

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

CACHE_KEY = "software"
SLAB = 0.1
"""Largest thickness over width of a shape that may be a floor."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SceneArrays:
    """Instances are the scene's shapes, in order; faces and vertices are those of the distinct meshes."""

    revision: int
    """Revision of the scene."""
    vertices: NDArray[np.float32]
    """(k, 3) in the mesh frame."""
    axes: NDArray[np.float32]
    """(3, k) the same, axis by axis."""
    faces: Ints
    """(m, 3) vertex indices inside the face's own mesh."""
    normals: NDArray[np.float32]
    """(m, 3, 3) unit normal at each corner of a face, in the mesh frame."""
    uv: NDArray[np.float32]
    """(t, 3, 2) texture coordinates of the corners of textured meshes' faces."""
    colors: NDArray[np.uint8]
    """(c, 4) RGBA of the faces of coloured meshes."""
    texels: NDArray[np.uint32]
    """Packed colours of all textures, see `roboyard.rendering.textures.pack`."""
    texture_table: Ints
    """Place of each texture's levels in `texels`, see `roboyard.rendering.textures.pack`."""
    images: tuple[NDArray[np.uint8], ...]
    """All textures."""

    frame: Ints
    """(instances,) row of the frame arrays."""
    position: Array
    """(instances, 3) position of the mesh in its frame (m)."""
    shape: Array
    """(instances, 3, 3) rotation times scale of the mesh in its frame."""
    shape_inverse: Array
    """(instances, 3, 3) inverse of `shape`."""
    boxes: Array
    """(instances, 2, 3) bounds of the mesh in the mesh frame."""
    middles: Array
    """(instances, 3) middle of these bounds."""
    halves: Array
    """(instances, 3) half of their sides."""
    slabs: Ints
    """(slabs, 2) instances in `opaque` that may be a floor, and their thin axis in the mesh frame."""
    opaque: Ints
    """(draws, 6): instance, vertices from, to, faces from, to, side to cull; these also cast shadows."""
    casters: Ints
    """Instances in `opaque`, each once."""
    clear: Ints
    """(draws, 6) like `opaque`, transparent."""
    planes: Ints
    """Instances that are infinite planes and opaque."""
    clear_planes: Ints
    """Instances that are infinite planes and transparent."""
    materials: Array
    """(instances, 11): RGBA, specular, second RGB and square size of the checkerboard (0: none), scale along
    x and y."""
    links: Ints
    """(instances, 7): body id, link index, texture, first mesh colour, first texture coordinate (-1: none
    each), first face and first vertex of the mesh."""
    most_vertices: int
    """Vertices of the largest mesh."""
    textured: bool
    """Whether any instance has a texture."""


def scene_arrays(scene: RenderScene) -> SceneArrays:
    """Return the arrays of `scene`, cached in it until its revision changes."""
    cached = scene.extra.get(CACHE_KEY)
    if isinstance(cached, SceneArrays) and cached.revision == scene.revision:
        return cached
    arrays = _gather(scene.shapes, scene.revision, cached if isinstance(cached, SceneArrays) else None)
    scene.extra[CACHE_KEY] = arrays
    return arrays


def recolored(arrays: SceneArrays, colors: Array) -> SceneArrays:
    """Return the arrays with other colours of the shapes; all else is shared.

    The second colour of a checkerboard changes by as much as the first.

    Args:
        arrays: of a scene.
        colors: (instances, 3) RGB, 0 to 1.
    """
    materials = arrays.materials.copy()
    materials[:, 5:8] = np.clip(materials[:, 5:8] + colors - materials[:, :3], 0.0, 1.0)
    materials[:, :3] = colors
    return replace(arrays, materials=materials)


class _MeshTable:
    """The distinct meshes and textures of a scene, with the offset of each in the joined arrays."""

    def __init__(self) -> None:
        self.meshes: list[MeshArrays] = []
        self.images: list[NDArray[np.uint8]] = []
        self._offsets: dict[int, tuple[int, ...]] = {}
        self._counts = np.zeros(4, dtype=int)
        self._images: dict[int, int] = {}

    def offsets(self, arrays: MeshArrays) -> tuple[int, ...]:
        """Return the first vertex, face, texture coordinate and mesh colour of a mesh."""
        if id(arrays) not in self._offsets:
            self._offsets[id(arrays)] = tuple(self._counts.tolist())
            self.meshes.append(arrays)
            faces = len(arrays.faces)
            uvs, colors = (0 if part is None else faces for part in (arrays.uv, arrays.colors))
            self._counts += (len(arrays.vertices), faces, uvs, colors)
        return self._offsets[id(arrays)]

    def image(self, image: NDArray[np.uint8]) -> int:
        """Return the index of a texture."""
        if id(image) not in self._images:
            self._images[id(image)] = len(self.images)
            self.images.append(textures.as_rgba(image))
        return self._images[id(image)]


class _DrawLists:
    """Instances and ranges of faces to draw."""

    def __init__(self) -> None:
        self.opaque: list[tuple[int, ...]] = []
        self.clear: list[tuple[int, ...]] = []
        self.planes: list[int] = []
        self.clear_planes: list[int] = []

    def add(
        self, i: int, shape: RenderShape, arrays: MeshArrays, offsets: tuple[int, ...], *, see_through: bool
    ) -> None:
        """Add instance i; `offsets` as of `_MeshTable.offsets`."""
        if shape.infinite:
            (self.clear_planes if see_through else self.planes).append(i)
            return
        vertex, face = offsets[:2]
        colored = shape.use_mesh_colors and arrays.colors is not None
        front = -1 if np.prod(shape.scale) < 0 else 1
        for run in range(4):
            a, b = arrays.runs[run], arrays.runs[run + 1]
            if a == b:
                continue
            draws = self.clear if see_through or (colored and run >= 2) else self.opaque
            cull = 0 if run % 2 else front
            draws.append((i, vertex, vertex + len(arrays.vertices), face + a, face + b, cull))


def _gather(shapes: Sequence[RenderShape], revision: int, before: SceneArrays | None) -> SceneArrays:
    """Collect the arrays of shapes; those of textures are as before where the images are the same."""
    table, draws = _MeshTable(), _DrawLists()
    materials = np.zeros((len(shapes), 11))
    links = np.full((len(shapes), 7), -1, dtype=np.int32)
    boxes = np.zeros((len(shapes), 2, 3))
    local, inverse = np.tile(np.eye(3), (2, len(shapes), 1, 1))
    for i, shape in enumerate(shapes):
        arrays = mesh_arrays(shape.mesh)
        offsets = table.offsets(arrays)
        vertex, face, uv, color = offsets
        own = shape.texture is not None or not shape.use_mesh_colors
        image = shape.texture if own else shape.mesh.texture
        texture, see_through = -1, shape.rgba[3] < 1.0
        if image is not None and arrays.uv is not None:
            texture = table.image(image)
            see_through |= textures.lets_light_through(table.images[texture], arrays.uv)
        if not shape.use_mesh_colors or arrays.colors is None:
            color = -1
        materials[i] = _material(shape)
        links[i] = (*shape.owner, texture, color, uv if texture >= 0 else -1, face, vertex)
        boxes[i] = arrays.bounds
        if shape.rgba[3] > 0.0 and 0.0 not in shape.scale:
            turn, scale = np.asarray(shape.rotation, dtype=float), np.asarray(shape.scale, dtype=float)
            local[i], inverse[i] = turn * scale, (turn / scale).T
            draws.add(i, shape, arrays, offsets, see_through=see_through)
    images = tuple(table.images)
    if before is not None and _are_same(images, before.images):
        texels, texture_table = before.texels, before.texture_table
    else:
        texels, texture_table = textures.pack(images)
    meshes = table.meshes
    opaque = np.array(draws.opaque, dtype=np.int32).reshape(-1, 6)
    vertices = _join([m.vertices for m in meshes], (0, 3), np.float32)
    casters = np.unique(opaque[:, 0])
    halves = 0.5 * (boxes[:, 1] - boxes[:, 0])
    extent = halves * np.linalg.norm(local, axis=1)
    in_order = np.sort(extent[casters], axis=1)
    slabs = casters[in_order[:, 0] < SLAB * in_order[:, 1]]
    return SceneArrays(
        revision=revision,
        vertices=vertices,
        axes=np.ascontiguousarray(vertices.T),
        faces=_join([m.faces for m in meshes], (0, 3), np.int32),
        normals=_join([m.normals for m in meshes], (0, 3, 3), np.float32),
        uv=_join([m.uv for m in meshes if m.uv is not None], (0, 3, 2), np.float32),
        colors=_join([m.colors for m in meshes if m.colors is not None], (0, 4), np.uint8),
        texels=texels,
        texture_table=texture_table,
        images=images,
        frame=np.array([shape.frame for shape in shapes], dtype=np.int32),
        position=np.array([shape.position for shape in shapes], dtype=float).reshape(-1, 3),
        shape=local,
        shape_inverse=inverse,
        boxes=boxes,
        middles=boxes.mean(axis=1),
        halves=halves,
        slabs=np.stack([slabs, np.argmin(extent[slabs], axis=1)], axis=1).astype(np.int32),
        opaque=opaque,
        casters=casters,
        clear=np.array(draws.clear, dtype=np.int32).reshape(-1, 6),
        planes=np.array(draws.planes, dtype=np.int32),
        clear_planes=np.array(draws.clear_planes, dtype=np.int32),
        materials=materials,
        links=links,
        most_vertices=max((len(m.vertices) for m in meshes), default=0),
        textured=bool((links[:, 2] >= 0).any()),
    )


def _are_same(images: Sequence[NDArray[np.uint8]], others: Sequence[NDArray[np.uint8]]) -> bool:
    """Return whether images are the same objects, whose pixels cannot have changed."""
    return len(images) == len(others) and all(
        one is other and not one.flags.writeable for one, other in zip(images, others, strict=True)
    )


def _material(shape: RenderShape) -> Array:
    """Return the (11,) row of `SceneArrays.materials` of a shape."""
    row = np.zeros(11)
    row[:4], row[4] = shape.rgba, shape.specular
    if shape.checker is not None:
        row[5:8], row[8] = shape.checker
    row[9:] = np.abs(shape.scale[:2])
    return row


def _join(arrays: Sequence[NDArray], empty: tuple[int, ...], dtype: type) -> NDArray:
    """Concatenate arrays; an empty list gives zeros of shape `empty`."""
    if not arrays:
        return np.zeros(empty, dtype=dtype)
    return np.ascontiguousarray(np.concatenate(arrays), dtype=dtype)
