"""A robot as rigid bodies and the joints between them, at home; links on fixed joints are one body.

A body has the name of the moving joint above it; the base's is the empty text. Positions and directions are
in the frame of the link at which the skeleton begins (m).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import pairwise

import numpy as np

from roboyard.description.model import Joint, Link, RobotDescription
from roboyard.errors import MeshError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.morphology.base.virtual import has_shape, is_free_slide, is_planar_motion
from roboyard.morphology.joint_ranges import home_position
from roboyard.morphology.point_model import extremes_of_shapes
from roboyard.transforms import Array

BASE = ""
"""Name of the body at which the skeleton begins."""


class Skeleton:
    """Bodies, joints and their geometry below one link."""

    def __init__(self, description: RobotDescription, base_link: str | None = None) -> None:
        self.description = description
        self.base_link = base_link or first_body(description)
        self.parent: dict[str, str] = {}
        """Joint to the body that it hangs from."""
        self.children: dict[str, list[str]] = {BASE: []}
        """Body to the joints that hang from it, in file order."""
        self.links: dict[str, list[str]] = {BASE: [self.base_link]}
        """Body to its links, that next to the joint first."""
        self.joint: dict[str, Joint] = {}
        """Moving joints by name, depth first."""
        stack = [(joint, BASE) for joint in reversed(description.child_joints[self.base_link])]
        while stack:
            joint, body = stack.pop()
            if joint.is_moving:
                self.joint[joint.name] = joint
                self.parent[joint.name] = body
                self.children[body].append(joint.name)
                body = joint.name
                self.children[body], self.links[body] = [], []
            self.links[body].append(joint.child)
            stack += [(below, body) for below in reversed(description.child_joints[joint.child])]
        self._link_points: dict[tuple[str, bool], Array] = {}

    # ------------------------------------------------------------------------------------------------ tree

    def below(self, joint: str) -> list[str]:
        """Return a joint and all joints further out, depth first."""
        found, stack = [], [joint]
        while stack:
            name = stack.pop()
            found.append(name)
            stack += reversed(self.children[name])
        return found

    def path(self, body: str) -> list[str]:
        """Return the joints from the base to a body, base first."""
        found = []
        while body != BASE:
            found.append(body)
            body = self.parent[body]
        return found[::-1]

    def depth(self, joint: str) -> int:
        """Return the largest number of driven joints on a way from this joint outwards, itself included."""
        own = int(self.is_driven(joint))
        return own + max((self.depth(child) for child in self.children[joint]), default=0)

    def is_driven(self, joint: str) -> bool:
        """Return whether a joint has no leader."""
        return self.joint[joint].mimic is None

    def body_of(self, link: str) -> str | None:
        """Return the body that a link belongs to; None for a link outside the skeleton."""
        return self._body_of.get(link)

    @cached_property
    def _body_of(self) -> Mapping[str, str]:
        return {link: body for body, links in self.links.items() for link in links}

    def bodies_links(self, joint: str) -> Iterator[str]:
        """Yield the links of a joint's body and of all bodies further out."""
        for name in self.below(joint):
            yield from self.links[name]

    # -------------------------------------------------------------------------------------------- geometry

    @cached_property
    def frames(self) -> Mapping[str, Array]:
        """Link to its (4, 4) pose in the frame of the base link, joints at home."""
        home = {name: home_position(joint) for name, joint in self.joint.items()}
        single = {name: v for name, v in home.items() if self.joint[name].type in SINGLE}
        poses = forward_kinematics(self.description, single)
        to_base = np.linalg.inv(poses[self.base_link])
        return {name: to_base @ pose for name, pose in poses.items()}

    def origin(self, joint: str) -> Array:
        """Return the (3,) position of a joint."""
        return self.frames[self.joint[joint].child][:3, 3]

    def axis(self, joint: str) -> Array:
        """Return the (3,) unit axis of a joint."""
        return self.frames[self.joint[joint].child][:3, :3] @ np.asarray(self.joint[joint].axis)

    def link_points(self, link: str, *, visual: bool = False) -> Array:
        """Return (k, 3) extreme points of a link's collision shapes; of its visual ones if asked for, or
        where there are no others.
        """
        key = (link, visual)
        if key not in self._link_points:
            item = self.description.link_by_name[link]
            points = _shape_points(item, visual=visual)
            if not len(points):
                points = _shape_points(item, visual=not visual)
            frame = self.frames[link]
            self._link_points[key] = points @ frame[:3, :3].T + frame[:3, 3]
        return self._link_points[key]

    def points(self, body: str, *, visual: bool = False) -> Array:
        """Return (k, 3) extreme points of a body."""
        return np.concatenate([self.link_points(link, visual=visual) for link in self.links[body]])

    def points_below(self, joint: str) -> Array:
        """Return (k, 3) extreme points of a joint's body and of all bodies further out."""
        return np.concatenate([self.points(name) for name in self.below(joint)])

    @cached_property
    def all_points(self) -> Array:
        """(k, 3) extreme points of the whole robot."""
        return np.concatenate([self.points(body) for body in self.links])

    @cached_property
    def spots(self) -> Array:
        """(k, 3) extreme points of the whole robot; its joints' positions where it has no shape."""
        if len(self.all_points) or not self.joint:
            return self.all_points
        return np.array([self.origin(name) for name in self.joint])

    @cached_property
    def size(self) -> float:
        """Largest extent of shapes and joints (m)."""
        spots = np.concatenate([self.all_points, *(self.origin(name)[None] for name in self.joint)])
        return float(np.ptp(spots, axis=0).max()) if len(spots) else 0.0

    def length(self, joints: list[str]) -> float:
        """Return the length of the way through the joints' positions (m)."""
        spots = [self.origin(name) for name in joints]
        return float(sum(np.linalg.norm(b - a) for a, b in pairwise(spots)))

    def reach(self, joint: str) -> float:
        """Return the longest way from a joint to the end of what it moves (m)."""
        here = self.origin(joint)
        points = self.points(joint)
        own = float(np.linalg.norm(points - here, axis=1).max()) if len(points) else 0.0
        further = (float(np.linalg.norm(self.origin(c) - here)) + self.reach(c) for c in self.children[joint])
        return max(own, *further, 0.0)

    # ------------------------------------------------------------------------------------------------ mass

    def mass(self, body: str) -> float:
        """Return the mass of a body (kg)."""
        links = (self.description.link_by_name[link] for link in self.links[body])
        return sum(link.inertial.mass for link in links if link.inertial is not None)

    def moved_mass(self, joint: str) -> float:
        """Return the mass of all that a joint moves (kg)."""
        return sum(self.mass(name) for name in self.below(joint))


