"""Visual shapes: createVisualShape, getVisualShapeData, changeVisualShape, and getCollisionShapeData."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from posixpath import dirname, join, normpath
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Heightfield,
    Material,
    Mesh,
    Plane,
    Sphere,
    Visual,
)
from roboyard.pybullet.api.shapes.collision_shapes import (
    IDENTITY,
    NOWHERE,
    QUARTER_TURN,
    UNIT,
    at,
    memory_meshes,
    plain_geometry,
    pose_of,
    scale_of,
)
from roboyard.pybullet.bullet_rules.shape_bounds import is_between_ends
from roboyard.pybullet.bullet_rules.single_precision import matrix_signed
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import (
    quaternion,
    quaternion_or,
    text,
    vector3,
    vector3_or,
    whole,
)
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_appearance, replace_settings
from roboyard.pybullet.state.file_search import find_file
from roboyard.transforms import conjugate, multiply, rotate

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_FAILED, _ARRAY_FAILED = "createVisualShape failed.", "createVisualShapeArray failed."
_WHITE = (1.0, 1.0, 1.0, 1.0)
_PLAIN = (c.GEOM_SPHERE, c.GEOM_BOX, c.GEOM_CYLINDER, c.GEOM_CAPSULE)
_KNOWN: dict[Any, Visual] = {}
"""Visuals of plain shapes by what they were made of: programs make many of the same."""
_MOST_KNOWN = 256


@dataclass(frozen=True, kw_only=True, slots=True)
class VisualSet:
    """The visuals behind one visual shape id."""

    visuals: tuple[Visual, ...]
    """One visual, several from an array call, none for a missing mesh file."""


@command()
def createVisualShape(
    client: Client,
    shapeType: int,
    radius: float = 0.5,
    halfExtents: Vector | None = None,
    length: float = 1.0,
    fileName: str = "",
    meshScale: Vector = UNIT,
    planeNormal: Vector = (0.0, 0.0, 1.0),
    flags: int = 0,
    rgbaColor: Vector = _WHITE,
    specularColor: Vector | None = None,
    visualFramePosition: Vector = NOWHERE,
    visualFrameOrientation: Vector = IDENTITY,
    vertices: Sequence[Vector] | None = None,
    indices: Sequence[int] | None = None,
    normals: Sequence[Vector] | None = None,
    uvs: Sequence[Vector] | None = None,
) -> int:
    """Create a visual shape and return its id; arguments as in createCollisionShape.

    A missing mesh file gives a shape that shows nothing, as in PyBullet.

    Raises:
        error: the type is unknown or a size is not valid.
    """
    visual = _visual(
        client, whole(shapeType), radius, halfExtents, length, fileName, meshScale, planeNormal, rgbaColor,
        visualFramePosition, visualFrameOrientation, vertices, indices, normals, uvs,
    )  # fmt: skip
    return _keep(client, () if visual is None else (visual,))


@command()
def createVisualShapeArray(
    client: Client,
    shapeTypes: Sequence[int],
    radii: Sequence[float] | None = None,
    halfExtents: Sequence[Vector] | None = None,
    lengths: Sequence[float] | None = None,
    fileNames: Sequence[str] | None = None,
    meshScales: Sequence[Vector] | None = None,
    planeNormals: Sequence[Vector] | None = None,
    flags: Sequence[int] | None = None,
    rgbaColors: Sequence[Vector] | None = None,
    visualFramePositions: Sequence[Vector] | None = None,
    visualFrameOrientations: Sequence[Vector] | None = None,
) -> int:
    """Create one visual shape from several parts and return its id.

    Raises:
        error: there are no parts, or one is not valid.
    """
    if not len(shapeTypes):
        raise failure(_ARRAY_FAILED, f"shapeTypes is empty: {shapeTypes!r}")
    visuals = [
        _visual(
            client,
            whole(kind),
            at(radii, i, 0.5),
            at(halfExtents, i, (1.0, 1.0, 1.0)),
            at(lengths, i, 1.0),
            at(fileNames, i, ""),
            at(meshScales, i, (1.0, 1.0, 1.0)),
            at(planeNormals, i, (0.0, 0.0, 1.0)),
            at(rgbaColors, i, _WHITE),
            at(visualFramePositions, i, NOWHERE),
            at(visualFrameOrientations, i, IDENTITY),
            message=_ARRAY_FAILED,
        )
        for i, kind in enumerate(shapeTypes)
    ]
    return _keep(client, tuple(visual for visual in visuals if visual is not None))


@command()
def getVisualShapeData(client: Client, objectUniqueId: int, flags: int = 0) -> tuple[tuple[Any, ...], ...]:
    """How a body rendered_shapes.

    Returns:
        For each visual shape: body, link, type, dimensions (m), mesh file, position (m) and quaternion in the
        link frame, rgba, and with VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS the texture id. () for an unknown
        body.
    """
    scene = client.scene
    record = scene.bodies.get(whole(objectUniqueId))
    if record is None:
        return ()
    with_textures = bool(whole(flags) & c.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS)
    colors = _colors(scene, record)
    rows = []
    for index, link in enumerate(record.model.links):  # those with a new colour have it in the record, too
        shapes = link.visuals or link.collisions
        for place, (shape, color) in enumerate(zip(shapes, colors.get(index, ()), strict=False)):
            kind, size, file = _visual_description(shape.geometry)
            file = _as_found(record, shape.geometry, file)
            row = (
                *(record.number, index - 1, kind, size, file),
                *(*_reported_frame(shape), record.colors.get(index) or color),
            )
            if with_textures:
                row = (*row, scene.textures.of_shape(record, index, place, scene.world))
            rows.append(row)
    return tuple(rows)


def _reported_frame(shape: Collision | Visual) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return position (m) and orientation of a visual shape; Bullet has none for capsules between points."""
    if is_between_ends(shape):
        return NOWHERE, IDENTITY
    return tuple(shape.origin.position), own_orientation(shape)


