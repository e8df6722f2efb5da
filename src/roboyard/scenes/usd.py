"""Read the geometry of a USD stage as static bodies.

| USD | here |
| --- | --- |
| child of the default prim (or of the root) | one body |
| Mesh, Cube, Sphere, Cylinder, Capsule, Cone | triangles in metres, z up |
| Plane | an infinite plane |
| displayColor, UsdPreviewSurface diffuseColor | colour, of subsets too |
| CollisionAPI (on the prim or above it) | a collision shape; with none on the stage, all geometry collides |
| approximation convexHull, boundingCube, boundingSphere | that shape |
| any other approximation, or none | convex parts of the mesh |
| purpose guide or proxy, invisible | not rendered |
| rigid bodies, joints, lights, point instances, curves | skipped, with a note |
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.model import (
    Box,
    Collision,
    Geometry,
    Link,
    Material,
    Mesh,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.description.usd.colliders import approximation_of, collider_of, is_shown
from roboyard.description.usd.gprims import axis_of, gprim_mesh, placed
from roboyard.description.usd.library import UsdGeom, UsdPhysics
from roboyard.description.usd.looks import color_of
from roboyard.description.usd.stage import open_stage
from roboyard.errors import DescriptionError
from roboyard.transforms import Array


def read_usd(path: Path) -> tuple[list[RobotDescription], tuple[str, ...]]:
    """Return descriptions of one link each, in metres and z up, and notes on skipped elements.

    Raises:
        MissingExtraError: OpenUSD is not installed.
        DescriptionError: the stage cannot be opened, refers to missing files or files outside its
            folders, or has no geometry.
    """
    opened = open_stage(path)
    stage, prims = opened.stage, opened.prims
    has_physics = any(p.HasAPI(UsdPhysics.CollisionAPI) for p in prims)
    xforms = UsdGeom.XformCache()
    found: dict[str, tuple[list[Visual], list[Collision]]] = {}
    skipped: Counter[str] = Counter()
    for prim in prims:
        kind = str(prim.GetTypeName())
        if prim.HasAPI(UsdPhysics.RigidBodyAPI):
            skipped["rigid body (made static)"] += 1
        if not prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.PointInstancer):
            if kind.startswith("Physics") and kind.endswith("Joint"):
                skipped[f"{kind} (all bodies are static)"] += 1
            elif kind.endswith("Light"):
                skipped[f"{kind} (cameras have their own light)"] += 1
            continue
        local = np.array(xforms.GetLocalToWorldTransform(prim)).T
        shape = _shape(prim, opened.T_world_stage @ local)
        if shape is None:
            skipped[f"{kind} (not read)"] += 1
            continue
        geometry, pose = shape
        visuals, collisions = found.setdefault(_owner(prim, stage), ([], []))
        is_seen = is_shown(prim)
        if is_seen:
            visuals.extend(_visuals(prim, geometry, pose))
        collider = collider_of(prim) if has_physics else (prim if is_seen else None)
        if collider is not None:
            approximation = approximation_of(prim)
            collisions.extend(
                Collision(geometry=g, origin=o) for g, o in _solids(geometry, pose, approximation)
            )
    if not found:
        raise DescriptionError(
            f"none of the {len(prims)} prims is a Mesh, Cube, Sphere, Cylinder, Capsule, Cone or Plane; "
            "is the default prim or a payload missing?",
            file=path,
        )
    descriptions = [
        RobotDescription(name=name, links=(Link(name="base", visuals=tuple(v), collisions=tuple(c)),))
        for name, (v, c) in found.items()
    ]
    return descriptions, tuple(f"skipped: {count} x {what}" for what, count in skipped.items())


def _owner(prim: Any, stage: Any) -> str:
    """Return the name of the body that a prim belongs to."""
    names = str(prim.GetPath()).strip("/").split("/")
    default = stage.GetDefaultPrim()
    inside = default and prim.GetPath().HasPrefix(default.GetPath()) and len(names) > 1
    return names[1] if inside else names[0]


# ------------------------------------------------------------------------------------------------- shapes


def _shape(prim: Any, T: Array) -> tuple[Geometry, Pose] | None:
    """Return geometry and pose in the world; None for an unsupported type."""
    kind = str(prim.GetTypeName())
    if kind == "Plane":
        normal = T[:3, :3] @ axis_of(prim)
        x, y, z = (float(v) for v in normal / np.linalg.norm(normal))
        a, b, c = (float(v) for v in T[:3, 3])
        return Plane(normal=(x, y, z)), Pose(position=(a, b, c))
    made = gprim_mesh(prim)
    mesh = None if made is None else placed(made, T)
    return None if mesh is None else (Mesh(uri=str(prim.GetPath()), path=None, data=mesh), Pose())


# ------------------------------------------------------------------------------------------------- colours


def _visuals(prim: Any, geometry: Geometry, pose: Pose) -> list[Visual]:
    if isinstance(geometry, Mesh) and geometry.data is not None and geometry.data.colors is not None:
        return [Visual(geometry=geometry, origin=pose)]
    return [Visual(geometry=geometry, origin=pose, material=Material(rgba=color_of(prim)))]


# ------------------------------------------------------------------------------------------------- solids


def _solids(geometry: Geometry, pose: Pose, approximation: str) -> list[tuple[Geometry, Pose]]:
    """Return the convex collision shapes of one shape."""
    if not isinstance(geometry, Mesh) or geometry.data is None:
        return [(geometry, pose)]
    mesh = geometry.data
    low, high = mesh.bounds
    middle, size = (low + high) / 2, np.maximum(high - low, 1e-4)
    x, y, z = (float(v) for v in middle)
    at = Pose(position=(x, y, z))
    if approximation == "boundingCube":
        return [(Box(size=(float(size[0]), float(size[1]), float(size[2]))), at)]
    if approximation == "boundingSphere":
        reach = float(np.linalg.norm(mesh.vertices - middle, axis=1).max())
        return [(Sphere(radius=reach), at)]
    if approximation == "convexHull":
        return [(geometry, pose)]
    from roboyard.shapes.convex.decomposition import decompose

    parts = decompose(mesh, "split", hull_count=32)
    return [(Mesh(uri=geometry.uri, path=None, data=hull), pose) for hull in parts.hulls]
