"""The geometric prims of a body as visual and collision shapes.

| USD | description |
| --- | --- |
| Cube, Sphere, Cylinder, Capsule; equally scaled across | box, sphere, cylinder, capsule |
| Mesh, Cone, solids scaled unequally | mesh; its file is in the cache folder |
| Plane | plane |
| CollisionAPI on the prim or above it, enabled | collision; its purpose and visibility do not matter |
| anything rendered: visible, no guide, no proxy | visual |
| approximation boundingCube, boundingSphere; sdf, meshSimplification | box, sphere; concave |
| point instances, curves, points | omitted with a note |
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.geometry import pose_from_matrix
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Material,
    Mesh,
    Plane,
    Pose,
    Sphere,
    Vector3,
    Visual,
)
from roboyard.description.usd.colliders import approximation_of, collider_of, is_shown
from roboyard.description.usd.frames import Frames
from roboyard.description.usd.gprims import axis_of, gprim_mesh, gprim_size, placed, turn_to_axis
from roboyard.description.usd.library import UsdGeom
from roboyard.description.usd.looks import color_of, material_name
from roboyard.description.usd.mesh_store import stored_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array

ALIKE = 1e-5
"""Share by which scales may differ and still count as equal: they are often in single precision."""
Placed = tuple[Geometry, Pose]


@dataclass(kw_only=True, eq=False)
class BodyShapes:
    """Shapes of one body."""

    visuals: list[Visual] = field(default_factory=list)
    collisions: list[Collision] = field(default_factory=list)
    solids: list[tuple[Any, Placed]] = field(default_factory=list)
    """Collider and shape, for the body's mass."""


@dataclass(kw_only=True)
class ShapeReader:
    """Makes the shapes of one stage."""

    frames: Frames
    notes: list[str]

    def add(self, shapes: BodyShapes, prim: Any, body: Any) -> None:
        """Add a geometric prim to the shapes of its body, in the frame of the body."""
        shown, collider = is_shown(prim), collider_of(prim, below=body)
        if not shown and collider is None:
            return
        T = np.linalg.inv(self.frames.rigid(body)) @ self.frames.affine(prim)
        shape = self._shape(prim, T, textured=shown and collider is None)
        if shape is None:
            self.notes.append(f"{prim.GetTypeName()} prims are omitted: a robot description has none")
            return
        name = str(prim.GetName())
        if shown:
            shapes.visuals.append(self._visual(prim, shape, name))
        if collider is None:
            return
        kind = approximation_of(prim)
        kind = approximation_of(collider) if kind == "none" else kind
        geometry, origin = _approximated(shape, kind)
        concave = isinstance(geometry, Mesh) and kind in ("sdf", "meshSimplification")
        shapes.collisions.append(Collision(geometry=geometry, origin=origin, name=name, concave=concave))
        shapes.solids.append((collider, shape))

    def _visual(self, prim: Any, shape: Placed, name: str) -> Visual:
        geometry, origin = shape
        mesh = geometry.data if isinstance(geometry, Mesh) else None
        if mesh is not None and (mesh.colors is not None or mesh.texture is not None):
            return Visual(geometry=geometry, origin=origin, name=name)
        material = Material(name=material_name(prim), rgba=color_of(prim))
        return Visual(geometry=geometry, origin=origin, name=name, material=material)

    def _shape(self, prim: Any, T: Array, *, textured: bool) -> Placed | None:
        """Return a prim's shape, with its pose; `T` (4, 4) leads from its coordinates to the body (m)."""
        if str(prim.GetTypeName()) == "Plane":
            x, y, z = (float(v) for v in axis_of(prim))
            rigid, _ = _rigid_and_scale(T)
            return Plane(normal=(x, y, z)), pose_from_matrix(rigid)
        exact = _primitive(prim, T)
        if exact is not None:
            return exact
        mesh = gprim_mesh(prim, textured=textured)
        if mesh is None or not len(mesh.faces):
            return None
        rigid, rest = _rigid_and_scale(T)
        own = placed(mesh, rest)
        file = stored_mesh(own, str(prim.GetName()))
        return Mesh(uri=str(file), path=file, data=own), pose_from_matrix(rigid)


def _primitive(prim: Any, T: Array) -> Placed | None:
    """Return a solid that a description holds exactly; None for others and where it is scaled unequally."""
    size, kind = gprim_size(prim), str(prim.GetTypeName())
    if size is None or kind == "Cone" or not all(np.isfinite(size)):
        return None
    if kind in ("Cylinder", "Capsule"):
        T = T @ turn_to_axis(prim)
    rigid, rest = _rigid_and_scale(T)
    scale = np.diag(rest)[:3]
    if np.abs(rest[:3, :3] - np.diag(scale)).max() > ALIKE * np.abs(scale).max():
        return None
    sx, sy, sz = (float(value) for value in np.abs(scale))
    pose, round_ = pose_from_matrix(rigid), abs(sx - sy) <= ALIKE * max(sx, sy)
    if kind == "Cube":
        return Box(size=(size[0] * sx, size[0] * sy, size[0] * sz)), pose
    if kind == "Sphere" and round_ and abs(sx - sz) <= ALIKE * max(sx, sz):
        return Sphere(radius=size[0] * sx), pose
    if kind == "Cylinder" and round_:
        return Cylinder(radius=size[0] * sx, length=size[1] * sz), pose
    if kind == "Capsule" and round_ and abs(sx - sz) <= ALIKE * max(sx, sz):
        return Capsule(radius=size[0] * sx, length=size[1] * sz), pose
    return None


def _rigid_and_scale(T: Array) -> tuple[Array, Array]:
    """Split an affine (4, 4) transform into a rigid one and what is applied before: scale, shear, mirror."""
    rigid = np.eye(4)
    columns = T[:3, :3] / np.linalg.norm(T[:3, :3], axis=0)
    if np.linalg.det(columns) < 0:
        columns = columns * (1.0, 1.0, -1.0)
    u, _, v = np.linalg.svd(columns)
    turn = u @ v
    rigid[:3, :3] = columns if np.abs(columns - turn).max() < 1e-12 else turn
    rigid[:3, 3] = T[:3, 3]
    rest = np.eye(4)
    rest[:3, :3] = rigid[:3, :3].T @ T[:3, :3]
    return rigid, rest


def _approximated(shape: Placed, kind: str) -> Placed:
    """Return the shape that a mesh collides as."""
    geometry, pose = shape
    if not isinstance(geometry, Mesh) or geometry.data is None:
        return shape
    mesh: TriangleMesh = geometry.data
    low, high = mesh.bounds
    middle = (low + high) / 2
    moved = np.eye(4)
    moved[:3, 3] = middle
    at = pose_from_matrix(pose.matrix() @ moved)
    if kind == "boundingCube":
        x, y, z = (float(value) for value in np.maximum(high - low, 1e-4))
        size: Vector3 = (x, y, z)
        return Box(size=size), at
    if kind == "boundingSphere":
        return Sphere(radius=float(np.linalg.norm(mesh.vertices - middle, axis=1).max())), at
    return shape


def is_geometry(prim: Any) -> bool:
    """Return whether a prim is a shape, or something else that is seen."""
    return bool(prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer))