@command()
def getCollisionShapeData(client: Client, objectUniqueId: int, linkIndex: int) -> tuple[tuple[Any, ...], ...]:
    """Return the collision shapes of a link.

    Returns:
        For each shape: body, link, type, dimensions (m), mesh file, position (m) and quaternion in the
        inertial frame. Heightfields are omitted, as in PyBullet.

    Raises:
        error: the body or link does not exist.
    """
    record = client.scene.bodies.get(whole(objectUniqueId))
    if record is None or not -1 <= whole(linkIndex) < record.joint_count:
        raise failure(
            "Error receiving collision shape info",
            f"there is no body {objectUniqueId} with a link {linkIndex}",
        )
    if record.soft is not None:
        raise failure(
            "Error receiving collision shape info", "soft bodies have no shapes; getMeshData has their nodes"
        )
    known = record.collision_rows.get(linkIndex)
    if known is not None:
        return known
    link = record.model.links[linkIndex + 1]
    back = conjugate(link.frame.quaternion)
    rows = []
    for shape in link.collisions:
        if isinstance(shape.geometry, Heightfield):
            continue
        kind, size, file = shape_description(
            shape.geometry, hull_cylinders=bool(record.file) and not record.model.implicit_cylinder
        )
        file = _as_found(record, shape.geometry, file)
        if kind == c.GEOM_MESH and not record.file:
            size, file = (1.0, 1.0, 1.0), b"unknown_file"
        offset = np.asarray(shape.origin.position) - np.asarray(link.frame.position)
        position = tuple(float(v) for v in rotate(back, offset))
        rotation = matrix_signed(*(float(v) for v in multiply(back, own_orientation(shape))))
        rows.append((record.number, linkIndex, kind, size, file, position, rotation))
    found = record.collision_rows[linkIndex] = tuple(rows)
    return found


