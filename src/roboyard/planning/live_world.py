"""Obstacles of a live world: the collision shapes of all bodies but the robot, moved in place."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Heightfield,
    Plane,
    Pose,
    Sphere,
)
from roboyard.planning.distance_fields import heightfield_field, mesh_field
from roboyard.planning.obstacles import Obstacle, Obstacles, Shape
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array, pose_matrix, quaternion_from_matrix

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.world import World


class WorldObstacles:
    """Obstacles that follow a world; shapes are read again only where bodies were added or removed."""

    def __init__(self, world: World, robot: Body, ignored: Iterable[Body] = ()) -> None:
        """Read a world.

        Args:
            world: holds the robot and everything else.
            robot: the body that is planned for.
            ignored: bodies that are no obstacles, such as one that the robot holds.
        """
        self.world, self.robot = world, robot
        self.ignored = tuple(ignored)
        self._shapes: dict[int, Shape] = {}
        self._model: Any = None
        self._geoms: list[int] = []
        self._names: list[str] = []
        self._root = np.eye(4)
        self.obstacles = Obstacles()
        self.update()

    def update(self) -> Obstacles:
        """Return the obstacles at their present poses; the same object while bodies and robot stay."""
        self.world.detect_contacts()
        model, data = self.world.model, self.world.data
        root = pose_matrix(*self.robot.links[0].pose)
        poses: dict[int, Pose] = {}
        if model is not self._model:
            self._model = model
            self._shapes.clear()
            self._geoms, self._names = self._chosen()
        elif np.array_equal(root, self._root):
            for row, geom in enumerate(self._geoms):
                pose = _pose(data, geom)
                if pose != self.obstacles.items[row].pose:
                    poses[row] = pose
            for row, pose in poses.items():
                self.obstacles.place(row, pose)
            return self.obstacles
        self._root = root
        found = []
        for geom, name in zip(self._geoms, self._names, strict=True):
            if geom not in self._shapes:
                self._shapes[geom] = _shape(model, geom)
            found.append(Obstacle(name=name, shape=self._shapes[geom], pose=_pose(data, geom)))
        self.obstacles = Obstacles(found, root)
        return self.obstacles

    def with_moved(self, geoms: Collection[int], motion: Array) -> Obstacles:
        """Return new obstacles of which those of some MuJoCo geoms are moved by a (4, 4) motion of the world,
        such as a drawer that is going to be open.
        """
        found = []
        for geom, one in zip(self._geoms, self.obstacles.items, strict=True):
            if geom in geoms:
                placed = motion @ one.pose.matrix()
                x, y, z, w = (float(v) for v in quaternion_from_matrix(placed[:3, :3]))
                px, py, pz = (float(v) for v in placed[:3, 3])
                one = replace(one, pose=Pose(position=(px, py, pz), quaternion=(x, y, z, w)))
            found.append(one)
        return Obstacles(found, self._root)

    def _chosen(self) -> tuple[list[int], list[str]]:
        """Return the geoms that are obstacles, with the names of their bodies."""
        model = self.world.model
        own = {int(row) for row in self.robot.mujoco_ids}
        skipped = {int(row) for body in self.ignored for row in body.mujoco_ids}
        names = {int(row): body.name for body in self.world.bodies for row in body.mujoco_ids}
        geoms = [
            g
            for g in range(model.ngeom)
            if (model.geom_contype[g] or model.geom_conaffinity[g])
            and int(model.geom_bodyid[g]) not in own | skipped
        ]
        # shapes of fixed bodies may belong to MuJoCo's world body; bodies of the pool have no name
        kept = [g for g in geoms if int(model.geom_bodyid[g]) in names or model.geom_bodyid[g] == 0]
        return kept, [names.get(int(model.geom_bodyid[g]), "the world") for g in kept]


def _pose(data: Any, geom: int) -> Pose:
    x, y, z = (float(v) for v in data.geom_xpos[geom])
    turn = quaternion_from_matrix(data.geom_xmat[geom].reshape(3, 3))
    return Pose(
        position=(x, y, z), quaternion=(float(turn[0]), float(turn[1]), float(turn[2]), float(turn[3]))
    )


def _shape(model: Any, geom: int) -> Shape:
    """Return the shape of a geom in its own frame; meshes are the hulls that collide."""
    from roboyard._mujoco import mujoco

    kinds = mujoco.mjtGeom
    kind = int(model.geom_type[geom])
    a, b, c = (float(v) for v in model.geom_size[geom])
    simple: dict[int, Geometry] = {}
    if kind == kinds.mjGEOM_BOX:
        simple[kind] = Box(size=(2 * a, 2 * b, 2 * c))
    elif kind == kinds.mjGEOM_SPHERE:
        simple[kind] = Sphere(radius=a)
    elif kind == kinds.mjGEOM_CAPSULE:
        simple[kind] = Capsule(radius=a, length=2 * b)
    elif kind == kinds.mjGEOM_CYLINDER:
        simple[kind] = Cylinder(radius=a, length=2 * b)
    elif kind == kinds.mjGEOM_PLANE:
        simple[kind] = Plane()
    elif kind == kinds.mjGEOM_HFIELD:
        return heightfield_field(_heightfield(model, int(model.geom_dataid[geom])))
    if kind in simple:
        return simple[kind]
    if kind == kinds.mjGEOM_MESH:
        points = _vertices(model, int(model.geom_dataid[geom]))
    else:  # ellipsoids
        from roboyard.shapes import primitives

        points = primitives.sphere(1.0).vertices * (a, b, c)
    return _hull(points)


def _vertices(model: Any, mesh: int) -> Array:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    return np.array(model.mesh_vert[first : first + count], dtype=float)


def _hull(points: Array) -> Shape:
    """Return a convex hull as a field; a box along the axes as a box where it is centred."""
    from roboyard.shapes.convex.hulls import convex_hull, hull_volume

    low, high = points.min(axis=0), points.max(axis=0)
    size = high - low
    if hull_volume(points) > 0.999 * float(np.prod(size)) and np.abs(low + high).max() < 1e-4 * size.max():
        return Box(size=(float(size[0]), float(size[1]), float(size[2])))
    mesh = convex_hull(points, None).mesh
    return mesh_field(TriangleMesh(vertices=mesh.vertices, faces=mesh.faces))


def _heightfield(model: Any, field: int) -> Heightfield:
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    rx, ry, top, _ = (float(v) for v in model.hfield_size[field])
    first = int(model.hfield_adr[field])
    data = np.array(model.hfield_data[first : first + rows * columns], dtype=float).reshape(rows, columns)
    cell = (2 * rx / (columns - 1), 2 * ry / (rows - 1))
    return Heightfield(heights=np.ascontiguousarray(data.T) * top, cell=cell)
