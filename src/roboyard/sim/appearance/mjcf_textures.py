"""Textures of a compiled MuJoCo model: the image of a geom, and its texture coordinates.

MuJoCo's reference defines `texrepeat` and `texuniform`; the origin and direction of images were measured on
pictures of MuJoCo's own renderer.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from roboyard._arrays import NDArray
from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.rendering.textures import as_rgba
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.sim.appearance.cube_texture import wrap_in_cube
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine

Array = NDArray[np.float64]

_ROLES = (mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_RGBA)
_KINDS = mujoco.mjtGeom
_DEFAULT_RGBA = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)


def color_of(model: Any, geom: int) -> tuple[float, float, float, float]:
    """Return the RGBA of a geom: its own if it differs from MuJoCo's default, else its material's."""
    own = model.geom_rgba[geom]
    material = int(model.geom_matid[geom])
    rgba = model.mat_rgba[material] if material >= 0 and np.array_equal(own, _DEFAULT_RGBA) else own
    return tuple(float(v) for v in rgba)  # pyright: ignore[reportReturnType]


@dataclass(eq=False)
class TextureMaps:
    """The textures of one compiled model; equal geoms share images and meshes."""

    model: Any
    _files: dict[int, TriangleMesh] = field(default_factory=dict)
    _images: dict[int, NDArray[np.uint8]] = field(default_factory=dict)
    _meshes: dict[tuple[Any, ...], tuple[TriangleMesh, TriangleMesh]] = field(default_factory=dict)

    def mesh(self, row: int) -> TriangleMesh:
        """Return a compiled mesh."""
        if row not in self._files:
            self._files[row] = mesh_of(self.model, row)
        return self._files[row]

    def put_on(
        self, geom: int, mesh: TriangleMesh, scale: tuple[float, float, float]
    ) -> tuple[TriangleMesh, NDArray[np.uint8]] | None:
        """Return `mesh` with texture coordinates and the (h, w, 4) image of a geom's texture; None without
        one.

        `mesh` times `scale` is the geom in its own coordinates. A cube texture on a plane or a height field,
        which MuJoCo draws as four triangles about the origin, becomes its mean colour. A flat image on a
        capsule goes round it once; MuJoCo repeats it on each of its three parts.
        """
        texture = texture_of(self.model, geom)
        if texture < 0:
            return None
        if texture not in self._images:
            self._images[texture] = image_of(self.model, texture)
        image = self._images[texture]
        is_cube = int(self.model.tex_type[texture]) != int(mujoco.mjtTexture.mjTEXTURE_2D)
        kind = int(self.model.geom_type[geom])
        if is_cube and kind in (int(_KINDS.mjGEOM_PLANE), int(_KINDS.mjGEOM_HFIELD)):
            return mesh, np.round(image.mean(axis=(0, 1), keepdims=True)).astype(np.uint8)
        size = tuple(float(v) for v in self.model.geom_size[geom])
        key = (
            id(mesh),
            scale,
            kind,
            size,
            int(self.model.geom_matid[geom]),
            int(self.model.geom_dataid[geom]),
        )
        if key not in self._meshes:
            factors = np.asarray(scale, dtype=float)
            make = self._wrapped if is_cube else self._printed
            self._meshes[key] = (mesh, make(geom, mesh, factors, image))  # kept, so that its id stays valid
        return self._meshes[key][1], image

    def _printed(self, geom: int, mesh: TriangleMesh, scale: Array, image: NDArray[np.uint8]) -> TriangleMesh:
        return replace(mesh, uv=read_only(_flat_uv(self.model, geom, mesh, scale), np.float64))

    def _wrapped(self, geom: int, mesh: TriangleMesh, scale: Array, image: NDArray[np.uint8]) -> TriangleMesh:
        uniform = bool(self.model.mat_texuniform[int(self.model.geom_matid[geom])])
        if int(self.model.geom_type[geom]) == int(_KINDS.mjGEOM_MESH):
            scale = scale * np.array(self.model.geom_size[geom], dtype=float) if uniform else scale
            # MuJoCo would stretch the mesh's own points
            return wrap_in_cube(mesh, scale, None, image.shape[1], max(image.shape[0] // image.shape[1], 1))
        unit = None if uniform else lambda places: _on_unit_shape(self.model, geom, places)
        return wrap_in_cube(mesh, scale, unit, image.shape[1], max(image.shape[0] // image.shape[1], 1))


_of_worlds: WeakKeyDictionary[Engine[Body], TextureMaps] = WeakKeyDictionary()


def texture_maps_of(world: Engine[Body]) -> TextureMaps:
    """Return the textures of a world's compiled model, cached until it is compiled again."""
    model = world.live_model
    kept = _of_worlds.get(world)
    if kept is None or kept.model is not model:
        kept = _of_worlds[world] = TextureMaps(model)
    return kept


