"""Shapes of links as gprims; meshes once each, as classes that the links refer to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Plane,
    Pose,
    Sphere,
)
from roboyard.export.geometry import face_normals, faces_by_color
from roboyard.export.names import free_name, identifier
from roboyard.export.usd.library import Gf, Sdf, Usd, UsdGeom, Vt
from roboyard.export.usd.values import place
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import (
    matrix_from_quaternion,
    quaternion_from_axis_angle,
    quaternion_from_matrix,
)

SUBSET_FAMILY = "materialBind"
MAX_SUBSETS = 64
"""Meshes of more colours than this carry them as a primvar."""


@dataclass(kw_only=True, eq=False)
class MeshPrototypes:
    """Mesh prims under `/visuals` and `/colliders`, one for each distinct mesh."""

    stage: Any
    layer: Any
    """Sublayer of the stage that holds them."""
    made: dict[tuple[Any, ...], tuple[str, TriangleMesh]] = field(default_factory=dict)
    names: dict[str, set[str]] = field(default_factory=dict)

    def master(self, mesh: TriangleMesh, key: Any, scope: str, link: str, name: str, *, colored: bool) -> str:
        """Path of the class prim for a mesh; a mesh seen before keeps the one it has.

        Args:
            mesh: the triangles, scale applied.
            key: equal for equal meshes.
            scope: `visuals` or `colliders`.
            link: prim name of the link.
            name: what to call it.
            colored: visual, with normals, texture coordinates and the faces' colours as subsets.
        """
        identity = (scope, colored, key)
        if identity not in self.made:
            used = self.names.setdefault(f"{scope}/{link}", set())
            chosen = free_name(name, used)
            used.add(chosen)
            path = f"/{scope}/{link}/{chosen}"
            with Usd.EditContext(self.stage, self.layer):
                self._parents(scope, link)
                _define_mesh(self.stage, path, mesh, colored=colored, visual=scope == "visuals")
            self.made[identity] = (path, mesh)
        return self.made[identity][0]

    def _parents(self, scope: str, link: str) -> None:
        for path, kind in ((f"/{scope}", "Scope"), (f"/{scope}/{link}", "Xform")):
            if not self.stage.GetPrimAtPath(path):
                self.stage.CreateClassPrim(path).SetTypeName(kind)


@dataclass(frozen=True, kw_only=True, slots=True)
class Placed:
    """A shape on the stage."""

    prim: Any
    mesh: TriangleMesh | None
    """Its triangles where it is a mesh."""


def add_shape(
    masters: MeshPrototypes,
    geometry: Geometry,
    origin: Pose,
    path: str,
    scope: str,
    link: str,
    *,
    colored: bool,
) -> Placed | None:
    """Define one shape; None for a geometry that a stage cannot hold."""
    stage = masters.stage
    scale, quaternion = (1.0, 1.0, 1.0), np.asarray(origin.quaternion)
    mesh = None
    match geometry:
        case Box(size=size):
            shape, scale = UsdGeom.Cube.Define(stage, path), size
            shape.CreateSizeAttr(1.0)
        case Sphere(radius=radius):
            shape = UsdGeom.Sphere.Define(stage, path)
            shape.CreateRadiusAttr(radius)
        case Cylinder(radius=radius, length=length):
            shape = UsdGeom.Cylinder.Define(stage, path)
            shape.CreateRadiusAttr(radius)
            shape.CreateHeightAttr(length)
            shape.CreateAxisAttr(UsdGeom.Tokens.z)
        case Capsule(radius=radius, length=length):
            shape = UsdGeom.Capsule.Define(stage, path)
            shape.CreateRadiusAttr(radius)
            shape.CreateHeightAttr(length)
            shape.CreateAxisAttr(UsdGeom.Tokens.z)
        case Mesh():
            mesh = geometry_mesh(geometry)
            if mesh is None:
                return None
            key = (
                id(geometry.data) if geometry.data is not None else str(geometry.path),
                geometry.scale,
            )
            master = masters.master(mesh, key, scope, link, path.rpartition("/")[2], colored=colored)
            shape = UsdGeom.Mesh.Define(stage, path)
            shape.GetPrim().GetReferences().AddInternalReference(Sdf.Path(master))
        case Plane(normal=normal):
            shape = UsdGeom.Plane.Define(stage, path)
            token, turn = frame_to(normal)
            shape.CreateAxisAttr(token)
            turned = matrix_from_quaternion(origin.quaternion) @ matrix_from_quaternion(turn)
            quaternion = quaternion_from_matrix(turned)
        case Heightfield():
            return None
    prim = shape.GetPrim()
    if mesh is None:
        extent = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), Usd.TimeCode.Default())
        shape.CreateExtentAttr(extent)
    place(prim, origin.position, quaternion, scale)
    return Placed(prim=prim, mesh=mesh)


def _define_mesh(stage: Any, path: str, mesh: TriangleMesh, *, colored: bool, visual: bool) -> None:
    prim = stage.CreateClassPrim(path)
    prim.SetTypeName("Mesh")
    shape = UsdGeom.Mesh(prim)
    _write_triangles(shape, mesh)
    if not visual:
        return
    shape.CreateDoubleSidedAttr(True)
    if mesh.uv is not None:
        uv = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
        )
        uv.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(mesh.uv, np.float32)))
    if colored:
        _write_colors(shape, mesh)


def _write_triangles(shape: Any, mesh: TriangleMesh) -> None:
    """Author points, faces, extent and normals: the mesh's own, else those of its faces."""
    shape.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.vertices, np.float32)))
    shape.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(mesh.faces), 3, np.int32)))
    shape.CreateFaceVertexIndicesAttr(
        Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.faces, np.int32).ravel())
    )
    normals, interpolation = mesh.normals, UsdGeom.Tokens.vertex
    if normals is None:
        normals, interpolation = face_normals(mesh), UsdGeom.Tokens.uniform
    shape.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(normals, np.float32)))
    shape.SetNormalsInterpolation(interpolation)
    shape.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    shape.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(shape.GetPointsAttr().Get()))