SINGLE = ("revolute", "continuous", "prismatic")
"""Types of joints of one number."""


def first_body(description: RobotDescription) -> str:
    """Return the link that counts as the base: the root, or the first real link below joints that represent
    the motion of the base (a floating or planar joint, or several whose links have neither shape nor mass, or
    a turn and a slide without end).
    """
    carried = _carried_in_a_plane(description)
    if carried is not None:
        return carried
    link = description.root.name
    seen: list[Joint] = []
    while True:
        here = description.link_by_name[link]
        joints = description.child_joints[link]
        if here.collisions or here.visuals or (here.inertial is not None and here.inertial.mass > 0.01):
            break
        if len(joints) != 1:
            break
        seen.append(joints[0])
        link = joints[0].child
    moving = [joint for joint in seen if joint.is_moving]
    free = any(joint.type in ("floating", "planar") for joint in moving)
    slides = sum(joint.type == "prismatic" for joint in moving)
    endless = len(moving) == 2 and slides == 1 and all(is_endless(j) or is_free_slide(j) for j in moving)
    if endless or free or (len(moving) >= 3 and slides >= 2) or (len(moving) == 2 and slides == 2):
        last = moving[-1].child
        below = description.link_by_name[last]
        has_more = bool(description.child_joints[last] or below.collisions or below.visuals)
        return last if has_more else description.root.name
    return description.root.name


def _carried_in_a_plane(description: RobotDescription) -> str | None:
    """Return the link that two level slides and a turn carry, none of which moves a shape; else None."""
    link, moving = description.root.name, list[Joint]()
    while not has_shape(description, link) and len(description.child_joints[link]) == 1 and len(moving) < 3:
        (joint,) = description.child_joints[link]
        moving += [joint] if joint.is_moving else []
        link = joint.child
    drawn = any(one.visuals or one.collisions for one in description.links)
    return link if drawn and is_planar_motion(moving) else None


def _shape_points(link: Link, *, visual: bool) -> Array:
    shapes = link.visuals if visual else link.collisions
    try:
        return extremes_of_shapes(shapes)
    except MeshError:  # what a broken mesh holds is unknown; other links still show something
        return np.empty((0, 3))


def is_endless(joint: Joint) -> bool:
    """Return whether a joint turns without limits, or by at least two turns."""
    if joint.type == "continuous":
        return True
    limits = joint.position_limits()
    return joint.type == "revolute" and (limits is None or limits[1] - limits[0] >= 4 * np.pi - 1e-6)