@command()
def changeVisualShape(
    client: Client,
    objectUniqueId: int,
    linkIndex: int,
    shapeIndex: int = -1,
    textureUniqueId: int = -2,
    rgbaColor: Vector | None = None,
    specularColor: Vector | None = None,
    flags: int = -1,
) -> None:
    """Change colour, specular colour or texture of a link's shapes; shapeIndex -1 means all.

    Texture -1, or an unknown one, removes the texture. getVisualShapeData then reports a new colour for all
    shapes of the link, as in PyBullet. An unknown body or link is ignored.
    """
    scene = client.scene
    record = scene.bodies.get(whole(objectUniqueId))
    if record is None or not -1 <= whole(linkIndex) < record.joint_count:
        return
    rgba = None
    if rgbaColor is not None and len(rgbaColor) == 4:
        rgba = record.colors[linkIndex + 1] = quaternion(rgbaColor, "Error resetting visual shape info")
    fields: dict[str, Any] = {}
    if specularColor is not None and vector3_or(specularColor, NOWHERE) is not NOWHERE:
        r, g, b = vector3(specularColor, "")
        fields["specular"] = (r + g + b) / 3.0
    if whole(textureUniqueId) >= -1:
        fields["texture"] = scene.textures.image(textureUniqueId, scene.world)
    if rgba is not None and whole(shapeIndex) >= -1:
        scene.world.render_shapes.recolor(record.body, linkIndex + 1, shapeIndex, rgba)
    if fields:
        _change(client, record, linkIndex, whole(shapeIndex), fields)


@command()
def resetVisualShapeData(
    client: Client,
    objectUniqueId: int,
    linkIndex: int,
    shapeIndex: int = -1,
    textureUniqueId: int = -2,
    rgbaColor: Vector | None = None,
    specularColor: Vector | None = None,
    flags: int = -1,
) -> None:
    """Change visual shapes; the old name of changeVisualShape."""
    changeVisualShape(
        client, objectUniqueId, linkIndex, shapeIndex, textureUniqueId, rgbaColor, specularColor, flags
    )


@command()
def setDebugObjectColor(
    client: Client, objectUniqueId: int, linkIndex: int, objectDebugColorRGB: Vector | None = None
) -> None:
    """Check the colour and ignore it: the wireframe view that it sets does not exist here.

    Raises:
        error: the colour does not have three numbers.
    """
    if objectDebugColorRGB is not None:
        vector3(objectDebugColorRGB, "Error converting objectDebugColorRGB[3]")


# ------------------------------------------------------------------------------------------------- helpers


def _colors(scene: PhysicsScene, record: BodyRecord) -> dict[int, list[tuple[float, ...]]]:
    """Return the colours of the shapes that are drawn, by link, before scripts changed them.

    Those of a description are known without its meshes.
    """
    body = record.body
    if body.description is None:
        found = scene.world.render_shapes.of(body)
        shapes_of = {index: [drawn.shape for drawn in shapes] for index, shapes in found.items()}
        return {
            index: [_WHITE if shape.use_mesh_colors else tuple(shape.rgba) for shape in shapes]
            for index, shapes in shapes_of.items()
        }
    links = [own.link for own in body.form.links]
    has_visuals = any(link is not None and link.visuals for link in links)
    colors: dict[int, list[tuple[float, ...]]] = {}
    for index, link in enumerate(links):
        if link is None:
            continue
        materials = (
            [(visual.geometry, visual.material) for visual in link.visuals]
            if has_visuals
            else [(collision.geometry, None) for collision in link.collisions]
        )
        colors[index] = [
            _WHITE if material is None or material.rgba is None else tuple(material.rgba)
            for geometry, material in materials
            if not isinstance(geometry, Mesh) or geometry.data is not None or geometry.path is not None
        ]
    return colors


def own_orientation(shape: Collision | Visual) -> tuple[float, ...]:
    """Return the orientation (x, y, z, w) of a shape as it was given; heightfields are stored rotated."""
    if not isinstance(shape.geometry, Heightfield):
        return matrix_signed(*shape.origin.quaternion)
    return matrix_signed(*(float(v) for v in multiply(shape.origin.quaternion, conjugate(QUARTER_TURN))))


def shape_description(
    geometry: Geometry, *, hull_cylinders: bool = False
) -> tuple[int, tuple[float, ...], bytes]:
    """Return the type, dimensions (m) and file of a shape, as getCollisionShapeData reports them."""
    match geometry:
        case Box(size=size):
            return c.GEOM_BOX, tuple(size), b""
        case Sphere(radius=r):
            return c.GEOM_SPHERE, (r, r, r), b""
        case Cylinder(radius=r, length=length):
            if hull_cylinders:
                return c.GEOM_MESH, (1.0, 1.0, 1.0), b"unknown_file"
            return c.GEOM_CYLINDER, (length, r, 0.0), b""
        case Capsule(radius=r, length=length):
            return c.GEOM_CAPSULE, (length, r, 0.0), b""
        case Plane(normal=normal):
            return c.GEOM_PLANE, tuple(normal), b""
        case Mesh(scale=scale, path=path):
            return c.GEOM_MESH, tuple(scale), b"unknown_file" if path is None else str(path).encode()
        case Heightfield():
            return c.GEOM_HEIGHTFIELD, (1.0, 1.0, 1.0), b""


