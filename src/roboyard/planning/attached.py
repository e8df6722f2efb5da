"""Bodies that a robot holds: planned as spheres of the gripper, judged as the exact shapes that they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from roboyard.description.robot_model import CollisionSphere
from roboyard.planning.body_points import body_points
from roboyard.planning.spheres.sphere_model import SphereModel
from roboyard.transforms import Array, inverse_pose, pose_matrix

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody
    from roboyard.sim.body import Body

SPHERES = 8
"""Spheres of a held body."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Attached:
    """A body that moves with a link of the robot."""

    body: Body
    link: str
    """Link of the robot."""
    pose: Array
    """(4, 4) pose of the body in the link's frame (m)."""
    spheres: tuple[CollisionSphere, ...]
    """In the link's frame."""
    touching: frozenset[str]
    """Links of the robot that may touch the body."""


def attached_body(robot: RobotBody, body: Body, link: str, touching: Sequence[str] = ()) -> Attached:
    """Return a body attached to a link of the robot where it is now.

    Args:
        robot: the robot.
        body: a free body in the robot's world.
        link: link that holds it.
        touching: links besides it that may touch the body, such as fingers.
    """
    into_link = inverse_pose(pose_matrix(*robot.link(link).pose))
    points = body_points(body)
    points = points @ into_link[:3, :3].T + into_link[:3, 3]
    return Attached(
        body=body,
        link=link,
        pose=into_link @ pose_matrix(*body.pose),
        spheres=spheres_around(points),
        touching=frozenset((*touching, link)),
    )


def spheres_around(points: Array, count: int = SPHERES) -> tuple[CollisionSphere, ...]:
    """Return up to `count` spheres that contain (k, 3) points (m), by k-means."""
    centers = points[np.linspace(0, len(points) - 1, min(count, len(points))).astype(int)]
    for _ in range(20):
        nearest = np.linalg.norm(points[:, None] - centers, axis=2).argmin(axis=1)
        centers = np.array([points[nearest == k].mean(axis=0) for k in np.unique(nearest)])
    gaps = np.linalg.norm(points[:, None] - centers, axis=2)
    nearest = gaps.argmin(axis=1)
    return tuple(
        CollisionSphere(
            center=(float(center[0]), float(center[1]), float(center[2])),
            radius=float(gaps[nearest == k, k].max()),
        )
        for k, center in enumerate(centers)
        if (nearest == k).any()
    )


def with_attached(model: SphereModel, held: Sequence[Attached]) -> SphereModel:
    """Return a model whose links carry the spheres of held bodies."""
    if not held:
        return model
    spheres = dict(model.spheres)
    pairs = set(model.ignore)
    links = {one.link for one in held}
    for one in held:
        spheres[one.link] = (*spheres.get(one.link, ()), *one.spheres)
        pairs |= {(min(one.link, other), max(one.link, other)) for other in one.touching if other != one.link}
    loaded = frozenset(pair for pair in model.apart if links & set(pair))  # what they carry may touch
    return replace(
        model,
        spheres=spheres,
        ignore=frozenset(pairs),
        is_loose=True,
        rough=model.rough | loaded,
        apart=model.apart - loaded,
        overlaps={pair: depth for pair, depth in model.overlaps.items() if not links & set(pair)},
    )
