"""A robot as points and masses on its links, for its extent and its centre of mass in any posture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.geometry import geometry_mesh, shape_meshes
from roboyard.description.model import Collision, Joint, Link, RobotDescription, Visual
from roboyard.kinematics.description_poses import forward_kinematics, vector_joints
from roboyard.morphology.joint_ranges import home_position
from roboyard.morphology.kept_points import kept_points
from roboyard.shapes.convex.hulls import farthest_along
from roboyard.transforms import Array

DIRECTIONS = 256
"""Of the extreme points kept for each shape; the outline is then right within 1 % of the shape's size."""

POSTURES = 48
"""Tried for the largest inertia on each joint."""


class PointModel:
    """Outline points, masses and a home posture; all answers are in the root link's frame.

    A posture is joint name to rad or m, single or (n,) arrays; joints not named are at home, and joints that
    mimic another follow it.
    """

    def __init__(self, description: RobotDescription) -> None:
        self.description = description
        self.joints: tuple[Joint, ...] = vector_joints(description)
        """The joints that can be driven: one number each, no mimics; depth first."""
        self.home: dict[str, float] = {joint.name: home_position(joint) for joint in self.joints}
        self.outlines = {link.name: outline for link in description.links if len(outline := _outline(link))}
        weighed = [link for link in description.links if link.inertial is not None and link.inertial.mass > 0]
        self._weighed = [link.name for link in weighed]
        self._masses = np.array([link.inertial.mass for link in weighed if link.inertial])
        self._centres = [np.array(link.inertial.origin.position) for link in weighed if link.inertial]

    def poses(self, posture: Mapping[str, ArrayLike]) -> dict[str, Array]:
        """Return the (..., 4, 4) pose of each link in the root link's frame."""
        return forward_kinematics(self.description, {**self.home, **posture})

    def points(self, poses: Mapping[str, Array], links: Sequence[str] | None = None) -> Array:
        """Return the (..., k, 3) outline points of some links, all by default (m)."""
        names = [name for name in (self.outlines if links is None else links) if name in self.outlines]
        if not names:
            return np.empty((*poses[self.description.root.name].shape[:-2], 0, 3))
        found = [
            np.einsum("...ij,kj->...ki", poses[name][..., :3, :3], self.outlines[name])
            + poses[name][..., None, :3, 3]
            for name in names
        ]
        batch = np.broadcast_shapes(*(p.shape[:-2] for p in found))
        return np.concatenate([np.broadcast_to(p, (*batch, *p.shape[-2:])) for p in found], axis=-2)

    def lowest(self, poses: Mapping[str, Array], links: Sequence[str] | None = None) -> Array:
        """Return the (n,) height of the lowest outline point of links in (n, 4, 4) poses (m); +inf without
        any.
        """
        return self.lowest_points(poses, links)[..., 2]

    def lowest_points(self, poses: Mapping[str, Array], links: Sequence[str] | None = None) -> Array:
        """Return the (n, 3) lowest outline point of links in (n, 4, 4) poses (m); +inf without any."""
        names = [name for name in (self.outlines if links is None else links) if name in self.outlines]
        posed = names or [self.description.root.name]
        batch = np.broadcast_shapes(*(poses[name].shape[:-2] for name in posed))
        lowest = np.full((*batch, 3), np.inf)
        for name in names:
            pose, outline = poses[name], self.outlines[name]
            index = (pose[..., 2, :3] @ outline.T).argmin(axis=-1)
            point = np.einsum("...ij,...j->...i", pose[..., :3, :3], outline[index]) + pose[..., :3, 3]
            lowest = np.where(point[..., 2:] < lowest[..., 2:], point, lowest)
        return lowest

    def centre_of_mass(self, poses: Mapping[str, Array]) -> Array:
        """Return the (..., 3) centre of mass (m); the origin for a robot without mass."""
        total = self._masses.sum()
        if not total > 0:
            return np.zeros((*poses[self.description.root.name].shape[:-2], 3))
        moments = [
            mass * (poses[name][..., :3, :3] @ centre + poses[name][..., :3, 3])
            for name, mass, centre in zip(self._weighed, self._masses, self._centres, strict=True)
        ]
        return sum(moments[1:], start=moments[0]) / total

    @property
    def mass(self) -> float:
        """Of all links; kg."""
        return float(self._masses.sum())

    def moved_inertias(self) -> dict[str, float]:
        """Driven joint to the inertia of all that it moves, each link taken as a point: kg m² about a hinge's
        axis, or kg on a slide.

        The largest at home and in many postures within the limits: an arm in line with a joint's axis has
        almost no inertia about it until the elbow bends.
        """
        draw = np.random.default_rng(0).uniform(size=(POSTURES, len(self.joints)))
        draw[0] = [_share_at_home(joint, self.home[joint.name]) for joint in self.joints]
        ranges = np.array([_rough_range(joint, self.home[joint.name]) for joint in self.joints]).reshape(
            -1, 2
        )
        values = ranges[:, 0] + draw * (ranges[:, 1] - ranges[:, 0])
        poses = self.poses({joint.name: values[:, k] for k, joint in enumerate(self.joints)})
        centres = {
            name: poses[name][..., :3, :3] @ centre + poses[name][..., :3, 3]
            for name, centre in zip(self._weighed, self._centres, strict=True)
        }
        mass_of = dict(zip(self._weighed, self._masses, strict=True))
        found = {}
        for joint in self.joints:
            moved = [name for name in self.moved_links(joint) if name in mass_of]
            if joint.type == "prismatic":
                found[joint.name] = float(sum(mass_of[name] for name in moved))
                continue
            frame = poses[joint.child]
            axis = frame[..., :3, :3] @ np.array(joint.axis)
            total = np.zeros(POSTURES)
            for name in moved:
                arm = np.cross(axis, centres[name] - frame[..., :3, 3])
                total += mass_of[name] * (arm**2).sum(axis=-1)
            found[joint.name] = float(total.max())
        return found

    def followers(self, joint: Joint) -> list[Joint]:
        """The joint and all that mimic it, directly or through one another."""
        found = [joint]
        names = {joint.name}
        for _ in self.description.joints:
            new = [
                other
                for other in self.description.joints
                if other.mimic is not None and other.mimic.joint in names and other.name not in names
            ]
            if not new:
                break
            found += new
            names |= {other.name for other in new}
        return found

    def posture_with_followers(self) -> dict[str, float]:
        """Home of every joint of one number, those that mimic another included."""
        posture = dict(self.home)
        for joint in self.description.depth_first_joints:
            if joint.mimic is None or joint.type == "fixed":
                continue
            posture[joint.name] = self._followed(joint)
        return posture

    def _followed(self, joint: Joint) -> float:
        multiplier, offset = 1.0, 0.0
        for _ in self.description.joints:
            if joint.mimic is None:
                break
            offset += multiplier * joint.mimic.offset
            multiplier *= joint.mimic.multiplier
            joint = self.description.joint_by_name[joint.mimic.joint]
        return multiplier * self.home.get(joint.name, 0.0) + offset

    @property
    def base_links(self) -> list[str]:
        """The root link and those fixed to it."""
        found = [self.description.root.name]
        for joint in self.description.depth_first_joints:
            if joint.type == "fixed" and joint.parent in found:
                found.append(joint.child)
        return found

    @property
    def base_mass(self) -> float:
        """Of the root link and those fixed to it; kg."""
        mass_of = dict(zip(self._weighed, self._masses, strict=True))
        return float(sum(mass_of.get(name, 0.0) for name in self.base_links))

    def path(self, link: str) -> list[Joint]:
        """The moving joints from a link up to the root."""
        joints = []
        while (joint := self.description.parent_joint.get(link)) is not None:
            if joint.is_moving:
                joints.append(joint)
            link = joint.parent
        return joints

    def moved_links(self, joint: Joint) -> list[str]:
        """Names of all links that move when this joint is driven."""
        found: dict[str, None] = {}
        stack = [follower.child for follower in self.followers(joint)]
        while stack:
            name = stack.pop()
            if name not in found:
                found[name] = None
                stack += [child.child for child in self.description.child_joints[name]]
        return list(found)


