"""Contacts of a robot's own collision shapes in any posture."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from roboyard.description.model import RobotDescription
from roboyard.importer.planning.self_collision import contacts_at

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.sim.body import Body

Posture = Mapping[str, float]
Pair = tuple[str, str]


class ContactChecker:
    """Finds the links of one robot that overlap; links that a joint connects are skipped."""

    def __init__(self, description: RobotDescription) -> None:
        """Store the robot; its world is built at the first question."""
        self.description = description

    @cached_property
    def _stage(self) -> tuple[World, Body]:
        from roboyard.sim import World

        world = World(visual_geoms=False)
        add = world.add_description
        return world, add(self.description, fixed_base=True, self_collision=True, drives=False)

    def overlaps(self, posture: Posture) -> dict[Pair, float]:
        """Return the pairs of links that overlap, in link order, with the depth (m).

        Args:
            posture: joint name to position (rad or m); joints not named stay as they were at the last
                question, followers of a named joint included.
        """
        world, body = self._stage
        return {(a, b): depth for a, b, depth in contacts_at(body, world, self._followed(posture))}

    def _followed(self, posture: Posture) -> dict[str, float]:
        """Return a posture with the joints that mimic a named one where their leader has them."""
        out = dict(posture)
        for _ in range(len(self._followers)):
            before = dict(out)
            for name, leader, multiplier, offset in self._followers:
                if leader in out:
                    out[name] = multiplier * out[leader] + offset
            if out == before:
                break
        return out

    @cached_property
    def _followers(self) -> list[tuple[str, str, float, float]]:
        joints = self.description.joints
        return [
            (j.name, j.mimic.joint, j.mimic.multiplier, j.mimic.offset) for j in joints if j.mimic is not None
        ]