def texture_of(model: Any, geom: int) -> int:
    """Return the row of the texture of a geom; -1 for none."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return -1
    return next((int(row) for role in _ROLES if (row := model.mat_texid[material, role]) >= 0), -1)


def image_of(model: Any, texture: int) -> NDArray[np.uint8]:
    """Return an (h, w, 4) RGBA image; the six sides of a cube (+x, -x, +y, -y, +z, -z) below one another."""
    shape = tuple(int(a[texture]) for a in (model.tex_height, model.tex_width, model.tex_nchannel))
    start = int(model.tex_adr[texture])
    image = np.array(model.tex_data[start : start + int(np.prod(shape))]).reshape(shape)
    return as_rgba(image[..., 0] if shape[2] == 1 else image)


def mesh_of(model: Any, mesh: int) -> TriangleMesh:
    """Return a compiled mesh; with texture coordinates, it has a vertex for each corner of each face."""
    v0, nv = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    f0, nf = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices, faces = model.mesh_vert[v0 : v0 + nv], model.mesh_face[f0 : f0 + nf]
    first = int(model.mesh_texcoordadr[mesh])
    if first < 0:
        return TriangleMesh(vertices=read_only(vertices, np.float64), faces=read_only(faces, np.int32))
    uv = model.mesh_texcoord[first : first + int(model.mesh_texcoordnum[mesh])]
    uv = uv[model.mesh_facetexcoord[f0 : f0 + nf].ravel()]
    return TriangleMesh(
        vertices=read_only(vertices[faces.ravel()], np.float64),
        faces=read_only(np.arange(3 * nf).reshape(-1, 3), np.int32),
        uv=read_only(uv * (1.0, -1.0) + (0.0, 1.0), np.float64),
    )


def _flat_uv(model: Any, geom: int, mesh: TriangleMesh, scale: Array) -> Array:
    """Return (n, 2) texture coordinates of each vertex for a flat image; v up."""
    material = int(model.geom_matid[geom])
    repeat = np.array(model.mat_texrepeat[material], dtype=float)
    uniform = bool(model.mat_texuniform[material])
    size = np.array(model.geom_size[geom], dtype=float)
    places = mesh.vertices * scale
    match int(model.geom_type[geom]):
        case int(_KINDS.mjGEOM_PLANE):
            half = size[:2]
            # along an endless axis the image's middle is at the origin and the plane counts as 2 m wide
            corner = np.where(half > 0.0, half, 1.0 / repeat)
            unit = np.where((half > 0.0) & (not uniform), half, 1.0)
            return _from_upper_left(places[:, :2], corner, 0.5 * repeat / unit)
        case int(_KINDS.mjGEOM_HFIELD):
            return _from_the_middle(places, model.hfield_size[int(model.geom_dataid[geom])], repeat, uniform)
        case int(_KINDS.mjGEOM_BOX):
            assert mesh.normals is not None
            side = np.abs(mesh.normals).argmax(axis=1)
            across, up = np.array([1, 0, 0])[side], np.array([2, 2, 1])[side]
            pick = np.stack([across, up], axis=1)
            half = size[pick]
            times = repeat * (size[:2] if uniform else 1.0)
            return _from_upper_left(np.take_along_axis(places, pick, axis=1), half, 0.5 * times / half)
        case kind:
            if mesh.uv is None:
                return _from_the_middle(places, np.abs(places).max(axis=0), repeat, uniform)
            down = mesh.uv * (1.0, -1.0) + (0.0, 1.0)
            if kind == int(_KINDS.mjGEOM_CYLINDER):
                assert mesh.normals is not None
                cap = np.abs(mesh.normals[:, 2]) > 0.5
                down[cap] = 0.5 + 0.5 * places[cap, :2] / size[0]
            round_shapes = (_KINDS.mjGEOM_SPHERE, _KINDS.mjGEOM_CYLINDER, _KINDS.mjGEOM_CAPSULE)
            widths = size[[0, 0]] if kind in map(int, round_shapes) else size[:2]
            return down * repeat * (widths if uniform else 1.0) * (1.0, -1.0) + (0.0, 1.0)


def _from_the_middle(places: Array, half: Array, repeat: Array, uniform: bool) -> Array:
    """Return (n, 2) texture coordinates of (n, 3) points for an image projected along z, centred."""
    unit = np.ones(2) if uniform else np.maximum(half[:2], 1e-9)
    return _from_upper_left(places[:, :2], unit / repeat, 0.5 * repeat / unit)


def _from_upper_left(places: Array, corner: Array, per_metre: Array) -> Array:
    """Return (n, 2) coordinates of (n, 2) points; the upper left corner is (-corner x, +corner y)."""
    along = (places * (1.0, -1.0) + corner) * per_metre
    return along * (1.0, -1.0) + (0.0, 1.0)


def _on_unit_shape(model: Any, geom: int, places: Array) -> Array:
    """Return points (..., 3) of a primitive on the one of half size 1 that MuJoCo scales to it."""
    size = np.array(model.geom_size[geom], dtype=float)
    match int(model.geom_type[geom]):
        case int(_KINDS.mjGEOM_CYLINDER):
            return places / size[[0, 0, 1]]
        case int(_KINDS.mjGEOM_BOX) | int(_KINDS.mjGEOM_ELLIPSOID):
            return places / size
        case int(_KINDS.mjGEOM_CAPSULE):
            height = np.abs(places[..., 2])
            along = np.minimum(height / max(size[1], 1e-9), 1.0) + np.maximum(height - size[1], 0.0) / size[0]
            return np.concatenate(
                [places[..., :2] / size[0], (np.sign(places[..., 2]) * along)[..., None]], axis=-1
            )
    return places
