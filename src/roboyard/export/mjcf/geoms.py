"""Visual and collision shapes as geoms."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import (
    RGBA,
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Heightfield,
    Link,
    Material,
    Mesh,
    Plane,
    Sphere,
    Visual,
)
from roboyard.export.geometry import DEFAULT_RGBA, face_areas, faces_by_color, stem, submesh
from roboyard.export.images import material_pixels
from roboyard.export.mjcf.assets import Assets
from roboyard.export.mjcf.xml import add, pose
from roboyard.shapes.convex.hulls import convex_hull
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import STL_MAX_FACES
from roboyard.transforms import multiply, quaternion_from_axis_angle, rotate

MAX_COLORS = 16
"""Colours of one mesh that become geoms of their own; the rest share their mean."""
HALF_SPACE = 100.0
"""m: half size of the box that stands in for a plane, which MuJoCo allows on fixed bodies only."""
DEFAULT_FRICTION = (1.0, 0.005, 0.0001)


def add_visuals(body: ET.Element, link: Link, assets: Assets, notes: list[str]) -> None:
    """Add the link's visual shapes."""
    for visual in link.visuals:
        placed = pose(visual.origin.position, visual.origin.quaternion)
        if isinstance(visual.geometry, Mesh):
            if not _add_visual_mesh(body, link, visual, assets, placed):
                notes.append(f'link "{link.name}": a visual mesh has no file or no size; skipped')
            continue
        shape = _primitive(visual.geometry, visual)
        if shape is None:
            notes.append(f'link "{link.name}": a visual shape has no size or no place in MJCF; skipped')
            continue
        rgba = visual.material.rgba if visual.material and visual.material.rgba else DEFAULT_RGBA
        name = visual.material.name if visual.material else None
        add(body, "geom", class_="visual", material=assets.material(rgba, None, name), **shape)


def _add_visual_mesh(
    body: ET.Element, link: Link, visual: Visual, assets: Assets, placed: dict[str, Any]
) -> bool:
    assert isinstance(visual.geometry, Mesh)
    mesh = geometry_mesh(visual.geometry)
    if mesh is None:
        return False
    name = f"{link.name}_{stem(visual.name, visual.geometry)}"
    added = False
    for part, material in _parts(mesh, visual.material, name, assets):
        asset = assets.mesh(part, name, solid=False)
        if asset is not None and face_areas(part).sum() > 0:
            add(body, "geom", class_="visual", type="mesh", mesh=asset, material=material, **placed)
            added = True
    return added


def _parts(
    mesh: TriangleMesh, material: Material | None, name: str, assets: Assets
) -> list[tuple[TriangleMesh, str]]:
    """Pieces of one colour with the names of their materials."""
    rgba = material.rgba if material is not None else None
    label = material.name if material is not None else None
    pixels = material_pixels(material) if material is not None else None
    if pixels is None and rgba is None:
        pixels = mesh.texture
    if pixels is not None and mesh.uv is not None:
        texture = assets.texture(pixels, name)
        return [(mesh, assets.material(rgba or (1.0, 1.0, 1.0, 1.0), texture, label))]
    if mesh.uv is not None:
        mesh = replace(mesh, uv=None)
    if rgba is not None:
        return _pieces(mesh, assets.material(rgba, None, label))
    groups = faces_by_color(mesh)
    if not groups:
        return _pieces(mesh, assets.material(DEFAULT_RGBA, None, label))
    if len(groups) == 1:
        return _pieces(mesh, assets.material(groups[0][0], None, None))
    if len(groups) > MAX_COLORS:
        rest = np.concatenate([faces for _, faces in groups[MAX_COLORS - 1 :]])
        groups = [*groups[: MAX_COLORS - 1], (_mean_color(mesh, rest), rest)]
    return [
        piece
        for color, faces in groups
        for piece in _pieces(submesh(mesh, faces), assets.material(color, None, None))
    ]


