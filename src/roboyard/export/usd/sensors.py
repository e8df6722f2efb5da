"""Cameras, lidars and end-effector markers on their links."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.export.names import free_name, identifier
from roboyard.export.usd.geometry import MeshPrototypes
from roboyard.export.usd.library import Gf, Sdf, UsdGeom, Vt
from roboyard.export.usd.naming import Paths
from roboyard.export.usd.values import place, set_attribute
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

FOCAL_LENGTH = 17.0
"""Tenths of a stage unit, beside USD's default aperture of 20.955 x 15.2908."""
CLIPPING = (0.001, 1e6)
"""m"""
MARKER_RADIUS = 0.005
"""m"""
PRIM_NAMES = {"camera": "Camera", "lidar": "Lidar", "visual_sphere": "VisualSphere"}
_LIDAR = {
    "minRange": 0.4,
    "maxRange": 100.0,
    "horizontalFov": 360.0,
    "verticalFov": 30.0,
    "horizontalResolution": 0.4,
    "verticalResolution": 4.0,
    "rotationRate": 0.0,
    "yawOffset": 0.0,
}
"""m and degrees; rotation rate 0: all rays in every step."""
_LIDAR_FLAGS = ("highLod", "drawPoints", "drawLines", "enableSemantics")


def add_sensors(stage: Any, robot: RobotModel, paths: Paths, masters: MeshPrototypes) -> None:
    """Define every sensor as a direct child of its link."""
    for sensor in robot.sensors:
        link = stage.GetPrimAtPath(paths.link(sensor.link))
        used = {child.GetName() for child in link.GetAllChildren()}
        name = identifier(sensor.name or PRIM_NAMES[sensor.kind], PRIM_NAMES[sensor.kind])
        path = f"{paths.link(sensor.link)}/{free_name(name, used)}"
        if sensor.kind == "visual_sphere":
            prim = _marker(masters, path, paths.links[sensor.link])
        else:
            prim = (_camera if sensor.kind == "camera" else _lidar)(stage, path)
        place(prim, sensor.offset.position, sensor.offset.quaternion)


def _camera(stage: Any, path: str) -> Any:
    camera = UsdGeom.Camera.Define(stage, path)
    camera.CreateFocalLengthAttr(FOCAL_LENGTH)
    camera.CreateClippingRangeAttr(Gf.Vec2f(*CLIPPING))
    return camera.GetPrim()


def _lidar(stage: Any, path: str) -> Any:
    prim = stage.DefinePrim(path, "Lidar")
    for name, value in _LIDAR.items():
        set_attribute(prim, name, Sdf.ValueTypeNames.Float, value)
    for name in _LIDAR_FLAGS:
        set_attribute(prim, name, Sdf.ValueTypeNames.Bool, False)
    return prim


def _marker(masters: MeshPrototypes, path: str, link: str) -> Any:
    master = masters.master(_ball(), "marker", "visuals", link, "VisualSphere", colored=False)
    mesh = UsdGeom.Mesh.Define(masters.stage, path)
    mesh.GetPrim().GetReferences().AddInternalReference(Sdf.Path(master))
    mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.constant).Set(Vt.Vec3fArray([Gf.Vec3f(0.9, 0.1, 0.1)]))
    return mesh.GetPrim()


def _ball() -> TriangleMesh:
    """A sphere whose vertices are shared across the seam of its texture."""
    ball = primitives.sphere(MARKER_RADIUS, 16)
    _, first, index = np.unique(ball.vertices.round(9), axis=0, return_index=True, return_inverse=True)
    return TriangleMesh(
        vertices=ball.vertices[first],
        faces=index.ravel()[ball.faces].astype(np.int32),
        normals=ball.vertices[first] / MARKER_RADIUS,
    )
