"""The meshes of a robot's links in their link frames, and where to find robots; for the shape benchmarks."""

from __future__ import annotations

import importlib.util
import site
import sysconfig
from pathlib import Path

import numpy as np

from roboyard.description import load_description
from roboyard.description.model import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere, Visual
from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh, scaled
from roboyard.shapes.mesh import TriangleMesh

EXAMPLES = "cmeel.prefix/share/example-robot-data/robots"


def find_robots() -> dict[str, Path]:
    """URDFs of installed robot packages, else the bundled robots."""
    found: dict[str, Path] = {}
    spec = importlib.util.find_spec("pybullet_data")
    if spec is not None and spec.origin is not None:
        folder = Path(spec.origin).parent
        found["panda"] = folder / "franka_panda/panda.urdf"
        found["kuka"] = folder / "kuka_iiwa/model.urdf"
        found["laikago"] = folder / "laikago/laikago.urdf"
    for robots in (Path(folder) / EXAMPLES for folder in site_folders()):
        if robots.is_dir():
            found["tiago"] = robots / "tiago_description/robots/tiago.urdf"
            found["ur5"] = robots / "ur_description/urdf/ur5_robot.urdf"
    found = {name: path for name, path in found.items() if path.exists()}
    if found:
        return found
    assets = Path(primitives.__file__).parents[1] / "assets"
    return {path.parent.name: path for path in sorted(assets.glob("*/*.urdf"))}


def site_folders() -> list[str]:
    return [sysconfig.get_paths()["purelib"], *site.getsitepackages()]


def link_meshes(urdf: Path, kind: str = "collision") -> dict[str, list[TriangleMesh]]:
    """Meshes of each link that has any; `kind` is "collision" or "visual"."""
    robot = load_description(urdf, missing_meshes="note")
    out: dict[str, list[TriangleMesh]] = {}
    for link in robot.links:
        shapes = link.collisions if kind == "collision" else link.visuals
        meshes = [mesh for shape in shapes if (mesh := placed(shape)) is not None]
        if meshes:
            out[link.name] = meshes
    return out


def placed(shape: Collision | Visual) -> TriangleMesh | None:
    """The shape's triangles in the link frame; None where there are none."""
    mesh = mesh_of(shape.geometry)
    if mesh is None:
        return None
    pose = shape.origin.matrix()
    vertices = np.ascontiguousarray(mesh.vertices @ pose[:3, :3].T + pose[:3, 3])
    return TriangleMesh(vertices=vertices, faces=mesh.faces)


def mesh_of(geometry: Geometry) -> TriangleMesh | None:
    if isinstance(geometry, Mesh):
        return None if geometry.path is None else scaled(load_mesh(geometry.path), geometry.scale)
    if isinstance(geometry, Box):
        return primitives.box(*(0.5 * np.array(geometry.size)))
    if isinstance(geometry, Sphere):
        return primitives.sphere(geometry.radius)
    if isinstance(geometry, Cylinder):
        return primitives.cylinder(geometry.radius, geometry.length)
    if isinstance(geometry, Capsule):
        return primitives.capsule(geometry.radius, geometry.length)
    return None
