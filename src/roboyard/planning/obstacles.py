"""Obstacles as arrays for the planning kernels: primitives, meshes and terrain, updated in place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from roboyard._arrays import NDArray
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
from roboyard.errors import ConfigError
from roboyard.planning.distance_fields import DistanceField, heightfield_field, mesh_field
from roboyard.planning.kernels.arrays import CAPSULE, CYLINDER, FIELD, HALF_SPACE, WorldArrays
from roboyard.transforms import Array, inverse_pose

Shape = Geometry | DistanceField


@dataclass(frozen=True, kw_only=True, eq=False)
class Obstacle:
    """One shape in the surroundings."""

    name: str
    """Name in messages."""
    shape: Shape
    """Sizes in m; a mesh is solid, and concave where its triangles are."""
    pose: Pose = field(default_factory=Pose)
    """Of the shape's frame in the world frame."""


class Obstacles:
    """Obstacles in the frame of a robot's root link; a moved obstacle changes its row only."""

    def __init__(self, obstacles: Iterable[Obstacle] = (), root: Array | None = None) -> None:
        """Pack obstacles; `root` is the (4, 4) pose of the robot's root link in the world frame (m).

        Raises:
            ConfigError: a shape has no size.
            MeshError: a mesh cannot be read.
        """
        self.items = tuple(obstacles)
        self.root = np.eye(4) if root is None else np.asarray(root, dtype=float)
        self._boxes = [o for o in self.items if isinstance(o.shape, Box)]
        self._others = [replace(o, shape=_prepared(o)) for o in self.items if not isinstance(o.shape, Box)]
        self._inverse = inverse_pose(self.root)
        counts = [0, 0]
        self._rows: list[int] = []
        for one in self.items:
            is_box = isinstance(one.shape, Box)
            self._rows.append(counts[is_box])
            counts[is_box] += 1
        self.moves = 0
        """Number of moves so far."""
        self.arrays = self._pack()

    def name(self, index: int) -> str:
        """Return the name of an obstacle by its index in the kernels: boxes first."""
        return [*self._boxes, *self._others][index].name

    def move(self, name: str, pose: Pose) -> None:
        """Move every obstacle of this name to `pose` in the world frame, in place.

        Raises:
            ConfigError: there is none of this name.
        """
        rows = [row for row, one in enumerate(self.items) if one.name == name]
        if not rows:
            names = ", ".join(sorted({o.name for o in self.items})) or "none"
            raise ConfigError(f'obstacle "{name}": there is none of this name; the obstacles are {names}')
        for row in rows:
            self.place(row, pose)

    def place(self, row: int, pose: Pose) -> None:
        """Move one of `items` to `pose` in the world frame, in place."""
        matrix = self._inverse @ pose.matrix()
        kernel_row = self._rows[row]
        if isinstance(self.items[row].shape, Box):
            self.arrays.boxes[:12, kernel_row] = _frame(matrix)
        else:
            shape = self._others[kernel_row].shape
            if isinstance(shape, Plane):
                matrix = matrix @ _along(shape.normal)
            self.arrays.frame[kernel_row] = _frame(matrix)
            self.arrays.around[kernel_row, :3] = matrix[:3, :3] @ _local_center(shape) + matrix[:3, 3]
        self.items = (*self.items[:row], replace(self.items[row], pose=pose), *self.items[row + 1 :])
        self.moves += 1

    def _pack(self) -> WorldArrays:
        inverse = inverse_pose(self.root)
        boxes = np.zeros((15, len(self._boxes)))
        for b, box in enumerate(self._boxes):
            assert isinstance(box.shape, Box)
            if min(box.shape.size) <= 0:
                raise ConfigError(f'obstacle "{box.name}": size is {box.shape.size}; give positive lengths')
            boxes[:12, b] = _frame(inverse @ box.pose.matrix())
            boxes[12:, b] = np.asarray(box.shape.size) / 2
        count = len(self._others)
        kind, grid = np.zeros(count, dtype=np.int64), np.zeros((count, 4), dtype=np.int64)
        frame, size, around = np.zeros((count, 12)), np.zeros((count, 4)), np.zeros((count, 4))
        values: list[NDArray[np.float32]] = []
        used = 0
        for o, other in enumerate(self._others):
            matrix = inverse @ other.pose.matrix()
            if isinstance(other.shape, Plane):
                matrix = matrix @ _along(other.shape.normal)
            frame[o] = _frame(matrix)
            shape = other.shape
            if isinstance(shape, DistanceField):
                kind[o] = FIELD
                size[o] = (*shape.origin, shape.cell)
                grid[o] = (used, *shape.values.shape)
                values.append(shape.values.ravel())
                used += shape.values.size
            else:
                kind[o], size[o, :2] = _primitive(other.name, shape)
            center = _local_center(shape)
            around[o, :3] = matrix[:3, :3] @ center + matrix[:3, 3]
            around[o, 3] = _radius(shape)
        flat = np.concatenate([np.zeros(0, np.float32), *values]).astype(np.float32)
        return WorldArrays(
            boxes=boxes, kind=kind, frame=frame, size=size, grid=grid, around=around, values=flat
        )


def _prepared(obstacle: Obstacle) -> Shape:
    """Return the shape with meshes and terrain as distance fields."""
    shape = obstacle.shape
    if isinstance(shape, Mesh):
        mesh = geometry_mesh(shape)
        if mesh is None:
            raise ConfigError(f'obstacle "{obstacle.name}": there is no mesh file {shape.uri!r}; check it')
        return mesh_field(mesh)
    if isinstance(shape, Heightfield):
        return heightfield_field(shape)
    return shape


def _primitive(name: str, shape: Shape) -> tuple[int, tuple[float, float]]:
    match shape:
        case Plane():
            return HALF_SPACE, (0.0, 0.0)
        case Sphere(radius=radius) if radius > 0:
            return CAPSULE, (radius, 0.0)
        case Capsule(radius=radius, length=length) if radius > 0 and length >= 0:
            return CAPSULE, (radius, length / 2)
        case Cylinder(radius=radius, length=length) if radius > 0 and length > 0:
            return CYLINDER, (radius, length / 2)
    raise ConfigError(f'obstacle "{name}": {shape} has no size; give positive lengths')


def _local_center(shape: Shape) -> Array:
    return shape.center if isinstance(shape, DistanceField) else np.zeros(3)


def _radius(shape: Shape) -> float:
    match shape:
        case Sphere(radius=radius):
            return radius
        case Capsule(radius=radius, length=length):
            return radius + length / 2
        case Cylinder(radius=radius, length=length):
            return float(np.hypot(radius, length / 2))
        case DistanceField():
            return shape.radius
        case _:
            return np.inf


def _frame(matrix: Array) -> Array:
    return np.concatenate([matrix[:3, 3], matrix[:3, :3].ravel()])


def _along(normal: tuple[float, float, float]) -> Array:
    """Return a (4, 4) rotation whose z axis is `normal`."""
    z = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    x = np.cross(z, (0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0))
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return out
