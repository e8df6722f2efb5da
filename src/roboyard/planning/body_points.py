"""Points on the surface of bodies in a world, from the shapes that collide."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.surface_points import surface_points
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

POINTS = 3000
"""Points on a body."""


def body_points(body: Body, count: int = POINTS) -> Array:
    """Return (k, 3) points on the collision shapes of a body in the world frame (m), with their corners."""
    return link_points(body.links, count)


def link_points(links: Iterable[Link], count: int = POINTS) -> Array:
    """Return (k, 3) points on the collision shapes of links of one body in the world frame (m)."""
    meshes = [mesh for link in links for mesh in link_meshes(link)]
    corners = [mesh.vertices for mesh in meshes]
    return np.concatenate([surface_points(meshes, count), *corners])


def link_meshes(link: Link) -> list[TriangleMesh]:
    """Return the collision shapes of a link as triangles in the world frame (m); meshes as their hulls."""
    world: Any = link.body.world
    world.ensure_compiled()
    world.kinematics()
    model, data = world.model, world.data
    found = []
    for geom in link.geom_ids:
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        mesh = _mesh(model, geom)
        if mesh is not None:
            rotation, position = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            found.append(TriangleMesh(vertices=mesh.vertices @ rotation.T + position, faces=mesh.faces))
    return found


def _mesh(model: Any, geom: int) -> TriangleMesh | None:
    """Return a geom as triangles in its own frame; None for planes and terrain."""
    from roboyard._mujoco import mujoco
    from roboyard.shapes.convex.hulls import convex_hull

    kinds = mujoco.mjtGeom
    a, b, c = (float(v) for v in model.geom_size[geom])
    match int(model.geom_type[geom]):
        case kinds.mjGEOM_BOX:
            return primitives.box(a, b, c)
        case kinds.mjGEOM_SPHERE:
            return primitives.sphere(a)
        case kinds.mjGEOM_CAPSULE:
            return primitives.capsule(a, 2 * b)
        case kinds.mjGEOM_CYLINDER:
            return primitives.cylinder(a, 2 * b)
        case kinds.mjGEOM_ELLIPSOID:
            ball = primitives.sphere(1.0)
            return TriangleMesh(vertices=ball.vertices * (a, b, c), faces=ball.faces)
        case kinds.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            hull = convex_hull(np.array(model.mesh_vert[first : first + count], dtype=float), None).mesh
            return TriangleMesh(vertices=hull.vertices, faces=hull.faces)
    return None