def _as_found(record: BodyRecord, geometry: Geometry, file: bytes) -> bytes:
    """Return the name of a mesh file as Bullet found it: under the script's own name of the URDF's folder.

    Bullet looks for the name that the URDF has in its folder, then in those above, and keeps `..` in it.
    """
    if record.folder is None or not isinstance(geometry, Mesh) or geometry.path is None or geometry.data:
        return file
    name = geometry.uri.removeprefix("package://").removeprefix("model://").removeprefix("file://")
    folder, place = record.folder, dirname(record.file)
    wanted = normpath(str(geometry.path))
    while True:
        if normpath(join(place, name)) == wanted:
            return join(folder, name).encode()
        if not folder or folder in ("/", ".", ".."):
            return file
        folder, place = dirname(folder), dirname(place)


def _visual_description(geometry: Geometry) -> tuple[int, tuple[float, ...], bytes]:
    """Return the type, dimensions (m) and file of a shape, as getVisualShapeData reports them."""
    kind, size, file = shape_description(geometry)
    match geometry:
        case Sphere(radius=radius):
            size = (radius, 0.0, 0.0)
        case Plane() | Heightfield():
            size = (0.0, 0.0, 0.0)
        case Mesh(data=data) if data is not None:
            file = b""
    return kind, size, file


def _visual(
    client: Client, kind: int, radius: float, half_extents: Vector | None, length: float, file_name: str,
    mesh_scale: Vector, normal: Vector, rgba: Vector, position: Vector, orientation: Vector,
    vertices: Sequence[Vector] | None = None, indices: Sequence[int] | None = None,
    normals: Sequence[Vector] | None = None, uvs: Sequence[Vector] | None = None, *,
    message: str = _FAILED,
) -> Visual | None:  # fmt: skip
    key: Any = None
    if kind in _PLAIN:
        try:
            extents = None if half_extents is None else tuple(half_extents)
            key = kind, radius, length, extents, tuple(rgba), tuple(position), tuple(orientation)
            found = _KNOWN.get(key)
        except TypeError:  # raised below, with PyBullet's text
            key = found = None
        if found is not None:
            return found
    r, g, b, a = quaternion_or(rgba, _WHITE)
    if kind == c.GEOM_MESH and vertices is None:
        path = find_file(client.search.folder, text(file_name), client.mounts)
        if path is None:
            return None
        geometry: Geometry = Mesh(uri=file_name, path=path, scale=scale_of(mesh_scale))
    elif kind == c.GEOM_MESH and vertices is not None and len(vertices):
        data = memory_meshes().mesh_of(vertices, indices, normals, uvs)
        geometry = Mesh(uri="", path=None, scale=scale_of(mesh_scale), data=data)
    else:
        geometry = plain_geometry(
            *(client, kind, radius, half_extents, length, file_name, mesh_scale, normal),
            *(vertices, indices, message),
        )
    made = Visual(
        geometry=geometry,
        origin=pose_of(position, orientation),
        material=_paint((r, g, b, a)),
    )
    if key is not None:
        if len(_KNOWN) >= _MOST_KNOWN:
            _KNOWN.clear()
        _KNOWN[key] = made
    return made


@lru_cache(_MOST_KNOWN)
def _paint(rgba: tuple[float, float, float, float]) -> Material:
    return Material(rgba=rgba)


def _keep(client: Client, visuals: tuple[Visual, ...]) -> int:
    scene = client.scene
    number = scene.visual_ids.take()
    scene.visual_shapes[number] = VisualSet(visuals=visuals)
    return number


def _change(client: Client, record: BodyRecord, link: int, shape: int, fields: dict[str, Any]) -> None:
    if shape >= -1:
        for name, value in fields.items():
            client.scene.world.render_shapes.change_later(record.body, link + 1, shape, name, value)


START.later(partial(replace_settings, "setDebugObjectColor"), "setDebugObjectColor")
START.later(replace_appearance, "changeVisualShape", "resetVisualShapeData")
