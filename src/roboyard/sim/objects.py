"""Descriptions of simple objects: planes, boxes, spheres, cylinders, capsules, meshes, terrain.

Each is a robot description of one link, so that everything in a world is built in the same way.
`World.add_box` and its siblings add them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import (
    RGBA,
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Heightfield,
    Inertial,
    Link,
    Material,
    Mesh,
    Plane,
    Pose,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.description.urdf.numbers import LARGEST
from roboyard.errors import RoboyardError
from roboyard.shapes import inertia
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build.geoms import load_scaled
from roboyard.sim.build.mesh_assets import convex_hull

GREY: RGBA = (0.7, 0.7, 0.7, 1.0)


def plane(normal: ArrayLike, *, rgba: RGBA, friction: float | None, name: str) -> RobotDescription:
    """Return an infinite plane through the origin.

    Args:
        normal: (3,) its direction; any length.
        rgba: colour, each 0 to 1.
        friction: sliding friction coefficient.
        name: of the description.

    Raises:
        RoboyardError: the normal is zero.
    """
    direction = np.asarray(normal, dtype=float)
    length = np.linalg.norm(direction)
    if not length > 0:
        raise RoboyardError(f"plane normal must not be zero, got {tuple(direction)}")
    x, y, z = direction / length
    return _of_one_link(Plane(normal=(x, y, z)), None, rgba, friction, name)


def box(size: ArrayLike, *, mass: float, rgba: RGBA, friction: float | None, name: str) -> RobotDescription:
    """Return a solid box of full extents `size` (3,) (m), centred."""
    x, y, z = _positive(size, 3, "box size")
    solid = _solid(inertia.box((x, y, z)), mass, name)
    return _of_one_link(Box(size=(x, y, z)), solid, rgba, friction, name)


def sphere(radius: float, *, mass: float, rgba: RGBA, friction: float | None, name: str) -> RobotDescription:
    """Return a solid sphere of a radius (m), centred."""
    (r,) = _positive(radius, 1, "sphere radius")
    return _of_one_link(Sphere(radius=r), _solid(inertia.sphere(r), mass, name), rgba, friction, name)


def cylinder(
    radius: float, length: float, *, mass: float, rgba: RGBA, friction: float | None, name: str
) -> RobotDescription:
    """Return a solid cylinder along z, centred; radius and length in m."""
    r, h = _positive((radius, length), 2, "cylinder radius and length")
    solid = _solid(inertia.cylinder(r, h), mass, name)
    return _of_one_link(Cylinder(radius=r, length=h), solid, rgba, friction, name)


def capsule(
    radius: float, length: float, *, mass: float, rgba: RGBA, friction: float | None, name: str
) -> RobotDescription:
    """Return a solid capsule along z, centred; radius and length without the caps in m."""
    r, h = _positive((radius, length), 2, "capsule radius and length")
    solid = _solid(inertia.capsule(r, h), mass, name)
    return _of_one_link(Capsule(radius=r, length=h), solid, rgba, friction, name)


def mesh(
    source: str | Path | TriangleMesh,
    *,
    scale: ArrayLike,
    mass: float,
    concave: bool,
    rgba: RGBA | None,
    friction: float | None,
    name: str,
) -> RobotDescription:
    """Return a mesh with the mass properties of its convex hull.

    Args:
        source: a file, or the triangles.
        scale: one factor, or (3,) along the axes of the mesh.
        mass: kg; 0 for an object that is fixed to the world.
        concave: whether bodies touch the triangles instead of the hull; for mass 0.
        rgba: colour, each 0 to 1; None for the file's own.
        friction: sliding friction coefficient.
        name: of the description.

    Raises:
        RoboyardError: a mesh with a mass is concave.
    """
    if concave and mass != 0:
        raise RoboyardError(f"{name}: only fixed meshes can be concave, got mass {mass}; give mass 0")
    sx, sy, sz = (float(v) for v in np.broadcast_to(np.asarray(scale, dtype=float), 3))
    if isinstance(source, TriangleMesh):
        geometry = Mesh(uri="", path=None, scale=(sx, sy, sz), data=source)
    else:
        geometry = Mesh(uri=str(source), path=Path(source), scale=(sx, sy, sz))
    loaded = load_scaled(geometry, 1.0)
    assert loaded is not None
    vertices, faces = convex_hull(loaded)
    solid = _solid(inertia.hull_or_box((vertices, faces), vertices), mass, name)
    description = _of_one_link(geometry, solid, rgba, friction, name)
    if not concave:
        return description
    (link,) = description.links
    link = replace(link, collisions=tuple(replace(shape, concave=True) for shape in link.collisions))
    return replace(description, links=(link,))


def heightfield(
    heights: ArrayLike, cell: ArrayLike, *, rgba: RGBA, friction: float | None, name: str
) -> RobotDescription:
    """Return terrain.

    Args:
        heights: (nx, ny) height at each grid point, first index along x (m).
        cell: spacing of the points, one value or (2,) along x and y (m).
        rgba: colour, each 0 to 1.
        friction: sliding friction coefficient.
        name: of the description.

    Raises:
        RoboyardError: fewer than 2 by 2 heights, or some that are not finite.
    """
    grid = np.array(heights, dtype=float)
    if grid.ndim != 2 or min(grid.shape) < 2 or not np.isfinite(grid).all():
        raise RoboyardError(f"heights must be at least 2 by 2 finite numbers, got shape {grid.shape}")
    dx, dy = (float(v) for v in np.broadcast_to(np.asarray(cell, dtype=float), 2))
    _positive((dx, dy), 2, "heightfield cell")
    grid.setflags(write=False)
    return _of_one_link(Heightfield(heights=grid, cell=(dx, dy)), None, rgba, friction, name)


# ---------------------------------------------------------------------------------------------------- common


def _solid(uniform: inertia.SolidInertia, mass: float, name: str) -> Inertial | None:
    """The inertial element of a solid of uniform density with this mass (kg); None for mass 0."""
    if not (np.isfinite(mass) and mass >= 0):
        raise RoboyardError(f"{name}: mass must be at least 0, got {mass}")
    if mass == 0:
        return None
    solid = uniform.scaled_to(mass)
    x, y, z = (float(v) for v in solid.center)
    xx, xy, xz, _, yy, yz, _, _, zz = (float(v) for v in solid.inertia.ravel())
    return Inertial(mass=mass, origin=Pose(position=(x, y, z)), inertia=(xx, xy, xz, yy, yz, zz))


def _of_one_link(
    geometry: Geometry, inertial: Inertial | None, rgba: RGBA | None, friction: float | None, name: str
) -> RobotDescription:
    if friction is not None and not 0 <= friction < np.inf:
        raise RoboyardError(f"{name}: friction must be at least 0 and finite, got {friction}")
    link = Link(
        name="base",
        inertial=inertial,
        visuals=(Visual(geometry=geometry, material=None if rgba is None else Material(rgba=rgba)),),
        collisions=(Collision(geometry=geometry),),
        contact=None if friction is None else Contact(lateral_friction=friction),
    )
    return RobotDescription(name=name, links=(link,))


def _positive(values: ArrayLike, count: int, what: str) -> tuple[float, ...]:
    numbers = np.atleast_1d(np.asarray(values, dtype=float))
    if numbers.shape != (count,) or not ((numbers > 0) & (numbers <= LARGEST)).all():
        raise RoboyardError(
            f"{what} must be {count} positive number{'s' * (count > 1)} up to {LARGEST:g} m, got {values}"
        )
    return tuple(float(v) for v in numbers)
