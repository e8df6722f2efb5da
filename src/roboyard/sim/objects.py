"""Simple things for a world: planes, boxes, balls, cylinders, capsules, meshes, terrain.

Each becomes a robot description of one link, so that everything in a world is built the same way. These
functions are methods of `World`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

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
from roboyard.errors import RoboyardError
from roboyard.shapes.mesh import TriangleMesh

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.world import World

GREY: RGBA = (0.7, 0.7, 0.7, 1.0)


def add_plane(
    self: World,
    normal: ArrayLike = (0, 0, 1),
    position: ArrayLike = (0, 0, 0),
    *,
    rgba: RGBA = (0.9, 0.9, 0.92, 1.0),
    friction: float | None = None,
    name: str = "plane",
) -> Body:
    """Add an endless floor (or wall) through a point; it never moves."""
    direction = np.asarray(normal, dtype=float)
    if not np.linalg.norm(direction) > 0:
        raise RoboyardError(f"a plane's normal has a direction; got {tuple(direction)}")
    x, y, z = direction / np.linalg.norm(direction)
    return _add(self, Plane(normal=(x, y, z)), 0.0, None, position, (0, 0, 0, 1), rgba, friction, name)


def add_box(
    self: World,
    size: ArrayLike,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    mass: float = 1.0,
    rgba: RGBA = GREY,
    friction: float | None = None,
    name: str = "box",
) -> Body:
    """Add a box of full extents `size` (3,) m; mass 0 bolts it to the world."""
    x, y, z = _positive(size, 3, "a box's size")
    moments = mass / 12.0 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    return _add(self, Box(size=(x, y, z)), mass, moments, position, orientation, rgba, friction, name)


def add_sphere(
    self: World,
    radius: float,
    position: ArrayLike = (0, 0, 0),
    *,
    mass: float = 1.0,
    rgba: RGBA = GREY,
    friction: float | None = None,
    name: str = "sphere",
) -> Body:
    """Add a solid ball; mass 0 bolts it to the world."""
    (r,) = _positive(radius, 1, "a sphere's radius")
    moments = np.full(3, 0.4 * mass * r * r)
    return _add(self, Sphere(radius=r), mass, moments, position, (0, 0, 0, 1), rgba, friction, name)


def add_cylinder(
    self: World,
    radius: float,
    length: float,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    mass: float = 1.0,
    rgba: RGBA = GREY,
    friction: float | None = None,
    name: str = "cylinder",
) -> Body:
    """Add a solid cylinder with its axis along z; mass 0 bolts it to the world."""
    r, h = _positive((radius, length), 2, "a cylinder's radius and length")
    side = mass * (3 * r * r + h * h) / 12.0
    moments = np.array([side, side, mass * r * r / 2.0])
    return _add(
        self, Cylinder(radius=r, length=h), mass, moments, position, orientation, rgba, friction, name
    )


def add_capsule(
    self: World,
    radius: float,
    length: float,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    mass: float = 1.0,
    rgba: RGBA = GREY,
    friction: float | None = None,
    name: str = "capsule",
) -> Body:
    """Add a solid capsule along z, `length` m without its caps; mass 0 bolts it to the world."""
    r, h = _positive((radius, length), 2, "a capsule's radius and length")
    moments = capsule_moments(r, h, mass)
    return _add(self, Capsule(radius=r, length=h), mass, moments, position, orientation, rgba, friction, name)


def capsule_moments(radius: float, length: float, mass: float) -> np.ndarray:
    """(3,) principal moments of a solid capsule along z, from its cylinder and two half balls; kg m²."""
    r, h = radius, length
    cylinder, caps = np.pi * r * r * h, 4.0 / 3.0 * np.pi * r**3
    mc, ms = mass * cylinder / (cylinder + caps), mass * caps / (cylinder + caps)
    side = mc * (3 * r * r + h * h) / 12.0 + ms * (0.4 * r * r + h * h / 4.0 + 3.0 / 8.0 * h * r)
    return np.array([side, side, mc * r * r / 2.0 + 0.4 * ms * r * r])


def add_mesh(
    self: World,
    mesh: str | Path | TriangleMesh,
    position: ArrayLike = (0, 0, 0),
    orientation: ArrayLike = (0, 0, 0, 1),
    *,
    scale: ArrayLike = (1, 1, 1),
    mass: float = 1.0,
    rgba: RGBA | None = None,
    friction: float | None = None,
    name: str = "mesh",
) -> Body:
    """Add a mesh, solid as its convex hull; mass 0 bolts it to the world."""
    sx, sy, sz = (float(v) for v in np.broadcast_to(np.asarray(scale, dtype=float), 3))
    if isinstance(mesh, TriangleMesh):
        geometry = Mesh(uri="", path=None, scale=(sx, sy, sz), data=mesh)
    else:
        geometry = Mesh(uri=str(mesh), path=Path(mesh), scale=(sx, sy, sz))
    from roboyard.sim.build.geoms import load_scaled
    from roboyard.sim.build.mesh_assets import convex_hull

    loaded = load_scaled(geometry, 1.0)
    assert loaded is not None
    centre, tensor = hull_mass_properties(*convex_hull(loaded), mass)
    inertial = None
    if mass > 0:
        inertial = Inertial(
            mass=mass,
            origin=Pose(position=tuple(centre)),
            inertia=(tensor[0, 0], tensor[0, 1], tensor[0, 2], tensor[1, 1], tensor[1, 2], tensor[2, 2]),
        )
    return _add_link(self, geometry, inertial, mass, position, orientation, rgba, friction, name)


def hull_mass_properties(
    vertices: np.ndarray, faces: np.ndarray, mass: float
) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,) m and inertia (3, 3) kg m² about it of a uniform solid with outward faces.

    Sums signed tetrahedra over the faces; their second moments are exact.
    """
    middle = vertices.mean(axis=0)
    a, b, c = (vertices[faces[:, k]] - middle for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    total = volume.sum()
    centre = (volume[:, None] * (a + b + c) / 4.0).sum(axis=0) / total
    s = a + b + c
    second = sum(np.einsum("i,ij,ik->jk", volume, p, p) for p in (a, b, c, s)) / 20.0
    second = second * (mass / total) - mass * np.outer(centre, centre)
    return middle + centre, np.trace(second) * np.eye(3) - second


def add_heightfield(
    self: World,
    heights: ArrayLike,
    cell: ArrayLike,
    position: ArrayLike = (0, 0, 0),
    *,
    rgba: RGBA = (0.6, 0.65, 0.55, 1.0),
    friction: float | None = None,
    name: str = "terrain",
) -> Body:
    """Add terrain that never moves.

    Args:
        heights: (nx, ny) height at each grid point, first index along x; m.
        cell: spacing of the points along x and y; m.
        position: (3,) centre of the grid at height 0; m.
    """
    grid = np.array(heights, dtype=float)
    if grid.ndim != 2 or min(grid.shape) < 2 or not np.isfinite(grid).all():
        raise RoboyardError(f"heights are at least 2 by 2 finite numbers; got shape {grid.shape}")
    dx, dy = (float(v) for v in np.broadcast_to(np.asarray(cell, dtype=float), 2))
    _positive((dx, dy), 2, "a heightfield's cell")
    grid.setflags(write=False)
    shape = Heightfield(heights=grid, cell=(dx, dy))
    return _add(self, shape, 0.0, None, position, (0, 0, 0, 1), rgba, friction, name)


# ---------------------------------------------------------------------------------------------------- common


def _add(
    world: World,
    geometry: Geometry,
    mass: float,
    moments: np.ndarray | None,
    position: ArrayLike,
    orientation: ArrayLike,
    rgba: RGBA | None,
    friction: float | None,
    name: str,
) -> Body:
    inertial = None
    if mass > 0 and moments is not None:
        x, y, z = (float(m) for m in moments)
        inertial = Inertial(mass=mass, inertia=(x, 0.0, 0.0, y, 0.0, z))
    return _add_link(world, geometry, inertial, mass, position, orientation, rgba, friction, name)


def _add_link(
    world: World,
    geometry: Geometry,
    inertial: Inertial | None,
    mass: float,
    position: ArrayLike,
    orientation: ArrayLike,
    rgba: RGBA | None,
    friction: float | None,
    name: str,
) -> Body:
    if not (np.isfinite(mass) and mass >= 0):
        raise RoboyardError(f"{name}: a mass is at least 0; got {mass}")
    link = Link(
        name="base",
        inertial=inertial,
        visuals=(Visual(geometry=geometry, material=None if rgba is None else Material(rgba=rgba)),),
        collisions=(Collision(geometry=geometry),),
        contact=None if friction is None else Contact(lateral_friction=friction),
    )
    description = RobotDescription(name=name, links=(link,))
    return world.add_description(description, position, orientation, fixed_base=mass == 0, name=name)


def _positive(values: ArrayLike, count: int, what: str) -> tuple[float, ...]:
    numbers = np.atleast_1d(np.asarray(values, dtype=float))
    if numbers.shape != (count,) or not (np.isfinite(numbers).all() and (numbers > 0).all()):
        raise RoboyardError(f"{what} is {count} positive number{'s' * (count > 1)}; got {values}")
    return tuple(float(v) for v in numbers)
