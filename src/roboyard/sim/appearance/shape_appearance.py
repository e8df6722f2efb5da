"""One visual shape of a link: a geometry with its material as a `RenderShape`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import (
    RGBA,
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Heightfield,
    Material,
    Mesh,
    Plane,
    Pose,
    Sphere,
)
from roboyard.rendering.scene import RenderShape
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import matrix_from_quaternion

DEFAULT_RGBA: RGBA = (0.7, 0.7, 0.7, 1.0)
PLANE_HALF_SIZE = 50.0
"""Half size (m) of the mesh of an infinite plane; cameras draw the rest up to the horizon."""
CHECKER_SQUARE = 1.0
"""Side of a square of a plane's checker pattern (m)."""


@dataclass(kw_only=True, slots=True)
class ShapeAppearance:
    """One visual shape of a link; change its fields through `RenderShapes.change`."""

    geometry: Geometry
    shape: RenderShape


def render_shape(
    geometry: Geometry, origin: Pose, material: Material | None, scale: float, owner: tuple[int, int]
) -> RenderShape | None:
    """Return a geometry with its material as a render shape on frame 0; None for a missing mesh."""
    triangles = triangles_of(geometry, scale)
    if triangles is None:
        return None
    mesh, factors = triangles
    rotation = matrix_from_quaternion(origin.quaternion)
    rgba = material.rgba if material is not None and material.rgba is not None else None
    extra: dict[str, Any] = {}
    if isinstance(geometry, Plane):
        from roboyard.sim.build.geoms import turn_z_to

        rotation = rotation @ matrix_from_quaternion(turn_z_to(np.asarray(geometry.normal, dtype=float)))
        base = rgba or DEFAULT_RGBA
        extra["checker"] = ((base[0] * 0.82, base[1] * 0.84, base[2] * 0.88), CHECKER_SQUARE)
        extra["infinite"] = True
    if material is not None and material.texture is not None:
        extra["texture"] = load_texture(material.texture)
    return RenderShape(
        mesh=mesh,
        scale=factors,
        position=np.asarray(origin.position, dtype=float) * scale,
        rotation=rotation,
        frame=0,
        owner=owner,
        rgba=rgba or ((1.0, 1.0, 1.0, 1.0) if has_own_colors(mesh) else DEFAULT_RGBA),
        use_mesh_colors=rgba is None,
        **extra,
    )


def has_own_colors(mesh: TriangleMesh) -> bool:
    """Return whether the mesh file has colours."""
    return mesh.colors is not None or mesh.texture is not None


def triangles_of(geometry: Geometry, scale: float) -> tuple[TriangleMesh, tuple[float, float, float]] | None:
    """Return a mesh and its scale factors for a geometry; None for a missing mesh."""
    from roboyard.shapes import primitives
    from roboyard.sim.build.geoms import load_scaled

    one = (1.0, 1.0, 1.0)
    match geometry:
        case Box(size=(x, y, z)):
            return primitives.box(), (x * scale, y * scale, z * scale)
        case Sphere(radius=radius):
            d = 2 * radius * scale
            return primitives.sphere(), (d, d, d)
        case Cylinder(radius=radius, length=length):
            return primitives.cylinder(), (2 * radius * scale, 2 * radius * scale, length * scale)
        case Capsule(radius=radius, length=length):
            if length < 1e-6:
                d = 2 * radius * scale
                return primitives.sphere(), (d, d, d)
            return primitives.capsule(radius * scale, length * scale), one
        case Plane():
            return primitives.plane(PLANE_HALF_SIZE, PLANE_HALF_SIZE), one
        case Mesh():
            mesh = load_scaled(geometry, scale)
            return None if mesh is None else (mesh, one)
        case Heightfield(heights=heights, cell=(dx, dy)):
            nx, ny = heights.shape
            mesh = primitives.heightfield(
                np.asarray(heights).T * scale, (nx - 1) * dx * scale, (ny - 1) * dy * scale
            )
            return mesh, one


def load_texture(path: Path) -> np.ndarray | None:
    """Return the (h, w, 4) RGBA of an image file, the same array for the same file; None if unreadable."""
    from roboyard.shapes.readers.external_files import load_image_file

    try:
        return load_image_file(path, path.name)
    except OSError:
        return None
