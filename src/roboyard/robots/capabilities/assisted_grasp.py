"""Grasps by a constraint instead of friction, as OmniGibson's `grasping_mode` "assisted" and "sticky".

    physical   friction alone holds an object
    assisted   a closing gripper takes an object that a finger touches and that is between the fingers: on a
               ray from a start to an end point of the definition, or touched by two fingers
    sticky     a closing gripper takes what any finger touches

An object is held until the gripper opens, or is pulled away. Objects that are fixed or heavier than
`HEAVIEST` are not taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, cast

import numpy as np

from roboyard.robots.control import MultiFingerGripperController
from roboyard.robots.definition.schema import Manipulation as Block
from roboyard.sim.body import Body
from roboyard.sim.link import Link
from roboyard.sim.world import World
from roboyard.transforms import Array, conjugate, multiply, rotate

if TYPE_CHECKING:
    from roboyard.sim.constraints.records import Constraint

GraspingMode = Literal["physical", "assisted", "sticky"]
MODES: tuple[GraspingMode, ...] = ("physical", "assisted", "sticky")
HEAVIEST = 10.0
"""Mass of the heaviest object that is taken (kg)."""
WINDOW = 3.0
"""Time after a gripper began to close in which it takes an object (s)."""
MARGIN = 0.1
"""Share of the way between two grasp points that a ray omits at each end."""
PULLED_AWAY = 0.1
"""Distance from its place in the gripper at which an object is lost (m)."""


@dataclass(kw_only=True, slots=True)
class Held:
    """An object in a gripper."""

    link: Link
    constraint: Constraint
    place: Array
    """(3,) point of the end-effector link's frame at which it was taken (m)."""
    point: Array
    """(3,) the same point in the object's link's frame (m)."""


class AssistedGrasp:
    """Takes and releases objects for the arms of one robot."""

    def __init__(self, body: Body, block: Block, mode: GraspingMode) -> None:
        """Create the grasps of the arms of a definition's `manipulation` block."""
        self._body = body
        self._block = block
        self.mode: GraspingMode = mode
        self._held: dict[str, Held] = {}
        self._closing_since: dict[str, float] = {}

    @property
    def world(self) -> World:
        """The world that the robot is in."""
        return World.of(self._body)

    def held(self, arm: str) -> Link | None:
        """Return the link that an arm's gripper holds; None where it holds none."""
        item = self._held.get(arm)
        return None if item is None or _body_of(item.link).is_removed else item.link

    def update(self, arm: str, controller: MultiFingerGripperController, q: Array) -> None:
        """Take or release an object, after a gripper's goal was set.

        Args:
            arm: whose gripper.
            controller: of the gripper.
            q: (n,) present positions of its joints (rad or m).
        """
        item = self._held.get(arm)
        if item is not None and (_body_of(item.link).is_removed or self._is_lost(arm, item)):
            self.release(arm)
        if not controller.is_closing(q):
            self.release(arm)
            self._closing_since.pop(arm, None)
            return
        now = self.world.time
        since = self._closing_since.setdefault(arm, now)
        if arm not in self._held and now - since <= WINDOW:
            found = self._candidate(arm)
            if found is not None:
                self._take(arm, *found)

    def release(self, arm: str | None = None) -> None:
        """Release what an arm's gripper holds; what all grippers hold by default."""
        for name in list(self._held) if arm is None else [arm]:
            item = self._held.pop(name, None)
            if item is not None and not _body_of(item.link).is_removed:
                self.world.constraints.remove(item.constraint)

    def _eef(self, arm: str) -> Link:
        return self._body.link(self._block.eef_link_names[arm])

    def _is_lost(self, arm: str, item: Held) -> bool:
        spots = []
        for link, point in ((self._eef(arm), item.place), (item.link, item.point)):
            position, quaternion = link.pose
            spots.append(position + rotate(quaternion, point))
        return float(np.linalg.norm(spots[0] - spots[1])) > PULLED_AWAY

    def _candidate(self, arm: str) -> tuple[Link, Array] | None:
        """Return the link that a gripper may take, and where in the world frame it is touched (m)."""
        fingers = {self._body.link(name).index for name in self._block.finger_link_names.get(arm, ())}
        touched: dict[tuple[int, int], set[int]] = {}
        found: dict[tuple[int, int], tuple[Link, Array]] = {}
        for contact in self.world.contacts(self._body):
            link = contact.link_b
            if contact.link_a.index not in fingers or not self._can_be_taken(link):
                continue
            key = (link.body.id, link.index)
            touched.setdefault(key, set()).add(contact.link_a.index)
            found.setdefault(key, (link, contact.position))
        for key in sorted(touched, key=lambda key: -len(touched[key])):
            if self.mode == "sticky" or len(touched[key]) >= 2 or key in self._between(arm):
                return found[key]
        return None

    def _can_be_taken(self, link: Link) -> bool:
        body = _body_of(link)
        return body.id != self._body.id and not body.is_fixed and body.mass <= HEAVIEST

    def _between(self, arm: str) -> set[tuple[int, int]]:
        """Return body id and link index of what rays between the grasp points of an arm hit."""
        block = self._block
        ends = []
        for points in (block.assisted_grasp_start_points, block.assisted_grasp_end_points):
            spots = []
            for name, point in (points or {}).get(arm, ()):
                position, quaternion = self._body.link(name).pose
                spots.append(position + rotate(quaternion, np.array(point, dtype=float)))
            ends.append(spots)
        found = set()
        for start in ends[0]:
            for end in ends[1]:
                margin = MARGIN * (end - start)  # the points are on the fingers
                hit = self.world.ray(start + margin, end - margin)
                if hit is not None:
                    found.add((hit.body.id, hit.link.index))
        return found

    def _take(self, arm: str, link: Link, point: Array) -> None:
        """Weld an object to the end effector; a link behind joints turns about the touched point."""
        eef = self._eef(arm)
        position, quaternion = eef.pose
        other_position, other_quaternion = link.pose
        back = conjugate(quaternion)
        place = rotate(back, point - position)
        own = rotate(conjugate(other_quaternion), point - other_position)
        if link.index > 0 and len(_body_of(link).joint_names):
            constraint = self.world.constraints.add_point(eef, link, position_a=place, position_b=own)
        else:
            constraint = self.world.constraints.add_weld(
                eef,
                link,
                position_a=place,
                orientation_a=multiply(back, other_quaternion),
                position_b=own,
            )
        self._held[arm] = Held(link=link, constraint=constraint, place=place, point=own)


def _body_of(link: Link) -> Body:
    return cast(Body, link.body)