def _rough_range(joint: Joint, home: float) -> tuple[float, float]:
    """The limits, or half a turn (10 cm) each way; never more than that beyond a turn (10 m)."""
    reach = 0.1 if joint.type == "prismatic" else np.pi
    lower, upper = joint.position_limits() or (home - reach, home + reach)
    most = 10.0 if joint.type == "prismatic" else np.pi
    return max(lower, home - most), min(upper, home + most)


def _share_at_home(joint: Joint, home: float) -> float:
    lower, upper = _rough_range(joint, home)
    return 0.0 if upper <= lower else (home - lower) / (upper - lower)


def _outline(link: Link) -> Array:
    """(k, 3) extreme points of a link's collision shapes, or of its visual ones where it has no others."""
    shapes = link.collisions or link.visuals
    return kept_points(f"outline {DIRECTIONS}", shapes, lambda: _extremes(shapes))


def _extremes(shapes: Sequence[Visual | Collision]) -> Array:
    found = []
    for shape in shapes:
        mesh = geometry_mesh(shape.geometry)
        if mesh is not None and len(mesh.vertices):
            matrix = shape.origin.matrix()
            found.append(mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])
    return extreme_points(np.concatenate(found)) if found else np.empty((0, 3))


def extremes_of_shapes(shapes: Sequence[Visual | Collision], directions: int = DIRECTIONS) -> Array:
    """(k, 3) extreme points of each of a link's shapes in the link's frame (m), kept on disk.

    Raises:
        MeshError: a mesh file cannot be read.
    """

    def make() -> Array:
        meshes = shape_meshes(shapes)
        found = [extreme_points(mesh.vertices, directions) for mesh in meshes if len(mesh.vertices)]
        return np.concatenate(found) if found else np.empty((0, 3))

    return kept_points(f"extremes {directions}", shapes, make)


def extreme_points(points: Array, directions: int = DIRECTIONS) -> Array:
    """(k, 3) those of (n, 3) points that lie farthest out in one of many even directions."""
    if len(points) <= directions:
        return points
    return points[np.unique(farthest_along(points, _directions(directions)))]


def _directions(count: int) -> Array:
    """(count + 6, 3) unit: the axes, and a Fibonacci lattice (even spread by the golden angle)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index
    radius = np.sqrt(1.0 - z * z)
    lattice = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    return np.concatenate([np.eye(3), -np.eye(3), lattice])
