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
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.description.files.usd_layers import check_layers
from roboyard.description.model import (
    RGBA,
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
from roboyard.errors import DescriptionError, MissingExtraError
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array

GREY: RGBA = (0.7, 0.7, 0.7, 1.0)
SEGMENTS = 48


def read_usd(path: Path) -> tuple[list[RobotDescription], tuple[str, ...]]:
    """Return descriptions of one link each, in metres and z up, and notes on skipped elements.

    Raises:
        MissingExtraError: OpenUSD is not installed.
        DescriptionError: the stage cannot be opened, refers to missing files or files outside its
            folders, or has no geometry.
    """
    try:
        Tf, Usd, UsdGeom = (import_module(f"pxr.{name}") for name in ("Tf", "Usd", "UsdGeom"))
        UsdPhysics = import_module("pxr.UsdPhysics")
    except ImportError:
        raise MissingExtraError("OpenUSD", "usd", "reading USD scenes") from None
    check_layers(path)
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise DescriptionError(f"OpenUSD cannot read it: {_first_line(error)}", file=path) from None
    errors = [" ".join(str(e).split()) for e in stage.GetCompositionErrors()]
    if errors:
        raise DescriptionError(f"the stage does not compose: {errors[0]}", file=path)
    T_world_stage = _to_metres_z_up(stage, UsdGeom)
    prims = [p for p in stage.Traverse(Usd.TraverseInstanceProxies()) if p.IsActive()]
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
        imageable = UsdGeom.Imageable(prim)
        local = np.array(xforms.GetLocalToWorldTransform(prim)).T
        shape = _shape(prim, UsdGeom, T_world_stage @ local)
        if shape is None:
            skipped[f"{kind} (not read)"] += 1
            continue
        geometry, pose = shape
        visuals, collisions = found.setdefault(_owner(prim, stage), ([], []))
        is_invisible = imageable.ComputeVisibility() == UsdGeom.Tokens.invisible
        purpose = imageable.ComputePurpose()
        is_seen = not is_invisible and purpose not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)
        if is_seen:
            visuals.extend(_visuals(prim, geometry, pose, UsdGeom))
        collider = _collider(prim, UsdPhysics) if has_physics else (prim if is_seen else None)
        if collider is not None:
            approximation = _approximation(prim, UsdPhysics)
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


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else "unknown error"


