"""Fingers of a hand as points that move with its joints, in the palm's frame (m)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.evidence.model import Follower
from roboyard.description.model import Box, Joint, Link, RobotDescription
from roboyard.errors import MeshError
from roboyard.kinematics.description_poses import forward_kinematics, position_size
from roboyard.morphology.joint_ranges import home_position
from roboyard.morphology.point_model import extremes_of_shapes
from roboyard.transforms import Array

DIRECTIONS = 64
"""Of the extreme points kept for each shape."""
TIP_SHARE = 0.2
"""Share of a finger's points, the farthest ones, that are its tip."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Finger:
    """A branch of the hand: everything that its first joint moves."""

    joints: tuple[str, ...]
    """Depth first; the first one hangs from the palm."""
    links: tuple[str, ...]
    """Depth first."""


class HandGeometry:
    """Joints and points of one hand. A posture is joint to rad or m, single or (n,) arrays.

    Args:
        description: the robot.
        palm_links: the links of the rigid body from which the fingers move, the first one next to the arm.
        joints: the moving joints of the fingers.
        followers: joints that follow others though the joints themselves do not state it.
    """

    def __init__(
        self,
        description: RobotDescription,
        palm_links: Sequence[str],
        joints: Sequence[str],
        followers: Sequence[Follower] = (),
    ) -> None:
        self.description = description
        self.palm_links = tuple(palm_links)
        self.joint: dict[str, Joint] = {name: description.joint_by_name[name] for name in joints}
        self.leaders = leaders(description, joints, followers)
        self.fingers = self._branches()
        first = next(iter(self.fingers), None)
        self.palm = description.joint_by_name[first.joints[0]].parent if first else self.palm_links[-1]
        self._points: dict[str, Array] = {}
        self._home: dict[str, Array] | None = None

    def _branches(self) -> tuple[Finger, ...]:
        found = []
        for joint in self.joint.values():
            if joint.parent not in self.palm_links:
                continue
            joints, links, open_joints = [], [], [joint]
            while open_joints:
                each = open_joints.pop()
                links.append(each.child)
                if each.is_moving:
                    joints.append(each.name)
                open_joints += reversed(self.description.child_joints[each.child])
            found.append(Finger(joints=tuple(joints), links=tuple(links)))
        return tuple(found)

    def poses(self, posture: Mapping[str, ArrayLike]) -> dict[str, Array]:
        """Return the (..., 4, 4) pose of each link in the palm's frame; followers follow, others are home."""
        if not posture and self._home is not None:
            return self._home
        values: dict[str, ArrayLike] = {}
        for name, joint in self.joint.items():
            if position_size(joint) == 1 and joint.mimic is None:
                values[name] = self._value(name, posture, ())
        frames = forward_kinematics(self.description, values)
        to_palm = np.linalg.inv(frames[self.palm])
        hand = (*self.palm_links, *(link for finger in self.fingers for link in finger.links))
        found = {name: to_palm @ frames[name] for name in dict.fromkeys((self.palm, *hand))}
        if not posture:
            self._home = found
        return found

    def _value(self, name: str, posture: Mapping[str, ArrayLike], seen: tuple[str, ...]) -> ArrayLike:
        if name in posture:
            return posture[name]
        leader = self.leaders.get(name)
        if leader is None or leader.leader not in self.joint or leader.leader in seen:
            return home_position(self.joint[name])
        value = np.asarray(self._value(leader.leader, posture, (*seen, name)))
        return leader.multiplier * value + leader.offset

    def link_points(self, link: str) -> Array:
        """Return (k, 3) extreme points of a link in its own frame; none where it has no finite shape."""
        if link not in self._points:
            self._points[link] = _outline(self.description.link_by_name[link])
        return self._points[link]

    def points(self, links: Sequence[str], poses: Mapping[str, Array]) -> Array:
        """Return (..., k, 3) points of some links in the palm's frame."""
        found = [
            np.einsum("...ij,kj->...ki", poses[link][..., :3, :3], self.link_points(link))
            + poses[link][..., None, :3, 3]
            for link in links
            if len(self.link_points(link))
        ]
        if not found:
            return np.empty((*poses[self.palm].shape[:-2], 0, 3))
        batch = np.broadcast_shapes(*(p.shape[:-2] for p in found))
        return np.concatenate([np.broadcast_to(p, (*batch, *p.shape[-2:])) for p in found], axis=-2)

    def tip_link(self, finger: Finger) -> str | None:
        """Return the last link of a finger with a shape: that of the most joints, then the farthest out."""
        depth = {link: self._depth(link) for link in finger.links if len(self.link_points(link))}
        if not depth:
            return None
        deepest = max(depth.values())
        poses = self.poses({})
        far = {
            link: float(np.linalg.norm(self.points([link], poses), axis=1).max())
            for link in depth
            if depth[link] == deepest
        }
        return max(far, key=lambda link: far[link])

    def _depth(self, link: str) -> int:
        joint = self.description.parent_joint.get(link)
        count = 0
        while joint is not None and joint.child not in self.palm_links:
            count += joint.is_moving
            joint = self.description.parent_joint.get(joint.parent)
        return count

    def tip_points(
        self, finger: Finger, approach: Array, poses: Mapping[str, Array] | None = None
    ) -> Array | None:
        """Return the (..., k, 3) points of a finger's tip, those of its last link farthest along `approach`.

        Args:
            finger: one of `fingers`.
            approach: (3,) unit vector in the palm's frame.
            poses: of `self.poses`; at home by default.

        Returns:
            The points in the palm's frame (m); None where the finger has no shape.
        """
        link = self.tip_link(finger)
        if link is None:
            return None
        along = self.points([link], self.poses({})) @ approach
        farthest = np.argsort(along)[-max(1, int(TIP_SHARE * len(along))) :]
        return self.points([link], self.poses({}) if poses is None else poses)[..., farthest, :]

    def tip_centres(
        self, fingers: Sequence[Finger], approach: Array, poses: Mapping[str, Array] | None = None
    ) -> list[Array]:
        """Return the (..., 3) middle of each finger's tip in the palm's frame (m), without shapeless ones."""
        found = [self.tip_points(finger, approach, poses) for finger in fingers]
        return [points.mean(axis=-2) for points in found if points is not None]


def leaders(
    description: RobotDescription, joints: Sequence[str], followers: Sequence[Follower] = ()
) -> dict[str, Follower]:
    """Return joints that follow others, as `<mimic>` or one of the `followers` states."""
    found = {follower.joint: follower for follower in followers if follower.joint in joints}
    for name in joints:
        mimic = description.joint_by_name[name].mimic
        if mimic is not None:
            found[name] = Follower(
                joint=name, leader=mimic.joint, multiplier=mimic.multiplier, offset=mimic.offset
            )
    return found


def _outline(link: Link) -> Array:
    """Return the extreme points of a link's collision shapes, or of its visuals where those are boxes."""
    boxes = all(isinstance(shape.geometry, Box) for shape in link.collisions)
    for shapes in (link.visuals, link.collisions) if boxes else (link.collisions, link.visuals):
        try:
            found = extremes_of_shapes(shapes, DIRECTIONS)
        except MeshError:
            continue
        if len(found):
            return found
    return np.empty((0, 3))
