"""The geoms of an MJCF model as visual and collision shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.geometry import capsule_like, pose_from_matrix
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Material,
    Mesh,
    Plane,
    Sphere,
    Visual,
)
from roboyard.transforms import Array, from_wxyz, matrix_from_quaternion

SHOWN_GROUPS = (0, 1, 2)
"""Groups of geoms that MuJoCo's viewer shows at first."""
_KINDS = ("plane", "height field", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")


@dataclass(kw_only=True)
class ShapeBuilder:
    """Makes the shapes of the links of one model."""

    model: Any
    spec: Any
    file: Path
    textures: dict[str, Path | None]
    """Materials with textures, and the image of each (see `description.mjcf.textures`)."""
    notes: list[str]

    def of(self, body: int, shift: Array) -> tuple[tuple[Visual, ...], tuple[Collision, ...]]:
        """Return the visuals and collisions of a body whose link frame is at `shift` (3,) in it (m)."""
        model = self.model
        visuals, collisions = [], []
        start = int(model.body_geomadr[body])
        for g in range(start, start + int(model.body_geomnum[body])):
            shape = self._shape(g)
            if shape is None:
                continue
            geometry, T_body_shape = shape
            T_body_shape[:3, 3] -= shift
            origin, name = pose_from_matrix(T_body_shape), model.geom(g).name or None
            collides = bool(model.geom_contype[g] or model.geom_conaffinity[g])
            if collides:
                collisions.append(Collision(geometry=geometry, origin=origin, name=name))
            if model.geom_group[g] in SHOWN_GROUPS:
                visuals.append(
                    Visual(geometry=geometry, origin=origin, name=name, material=self._material(g, geometry))
                )
        return tuple(visuals), tuple(collisions)

    def _shape(self, g: int) -> tuple[Geometry, Array] | None:
        """Return a geom's shape and its (4, 4) pose in the body."""
        model = self.model
        pose = np.eye(4)
        pose[:3, :3] = matrix_from_quaternion(from_wxyz(model.geom_quat[g]))
        pose[:3, 3] = model.geom_pos[g]
        x, y, z = map(float, model.geom_size[g])
        match _KINDS[int(model.geom_type[g])]:
            case "plane":
                return Plane(), pose
            case "sphere":
                return Sphere(radius=x), pose
            case "capsule":
                return Capsule(radius=x, length=2 * y), pose
            case "cylinder":
                return Cylinder(radius=x, length=2 * y), pose
            case "box":
                return Box(size=(2 * x, 2 * y, 2 * z)), pose
            case "ellipsoid":
                return self._ellipsoid((x, y, z), pose)
            case "mesh":
                return self._mesh(g, pose)
            case kind:
                self.notes.append(f"a geom that is a {kind} is omitted: a robot description has none")
                return None

    def _ellipsoid(self, radii: tuple[float, float, float], pose: Array) -> tuple[Geometry, Array]:
        """Return the capsule along the longest axis with the mean radius of the other two."""
        self.notes.append("ellipsoids are written as capsules of the same length")
        shape, turn = capsule_like(radii)
        return shape, pose @ turn

    def _mesh(self, g: int, pose: Array) -> tuple[Geometry, Array] | None:
        """Return the mesh file; MuJoCo moves vertices to the mesh's centre of mass, which is undone."""
        model = self.model
        m = int(model.geom_dataid[g])
        name = model.mesh(m).name
        element = next((mesh for mesh in self.spec.meshes if mesh.name == name), None)
        path = None if element is None else self._file_of(element)
        if path is None:
            self.notes.append(f"mesh {name!r} is omitted: it has no file of its own")
            return None
        moved = np.eye(4)
        moved[:3, :3] = matrix_from_quaternion(from_wxyz(model.mesh_quat[m]))
        moved[:3, 3] = model.mesh_pos[m]
        scale = (float(model.mesh_scale[m, 0]), float(model.mesh_scale[m, 1]), float(model.mesh_scale[m, 2]))
        return Mesh(uri=self._uri(path), path=path, scale=scale), pose @ np.linalg.inv(moved)

    def _uri(self, path: Path) -> str:
        """Return the path from the model's folder, where the file is below it."""
        folder = self.file.absolute().parent
        return (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()

    def _file_of(self, element: Any) -> Path | None:
        """Return the file of a mesh whose vertices are used as they are in it."""
        if not element.file:
            return None
        folder = self.file.absolute().parent
        names = (element.file, Path(element.file).name)  # the second with `strippath`
        places = (base / name for name in names for base in (folder / self.spec.compiler.meshdir, folder))
        found = next((place for place in places if place.is_file()), None)
        if found is None:
            return None
        plain = np.allclose(element.refpos, 0) and np.allclose(element.refquat, (1, 0, 0, 0))
        if not plain:
            self.notes.append(f"mesh {element.name!r} has a reference pose, which is not used")
        return found

    def _material(self, g: int, geometry: Geometry) -> Material | None:
        model = self.model
        m = int(model.geom_matid[g])
        rgba = model.mat_rgba[m] if m >= 0 else model.geom_rgba[g]
        name = model.mat(m).name if m >= 0 else ""
        image = self.textures.get(name) if isinstance(geometry, Mesh) else None
        if name in self.textures and image is None:
            self.notes.append(
                "textures that are not flat images on meshes are omitted; their colours are kept"
            )
        r, green, b, a = map(float, rgba)
        return Material(
            name=name or None,
            rgba=(r, green, b, a),
            texture=image,
            texture_uri=None if image is None else self._uri(image),
        )
