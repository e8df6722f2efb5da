"""Loop joints in edited descriptions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from roboyard.description.model import LoopJoint, Pose

ARM = 0.05
"""Distance of the second point that keeps the axes of a revolute joint together (m)."""


def points_of(loop: LoopJoint) -> list[tuple[float, float, float]]:
    """Return the points in the joint's frame that stay together (m): one, and on a hinge a second one."""
    x, y, z = (ARM * value for value in loop.axis)
    return [(0.0, 0.0, 0.0), (x, y, z)] if loop.type == "revolute" else [(0.0, 0.0, 0.0)]


def reframed(loops: Sequence[LoopJoint], link: str, change: Callable[[Pose], Pose]) -> tuple[LoopJoint, ...]:
    """Return loop joints after the frame of one link has changed.

    Args:
        loops: the loop joints.
        link: whose frame is another one now.
        change: a pose in the link's old frame to the same in the new one.
    """
    return tuple(
        replace(
            loop,
            first_origin=change(loop.first_origin) if loop.first == link else loop.first_origin,
            second_origin=change(loop.second_origin) if loop.second == link else loop.second_origin,
        )
        for loop in loops
    )


def with_renamed_links(loops: Sequence[LoopJoint], names: Mapping[str, str]) -> tuple[LoopJoint, ...]:
    """Return loop joints after links were renamed; `names` is old name to new one."""
    return tuple(
        replace(loop, first=names.get(loop.first, loop.first), second=names.get(loop.second, loop.second))
        for loop in loops
    )