def _pieces(mesh: TriangleMesh, material: str) -> list[tuple[TriangleMesh, str]]:
    """Return a mesh in pieces that fit into an STL file each, which is small and quick to read beside an
    OBJ.
    """
    count = -(-len(mesh.faces) // STL_MAX_FACES)
    if count <= 1:
        return [(mesh, material)]
    return [(submesh(mesh, faces), material) for faces in np.array_split(np.arange(len(mesh.faces)), count)]


def _mean_color(mesh: TriangleMesh, faces: np.ndarray) -> RGBA:
    assert mesh.colors is not None
    weight = face_areas(mesh)[faces]
    total = float(weight.sum())
    colors = mesh.colors[faces] / 255.0
    mean = weight @ colors / total if total > 0 else colors.mean(axis=0)
    r, g, b, a = (round(float(v), 4) for v in mean)
    return (r, g, b, a)


def add_collisions(
    body: ET.Element, link: Link, approximation: str, assets: Assets, notes: list[str]
) -> None:
    """Add the link's collision shapes, meshes as the approximation says."""
    for collision in link.collisions:
        surface = _surface(link.contact)
        if isinstance(collision.geometry, Mesh):
            shape = _collision_mesh(link, collision, approximation, assets)
        else:
            shape = _primitive(collision.geometry, collision)
        if shape is None:
            notes.append(f'link "{link.name}": a collision shape has no size or no file; skipped')
            continue
        add(body, "geom", class_="collision", **shape, **surface)


def _collision_mesh(
    link: Link, collision: Collision, approximation: str, assets: Assets
) -> dict[str, Any] | None:
    assert isinstance(collision.geometry, Mesh)
    mesh = geometry_mesh(collision.geometry)
    if mesh is None:
        return None
    origin = collision.origin
    if approximation in ("boundingSphere", "boundingCube"):
        points = mesh.vertices[np.unique(mesh.faces)]
        lower, upper = points.min(axis=0), points.max(axis=0)
        middle = (lower + upper) / 2
        placed = pose(origin.position + rotate(origin.quaternion, middle), origin.quaternion)
        if approximation == "boundingCube":
            return {"type": "box", "size": np.maximum((upper - lower) / 2, 1e-6), **placed}
        radius = float(np.linalg.norm(points - middle, axis=1).max())
        return {"type": "sphere", "size": radius, **placed} if radius > 0 else None
    hull = convex_hull(mesh, None).mesh
    asset = assets.mesh(hull, f"{link.name}_{stem(collision.name, collision.geometry)}_hull", solid=True)
    if asset is None:
        return None
    return {"type": "mesh", "mesh": asset, **pose(origin.position, origin.quaternion)}


def _primitive(geometry: Geometry, shape: Visual | Collision) -> dict[str, Any] | None:
    """Type, size and pose of a simple shape; None for one without size."""
    position = np.asarray(shape.origin.position, dtype=float)
    quaternion = np.asarray(shape.origin.quaternion, dtype=float)
    match geometry:
        case Box(size=size):
            kind, numbers = "box", np.asarray(size) / 2
        case Sphere(radius=radius):
            kind, numbers = "sphere", np.array([radius])
        case Cylinder(radius=radius, length=length):
            kind, numbers = "cylinder", np.array([radius, length / 2])
        case Capsule(radius=radius, length=length) if length > 0:
            kind, numbers = "capsule", np.array([radius, length / 2])
        case Capsule(radius=radius):
            kind, numbers = "sphere", np.array([radius])
        case Plane(normal=normal):
            kind, numbers = "box", np.full(3, HALF_SPACE)
            quaternion = multiply(quaternion, _turn_z_to(np.asarray(normal, dtype=float)))
            position = position - rotate(quaternion, np.array([0.0, 0.0, HALF_SPACE]))
        case Mesh() | Heightfield():
            return None
    if not (numbers > 0).all():
        return None
    return {"type": kind, "size": numbers, **pose(position, quaternion)}


def _turn_z_to(normal: np.ndarray) -> np.ndarray:
    unit = normal / np.linalg.norm(normal)
    axis = np.cross([0.0, 0.0, 1.0], unit)
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        axis, length = np.array([1.0, 0.0, 0.0]), 1.0
    return quaternion_from_axis_angle(axis / length, float(np.arccos(np.clip(unit[2], -1.0, 1.0))))


def _surface(contact: Contact | None) -> dict[str, Any]:
    if contact is None:
        return {}
    given = (contact.lateral_friction, contact.spinning_friction, contact.rolling_friction)
    if given == (None, None, None):
        return {}
    friction = [d if g is None else g for d, g in zip(DEFAULT_FRICTION, given, strict=True)]
    dimension = 6 if contact.rolling_friction else 4 if contact.spinning_friction else 3
    return {"friction": friction, "condim": dimension}
