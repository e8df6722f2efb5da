"""MuJoCo as the judge of configurations: exact collision shapes instead of spheres."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Box, Capsule, Cylinder, Heightfield, Mesh, Plane, Sphere
from roboyard.kinematics.joint_models import mimic_source
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.planning.attached import Attached
from roboyard.planning.distance_fields import DistanceField
from roboyard.planning.obstacles import Obstacle
from roboyard.planning.spheres.sphere_model import SphereRobot
from roboyard.transforms import Array, quaternion_from_matrix, to_wxyz

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.world import World

DEEP = 1e-6
"""Depth from which an overlap counts (m)."""
FAR, SURE = 0.5, 1e-4
"""Distance beyond which hulls count as that far apart, and error of distances (m)."""
FLOOR_DEPTH = 0.01
"""Depth up to which wheels and feet may sink into what they stand on (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Clash:
    """An overlap of a robot's link with an obstacle or another link."""

    link: str
    other: str
    depth: float
    """m"""
    is_self: bool
    """Whether `other` is a link of the robot."""


class HullJudge:
    """Overlaps of the hulls of one robot in a world; works on a copy of its state."""

    def __init__(
        self,
        world: World,
        body: Body,
        robot: SphereRobot,
        ignored: Iterable[Body] = (),
        held: Iterable[Attached] = (),
    ) -> None:
        """Create a judge of a body that `robot` describes; other bodies stay where they are now.

        Args:
            world: holds the body and the obstacles.
            body: the robot.
            robot: names and order of the joints that configurations give.
            ignored: bodies that the robot may touch.
            held: free bodies that move with a link, and count as parts of it.
        """
        world.detect_contacts()
        self.model: Any = world.model
        self.data: Any = copy.copy(world.data)
        self.robot = robot
        link_of_row = {int(row): link.name for row, link in zip(body.mujoco_ids, body.links, strict=True)}
        self._held = [
            (int(body.link(one.link).mujoco_id), one.body.free_qpos, one.pose)
            for one in held
            if one.body.free_qpos >= 0
        ]
        for one in held:
            link_of_row |= {int(row): one.link for row in one.body.mujoco_ids}
        other_rows = {
            int(row): other.name for other in world.bodies if other is not body for row in other.mujoco_ids
        }
        skipped = {int(row) for other in ignored for row in other.mujoco_ids}
        self.link = [link_of_row.get(int(b), "") for b in self.model.geom_bodyid]
        self.other = [other_rows.get(int(b), "the world") for b in self.model.geom_bodyid]
        chain = robot.chain
        moves = {name for name, node in zip(chain.links, chain.link_node, strict=True) if node >= 0}
        self.moves = np.array([name in moves for name in self.link])
        self.of_robot = np.array([bool(name) for name in self.link])
        self.skipped = np.array([int(b) in skipped for b in self.model.geom_bodyid])
        self.on_floor = np.zeros(len(self.link), dtype=bool)
        self._set_rows(body)

    def allow(self, links: Iterable[str]) -> None:
        """Let links such as wheels touch obstacles up to `FLOOR_DEPTH`."""
        chosen = set(links)
        self.on_floor = np.array([name in chosen for name in self.link])

    def _set_rows(self, body: Body) -> None:
        """Find the entries of qpos that q moves, and set the held ones."""
        model = self.robot.model.description
        index = {name: i for i, name in enumerate(self.robot.joint_names)}
        rows, terms = [], []
        for joint in single_dof_joints(model.joints):
            row = body.joint(joint.name).qpos_slice.start
            leader, multiplier, offset = joint.name, 1.0, 0.0
            if joint.mimic is not None:
                source = mimic_source(model, joint)
                if source.leader is None:
                    continue
                leader, multiplier, offset = source.leader.name, source.multiplier, source.offset
            if leader in index:
                rows.append(row)
                terms.append((index[leader], multiplier, offset))
            elif leader in self.robot.held:
                self.data.qpos[row] = multiplier * self.robot.held[leader] + offset
        self.rows = np.array(rows, dtype=np.int64)
        self.source = np.array([t[0] for t in terms], dtype=np.int64)
        self.multiplier = np.array([t[1] for t in terms])
        self.offset = np.array([t[2] for t in terms])

    def clashes(self, q: Array) -> list[Clash]:
        """Return the overlaps of moving links at (n,) q (rad or m), the deepest of each pair."""
        from roboyard._mujoco import mujoco

        self.data.qpos[self.rows] = q[self.source] * self.multiplier + self.offset
        mujoco.mj_kinematics(self.model, self.data)
        if self._held:
            self._carry()
        mujoco.mj_collision(self.model, self.data)
        if self.data.ncon == 0:
            return []
        contact = self.data.contact
        geoms, depths = contact.geom, -contact.dist
        wrong = (depths > DEEP) & self._counts[geoms[:, 0], geoms[:, 1]]
        if not wrong.any():
            return []
        deepest: dict[tuple[str, str], Clash] = {}
        standing = self.on_floor[geoms].any(axis=1) & (depths < FLOOR_DEPTH)
        standing &= ~self.of_robot[geoms].all(axis=1)
        for k in np.flatnonzero(wrong & ~standing):
            a, b = geoms[k]
            if not self.of_robot[a]:
                a, b = b, a
            is_self = bool(self.of_robot[b])
            link, other = self.link[a], self.link[b] if is_self else self.other[b]
            pair = (min(link, other), max(link, other))
            found = deepest.get(pair)
            if found is None or found.depth < depths[k]:
                deepest[pair] = Clash(link=link, other=other, depth=float(depths[k]), is_self=is_self)
        return list(deepest.values())

    def _carry(self) -> None:
        """Move held bodies to where their links hold them."""
        from roboyard._mujoco import mujoco

        for row, first, pose in self._held:
            link = np.eye(4)
            link[:3, :3], link[:3, 3] = self.data.xmat[row].reshape(3, 3), self.data.xpos[row]
            placed = link @ pose
            self.data.qpos[first : first + 3] = placed[:3, 3]
            self.data.qpos[first + 3 : first + 7] = to_wxyz(quaternion_from_matrix(placed[:3, :3]))
        mujoco.mj_kinematics(self.model, self.data)

    def first_clash(self, qs: Array) -> tuple[int, list[Clash]] | None:
        """Return the first of (b, n) configurations with overlaps, and those; None where all are free."""
        for i, q in enumerate(qs):
            found = self.clashes(q)
            if found:
                return i, found
        return None

    def pair_distance(self, q: Array, pair: tuple[str, str]) -> float:
        """Return the distance between two links' hulls at (n,) q, at most `FAR` (m); `FAR` without shapes."""
        from roboyard._mujoco import mujoco

        self.data.qpos[self.rows] = q[self.source] * self.multiplier + self.offset
        mujoco.mj_kinematics(self.model, self.data)
        of_a, of_b = (self._colliding.get(link, ()) for link in pair)
        distances = (
            mujoco.mj_geomDistance(self.model, self.data, g, h, FAR, None) for g in of_a for h in of_b
        )
        return min(distances, default=FAR)

    @cached_property
    def _counts(self) -> np.ndarray:
        """(g, g) whether an overlap of two geoms counts: one moves, none is skipped, they may not touch."""
        links = sorted(set(self.link))
        index = np.array([links.index(name) for name in self.link])
        may = np.eye(len(links), dtype=bool)  # of the robot
        for a, b in self.robot.model.ignore:
            if a in links and b in links:
                may[links.index(a), links.index(b)] = may[links.index(b), links.index(a)] = True
        may[[not name for name in links]] = may[:, [not name for name in links]] = False
        counts = self.moves[:, None] | self.moves
        counts &= ~(self.skipped[:, None] | self.skipped)
        return counts & ~may[index[:, None], index]

    @cached_property
    def _colliding(self) -> dict[str, list[int]]:
        """Link to its geoms that collide."""
        collides = (self.model.geom_contype | self.model.geom_conaffinity) != 0
        found: dict[str, list[int]] = {}
        for geom in np.flatnonzero(collides):
            found.setdefault(self.link[geom], []).append(int(geom))
        return found

    def first_pair_clash(self, qs: Array) -> tuple[int, list[Clash]] | None:
        """Return the first of (b, n) configurations where links of the robot's rough pairs overlap.

        Distances between their hulls say how far the joints can move before the next look is needed.
        """
        if not len(qs):
            return None
        for pair, reach in zip(self.robot.rough, self.robot.rough_reach, strict=True):
            at, room = qs[0], 0.0
            for i, q in enumerate(qs):
                if np.abs(q - at) @ reach < room:
                    continue
                at, room = q, self.pair_distance(q, pair) - SURE
                if room > 0.0:
                    continue
                found = self.clashes(q)
                if found:
                    return i, found
        return None


def judge_of(robot: SphereRobot, obstacles: Iterable[Obstacle]) -> HullJudge:
    """Return a judge for a robot at the world's origin among the obstacles that `is_judged` accepts."""
    from roboyard.sim import World

    world = World(visual_geoms=False)
    body = world.add_description(robot.model.description, fixed_base=True, drives=False)
    for obstacle in obstacles:
        if is_judged(obstacle):
            add_obstacle(world, obstacle)
    return HullJudge(world, body, robot)


def add_obstacle(world: World, obstacle: Obstacle) -> None:
    """Add an obstacle to a world as a fixed body; a mesh as its hull, a distance field not at all."""
    from roboyard.description.geometry import geometry_mesh

    at = {"position": obstacle.pose.position, "orientation": obstacle.pose.quaternion}
    fixed = {"mass": 0.0, "name": obstacle.name}
    match obstacle.shape:
        case Box(size=size):
            world.add_box(size, **at, **fixed)
        case Sphere(radius=radius):
            world.add_sphere(radius, obstacle.pose.position, **fixed)
        case Cylinder(radius=radius, length=length):
            world.add_cylinder(radius, length, **at, **fixed)
        case Capsule(radius=radius, length=length):
            world.add_capsule(radius, length, **at, **fixed)
        case Plane(normal=normal):
            world.add_plane(normal, obstacle.pose.position, name=obstacle.name)
        case Heightfield(heights=heights, cell=cell):
            world.add_heightfield(heights, cell, obstacle.pose.position, name=obstacle.name)
        case Mesh() as mesh:
            data = geometry_mesh(mesh)
            if data is not None:
                world.add_mesh(data, **at, **fixed)


def is_judged(obstacle: Obstacle) -> bool:
    """Whether `judge_of` knows an obstacle: all but distance fields and concave meshes."""
    if isinstance(obstacle.shape, DistanceField):
        return False
    if isinstance(obstacle.shape, Mesh):
        from roboyard.description.geometry import geometry_mesh
        from roboyard.shapes.convex.hulls import is_convex

        data = geometry_mesh(obstacle.shape)
        return data is not None and is_convex(data, 0.02)
    return True