def _write_colors(shape: Any, mesh: TriangleMesh) -> None:
    groups = faces_by_color(mesh)
    if len(groups) > MAX_SUBSETS:
        assert mesh.colors is not None
        rgb = np.ascontiguousarray(mesh.colors[:, :3] / 255.0, np.float32)
        shape.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform).Set(Vt.Vec3fArray.FromNumpy(rgb))
        return
    if len(groups) < 2:
        return
    for number, (_, faces) in enumerate(groups):
        UsdGeom.Subset.CreateGeomSubset(
            shape,
            subset_name(number),
            UsdGeom.Tokens.face,
            Vt.IntArray.FromNumpy(faces.astype(np.int32)),
            SUBSET_FAMILY,
        )
    UsdGeom.Subset.SetFamilyType(shape, SUBSET_FAMILY, UsdGeom.Tokens.partition)


def subset_name(number: int) -> str:
    """Prim name of the faces of a mesh's n-th colour."""
    return f"color_{number}"


def shape_names(names: list[str]) -> list[str]:
    """A distinct prim name that starts with a letter for each of a link's shapes, in order."""
    used: set[str] = set()
    chosen = []
    for name in names:
        text = identifier(name, "shape")
        free = free_name(text if text[0].isalpha() else f"shape{text}", used)
        used.add(free)
        chosen.append(free)
    return chosen


def frame_to(axis: tuple[float, float, float]) -> tuple[str, np.ndarray]:
    """Axis token and quaternion (x, y, z, w) of a frame whose token axis is the given unit axis."""
    vector = np.asarray(axis, dtype=float)
    k = int(np.argmax(np.abs(vector)))
    token = "XYZ"[k]
    unit = np.eye(3)[k]
    if vector[k] > 1 - 1e-12:
        return token, np.array([0.0, 0.0, 0.0, 1.0])
    if vector[k] < -1 + 1e-12:
        return token, quaternion_from_axis_angle(np.eye(3)[(k + 1) % 3], np.pi)
    turn = Gf.Rotation(Gf.Vec3d(*unit.tolist()), Gf.Vec3d(*vector.tolist())).GetQuat()
    x, y, z = turn.GetImaginary()
    return token, np.array([x, y, z, turn.GetReal()])
