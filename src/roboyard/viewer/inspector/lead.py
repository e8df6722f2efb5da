"""Lead a paused robot by a link: the joints follow the mouse by inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import Array, conjugate, rotate
from roboyard.viewer.inspector.panels.joint_panel import slider_range

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.sim.joint import Joint
    from roboyard.sim.link import Link
    from roboyard.viewer.scene.drags import Drag

ITERATIONS = 12
"""Steps of damped least squares for each motion of the mouse."""
DAMPING = 0.02
"""Damping, as a fraction of the robot's size."""
REACH = 0.2
"""Longest way of the grabbed point in one step, as a fraction of the robot's size."""


class Lead:
    """The grabbed point of a robot, and the joints between it and the base."""

    def __init__(self, body: Body, move: Callable[[str, float], None], followers: frozenset[str]) -> None:
        """Start without a grabbed point.

        Args:
            body: the robot.
            move: sets the position of a joint (rad or m).
            followers: mimic joints, which follow others.
        """
        self._body, self._move, self._followers = body, move, followers
        self._held: tuple[Link, Array] | None = None
        self._size = max(float(np.linalg.norm(np.ptp(body.bounds, axis=0))), 1e-3)

    def start(self, drag: Drag) -> None:
        """Grab the point where a drag started; on another body: nothing."""
        self._held = None
        if drag.owner[0] == self._body.id and 0 <= drag.owner[1] < len(self._body.links):
            link = self._body.links[drag.owner[1]]
            position, quaternion = link.pose
            self._held = link, rotate(conjugate(quaternion), np.array(drag.grip) - position)

    def follow(self, target: Array) -> float:
        """Move the grabbed point towards a (3,) point in the world frame (m).

        Returns the distance that is left (m); infinite without a grabbed point.
        """
        if self._held is None:
            return np.inf
        link, local = self._held
        joints = self._chain(link)
        left = np.inf
        for _ in range(ITERATIONS):
            position, quaternion = link.pose
            point = position + rotate(quaternion, local)
            way = target - point
            left = float(np.linalg.norm(way))
            if left < 1e-5 * self._size or not joints:
                break
            way *= min(1.0, REACH * self._size / left)
            columns = np.stack([_column(joint, point) for joint in joints], axis=1)
            square = columns @ columns.T + (DAMPING * self._size) ** 2 * np.eye(3)
            for joint, step in zip(joints, columns.T @ np.linalg.solve(square, way), strict=True):
                self._move(joint.name, float(np.clip(joint.position + step, *slider_range(joint))))
        return left

    def _chain(self, link: Link) -> list[Joint]:
        """Return the joints from a link to the root that can be moved."""
        found = []
        above: Link | None = link
        while above is not None:
            joint = self._body.joint_of(above)
            if joint is not None and joint.is_scalar and joint.name not in self._followers:
                found.append(joint)
            above = above.parent
        return found


def _column(joint: Joint, point: Array) -> Array:
    """Return the (3,) velocity of a point (m, world frame) by a joint's unit velocity."""
    origin, quaternion = joint.child.pose
    axis = rotate(quaternion, joint.axis / np.linalg.norm(joint.axis))
    return axis if joint.type == "prismatic" else np.cross(axis, point - origin)