def _to_metres_z_up(stage: Any, UsdGeom: Any) -> Array:
    out = np.eye(4)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        out[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    out[:3, :3] *= UsdGeom.GetStageMetersPerUnit(stage)
    return out


def _owner(prim: Any, stage: Any) -> str:
    """Return the name of the body that a prim belongs to."""
    names = str(prim.GetPath()).strip("/").split("/")
    default = stage.GetDefaultPrim()
    inside = default and prim.GetPath().HasPrefix(default.GetPath()) and len(names) > 1
    return names[1] if inside else names[0]


# ------------------------------------------------------------------------------------------------- shapes


def _shape(prim: Any, UsdGeom: Any, T: Array) -> tuple[Geometry, Pose] | None:
    """Return geometry and pose in the world; None for an unsupported type."""
    kind = str(prim.GetTypeName())
    if kind == "Plane":
        normal = T[:3, :3] @ _axis(prim, UsdGeom.Plane)
        x, y, z = (float(v) for v in normal / np.linalg.norm(normal))
        a, b, c = (float(v) for v in T[:3, 3])
        return Plane(normal=(x, y, z)), Pose(position=(a, b, c))
    if kind == "Mesh":
        mesh = _mesh(prim, UsdGeom, T)
    else:
        made = _primitive(prim, UsdGeom, kind)
        mesh = None if made is None else _placed(made, T)
    return None if mesh is None else (Mesh(uri=str(prim.GetPath()), path=None, data=mesh), Pose())


def _axis(prim: Any, schema: Any) -> Array:
    return np.eye(3)["XYZ".index(str(schema(prim).GetAxisAttr().Get()))]


def _primitive(prim: Any, UsdGeom: Any, kind: str) -> TriangleMesh | None:
    match kind:
        case "Cube":
            half = UsdGeom.Cube(prim).GetSizeAttr().Get() / 2
            return primitives.box(half, half, half)
        case "Sphere":
            return primitives.sphere(UsdGeom.Sphere(prim).GetRadiusAttr().Get(), SEGMENTS)
        case "Cylinder" | "Capsule" | "Cone":
            schema = getattr(UsdGeom, kind)
            radius, height = schema(prim).GetRadiusAttr().Get(), schema(prim).GetHeightAttr().Get()
            if kind == "Cylinder":
                mesh = primitives.cylinder(radius, height, SEGMENTS)
            elif kind == "Capsule":
                mesh = primitives.capsule(radius, height, SEGMENTS)
            else:
                from roboyard.scenes.revolve import revolve

                mesh = revolve([(0, -height / 2), (radius, -height / 2), (0, height / 2)], SEGMENTS)
            axis = int(np.argmax(_axis(prim, schema)))
            turn = np.eye(4)
            turn[:3, :3] = np.roll(np.eye(3), axis + 1, axis=0)  # maps z to the axis, keeps handedness
            return _placed(mesh, turn)
    return None


def _mesh(prim: Any, UsdGeom: Any, T: Array) -> TriangleMesh | None:
    schema = UsdGeom.Mesh(prim)
    points = np.array(schema.GetPointsAttr().Get() or [], dtype=float).reshape(-1, 3)
    counts = np.array(schema.GetFaceVertexCountsAttr().Get() or [], dtype=np.int64)
    corners = np.array(schema.GetFaceVertexIndicesAttr().Get() or [], dtype=np.int64)
    if not len(points) or not len(counts):
        return None
    path = prim.GetPath()
    fits = counts.min() >= 3 and counts.sum() == len(corners)
    if not fits or corners.min() < 0 or corners.max() >= len(points) or not np.isfinite(points).all():
        raise DescriptionError(
            f"mesh {path}: face counts, indices and points do not match; export the stage again",
            element=str(path),
        )
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    owner = np.repeat(np.arange(len(counts)), counts - 2)
    step = np.concatenate([np.arange(1, n - 1) for n in counts])
    faces = np.stack(
        [corners[starts[owner]], corners[starts[owner] + step], corners[starts[owner] + step + 1]], axis=1
    )
    if str(schema.GetOrientationAttr().Get()) == "leftHanded":
        faces = faces[:, ::-1]
    colors = _face_colors(prim, UsdGeom, len(counts))
    mesh = TriangleMesh(
        vertices=read_only(points, np.float64),
        faces=read_only(faces, np.int32),
        colors=None if colors is None else read_only(colors[owner], np.uint8),
    )
    return _placed(mesh, T)


def _placed(mesh: TriangleMesh, T: Array) -> TriangleMesh:
    """Return the mesh transformed by (4, 4) `T`."""
    vertices = mesh.vertices @ T[:3, :3].T + T[:3, 3]
    faces = mesh.faces[:, ::-1] if np.linalg.det(T[:3, :3]) < 0 else mesh.faces
    normals = None
    if mesh.normals is not None:
        normals = mesh.normals @ np.linalg.inv(T[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        normals = read_only(normals, np.float64)
    return TriangleMesh(
        vertices=read_only(vertices, np.float64),
        faces=read_only(faces, np.int32),
        normals=normals,
        colors=mesh.colors,
    )


# ------------------------------------------------------------------------------------------------- colours


def _visuals(prim: Any, geometry: Geometry, pose: Pose, UsdGeom: Any) -> list[Visual]:
    if isinstance(geometry, Mesh) and geometry.data is not None and geometry.data.colors is not None:
        return [Visual(geometry=geometry, origin=pose)]
    return [Visual(geometry=geometry, origin=pose, material=Material(rgba=_color(prim, UsdGeom)))]


def _color(prim: Any, UsdGeom: Any) -> RGBA:
    """Return the colour of the bound material, else the first display colour, else grey."""
    bound = _material_color(prim)
    if bound is not None:
        return bound
    shown = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
    values = shown.Get() if shown and shown.HasValue() else None
    if values:
        r, g, b = (float(v) for v in values[0])
        return (r, g, b, 1.0)
    return GREY


def _material_color(prim: Any) -> RGBA | None:
    UsdShade = import_module("pxr.UsdShade")
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    source = material.ComputeSurfaceSource()[0] if material else None
    if not source:
        return None
    diffuse = source.GetInput("diffuseColor")
    value = diffuse.Get() if diffuse else None
    if value is None:
        return None
    opacity = source.GetInput("opacity")
    alpha = opacity.Get() if opacity else None
    r, g, b = (float(v) for v in value)
    return (r, g, b, 1.0 if alpha is None else float(alpha))


def _face_colors(prim: Any, UsdGeom: Any, count: int) -> np.ndarray | None:
    """Return (count, 4) uint8 if faces differ: by subsets with materials, or one display colour per face."""
    subsets = [s for s in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim)) if s]
    colored = [(s, c) for s in subsets if (c := _material_color(s.GetPrim())) is not None]
    shown = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
    values = shown.Get() if shown and shown.HasValue() else None
    if colored:
        out = np.tile(np.array(_color(prim, UsdGeom)), (count, 1))
        for subset, color in colored:
            out[np.array(subset.GetIndicesAttr().Get(), dtype=np.int64)] = color
    elif values is not None and len(values) == count and str(shown.GetInterpolation()) == "uniform":
        out = np.column_stack([np.array(values, dtype=float), np.ones(count)])
    else:
        return None
    return np.round(255 * np.clip(out, 0, 1)).astype(np.uint8)


# ------------------------------------------------------------------------------------------------- solids


def _collider(prim: Any, UsdPhysics: Any) -> Any | None:
    """Return the prim whose CollisionAPI applies to this one; None if it does not collide."""
    above = prim
    while above and not above.IsPseudoRoot():
        if above.HasAPI(UsdPhysics.CollisionAPI):
            enabled = UsdPhysics.CollisionAPI(above).GetCollisionEnabledAttr().Get()
            return above if enabled is not False else None
        above = above.GetParent()
    return None


def _approximation(prim: Any, UsdPhysics: Any) -> str:
    if not prim.HasAPI(UsdPhysics.MeshCollisionAPI):
        return "none"
    return str(UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get())


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
