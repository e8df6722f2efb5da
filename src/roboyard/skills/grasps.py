"""Poses of a gripper that hold an object between two fingers, from the object's surface points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.planning.body_points import link_meshes
from roboyard.shapes.surface_points import surface_points
from roboyard.sim.link import Link
from roboyard.skills.gripper_frame import GripperFrame, pointing
from roboyard.transforms import Array

ROOM = 0.010
"""Gap that open fingers leave beside an object (m)."""
ELEVATIONS = (0.0, -0.4, -0.8, -1.2, -np.pi / 2)
"""Angles of approach, from horizontal to straight down (rad)."""
HEIGHTS = (0.4, 0.5, 0.6, 0.75, 0.9)
"""Heights at which an object is held, as shares of its own."""
TURNS = 24
"""Directions around the vertical."""
BAR = 0.030
"""Largest thickness of a bar that counts as a handle (m)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Grasp:
    """One pose of a gripper frame that holds something."""

    pose: Array
    """(4, 4) in the world frame (m)."""
    cost: float
    """Lower is better."""
    swivel: Array | None = None
    """(3,) axis of a bar in the world frame, about which the gripper may turn; None for an object."""


def object_grasps(points: Array, gripper: GripperFrame) -> list[Grasp]:
    """Return grasps of an object from its (k, 3) surface points in the world frame (m), best first."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    found = []
    for share in HEIGHTS:
        at = np.array([middle[0], middle[1], low[2] + share * (high[2] - low[2])])
        for turn in np.arange(TURNS) * 2 * np.pi / TURNS:
            across = np.array([-np.sin(turn), np.cos(turn), 0.0])
            for elevation in ELEVATIONS:
                level, down = np.cos(elevation), np.sin(elevation)
                along = np.array([level * np.cos(turn), level * np.sin(turn), down])
                grasp = _grasp(points, gripper, at, along, across, middle)
                if grasp is not None:
                    steep = abs(elevation + 0.4)  # a little from above is easiest to reach
                    edge = min(share, 1 - share) * (high[2] - low[2])  # held objects creep: keep off edges
                    extra = 0.03 * steep + 1.0 * max(0.035 - edge, 0.0) + 0.02 * abs(share - 0.6)
                    found.append(Grasp(pose=grasp[0], cost=grasp[1] + extra))
    return sorted(found, key=lambda grasp: grasp.cost)


def _grasp(
    points: Array, gripper: GripperFrame, at: Array, along: Array, across: Array, middle: Array
) -> tuple[Array, float] | None:
    """Return a pose and its cost; None where the object is too wide or too deep there."""
    side = np.cross(across, along)
    slab = points[np.abs((points - at) @ side) < gripper.width / 2 + 0.003]
    if len(slab) < 8:
        return None
    wide, deep = (slab - at) @ across, (slab - at) @ along
    width = float(np.ptp(wide))
    if width > gripper.opening - ROOM:
        return None
    center = at + across * 0.5 * (wide.min() + wide.max())
    reach = min(gripper.ahead - 0.008, 0.5 * float(np.ptp(deep)))  # fingertips beyond the middle
    inside = float(np.clip(0.0, deep.min() + 0.01, deep.max() - 0.01)) if np.ptp(deep) > 0.02 else 0.0
    center = center + along * (inside + reach - gripper.ahead)
    behind = float((center - middle) @ along)
    return pointing(along, across, center), 0.5 * abs(behind) + 0.2 * width


def handle_grasps(link: Link, gripper: GripperFrame) -> list[Grasp]:
    """Return grasps of the bars of a link, such as a drawer's handle or a door's lever, best first."""
    meshes = link_meshes(link)
    if not meshes:
        return []
    whole = np.concatenate([mesh.vertices for mesh in meshes])
    found: list[Grasp] = []
    for k, mesh in enumerate(meshes):
        center, axes, size = _box_of(mesh.vertices)
        if size[1] > BAR or size[0] < 1.5 * size[1]:
            continue
        others = [
            other for i, other in enumerate(meshes) if i != k and np.ptp(other.vertices, axis=0).max() > 0.1
        ]
        panel = surface_points(others, 4000) if others else whole
        away = panel - center
        away = away - (away @ axes[0])[:, None] * axes[0]
        far = np.linalg.norm(panel - center, axis=1)
        gap = float(far.min())
        if gap < 0.015:
            continue
        inward = away[far < 1.5 * gap].mean(axis=0)  # of a flat panel this is its normal
        inward = inward / np.linalg.norm(inward)
        depth = min(gripper.ahead - 0.006, gap - 0.008)  # fingertips keep clear of the panel
        for flip in (1.0, -1.0):
            across = flip * np.cross(axes[0], inward)
            pose = pointing(inward, across, center + inward * (depth - gripper.ahead))
            found.append(Grasp(pose=pose, cost=-0.2 * float(size[0]), swivel=axes[0]))
    return sorted(found, key=lambda grasp: grasp.cost)


def _box_of(points: Array) -> tuple[Array, Array, Array]:
    """Return centre, (3, 3) axes in rows and sizes of the principal box of points, longest first."""
    mean = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - mean, full_matrices=False)
    across = (points - mean) @ axes.T
    low, high = across.min(axis=0), across.max(axis=0)
    order = np.argsort(low - high)
    return mean + 0.5 * (low + high) @ axes, axes[order], (high - low)[order]
