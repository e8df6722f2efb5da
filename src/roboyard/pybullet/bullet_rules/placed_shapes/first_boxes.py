"""Boxes in which Bullet adds links to the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import Array, inverse_pose, pose_matrix

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import LinkModel


def first_boxes(covers: np.ndarray, links: Sequence[LinkModel], *, at_inertial: bool, is_mjcf: bool) -> Array:
    """Return (n, 5, 3) boxes in the base's frame (m) in which Bullet adds links, joints at 0.

    Args:
        covers: (n, 5, 3) as in `PlacedShapes`.
        links: as for `first_frames`, with the other options.
    """
    frames = first_frames(links, at_inertial=at_inertial, is_mjcf=is_mjcf)
    found = covers.copy()
    found[:, :4] = np.einsum("nij,nkj->nki", frames[:, :3, :3], covers[:, :4])
    found[:, 0] += frames[:, :3, 3]
    return found


def first_frames(links: Sequence[LinkModel], *, at_inertial: bool, is_mjcf: bool) -> Array:
    """Return the (n, 4, 4) poses in the base's frame at which Bullet adds links to the world, joints at 0.

    It places the shapes of a link relative to its inertial frame, but adds them as if they were relative to
    its link frame, until the first step. Those of MJCF files are added with the base's link frame at its
    inertial frame, and from the first joint that moves on without a rotation: its matrix is 0.

    Args:
        links: base, then links in order.
        at_inertial: whether shapes are where they are from the first step on.
        is_mjcf: whether they are of an MJCF file.

    Source:
        Bullet, URDF2Bullet.cpp, ConvertURDF2BulletInternal, and BulletMJCFImporter.cpp, parseBody.
    """
    frames = np.empty((len(links), 4, 4))
    found = np.empty((len(links), 4, 4))
    for index, link in enumerate(links):
        own = pose_matrix(link.frame.position, link.frame.quaternion)
        if link.joint is None:
            frames[index] = own if is_mjcf else np.eye(4)
        else:
            origin = link.joint.origin
            frames[index] = frames[link.parent + 1]
            if link.joint.type == "fixed" or not is_mjcf:
                frames[index] = frames[index] @ pose_matrix(origin.position, origin.quaternion)
            else:
                frames[index, :3, :3] = 0.0
        found[index] = frames[index] if at_inertial else frames[index] @ inverse_pose(own)
    return found
