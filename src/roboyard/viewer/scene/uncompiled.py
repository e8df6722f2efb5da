"""A new body on the page before MuJoCo has compiled it, so that pages draw it meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.rendering.scene import RenderShape
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.sim.queries.default_view import outermost
from roboyard.transforms import Array, quaternion_from_matrix, to_wxyz
from roboyard.viewer.scene.snapshot import Links, Snapshot, unique_paths


def with_uncompiled(
    world: World,
    before: Snapshot,
    poses: tuple[Array, Array],
    body: Body,
    joint_positions: Mapping[str, float],
) -> tuple[Snapshot, Array]:
    """Return a snapshot with one more body, which stands on the plane z = 0, and its outermost points.

    Args:
        world: the body's world.
        before: a snapshot of all other bodies.
        poses: (nbody, 3) positions (m) and (nbody, 4) quaternions w, x, y, z of their links.
        body: a body whose root link is at the origin.
        joint_positions: of its joints (rad or m); others are at zero or follow their leaders.

    Returns:
        The snapshot, and (n, 3) points of the body in the world frame (m).

    Raises:
        ValueError: the body was not added from a description.
    """
    if body.description is None:
        raise ValueError(f"body {body.name!r} has no description; add it from one")
    found = forward_kinematics(body.description, joint_positions)
    frames = np.stack([found[link.name] for link in body.links])
    shapes = tuple(look.shape for looks in world.render_shapes.of(body).values() for look in looks)
    points = np.concatenate([np.zeros((0, 3)), *(_outermost(shape, frames) for shape in shapes)])
    lowest = points[:, 2].min() if len(points) else 0.0
    frames[:, 2, 3] -= lowest
    points -= (0.0, 0.0, lowest)
    paths = unique_paths([body], taken=before.links.rows)
    rows = {owner: len(poses[0]) + owner[1] for owner in paths}
    links = Links(
        paths={**before.links.paths, **paths},
        rows={**before.links.rows, **{path: rows[owner] for owner, path in paths.items()}},
        by_owner={**before.links.by_owner, **rows},
        fixed=before.links.fixed | _fixed(body),
    )
    turns = np.array([to_wxyz(quaternion_from_matrix(frame[:3, :3])) for frame in frames])
    known = np.concatenate([poses[0], frames[:, :3, 3]]), np.concatenate([poses[1], turns])
    return replace(before, shapes=(*before.shapes, *shapes), links=links, poses=known), points


def _outermost(shape: RenderShape, frames: Array) -> Array:
    """Return (k, 3) vertices of a shape (m), given the (n, 4, 4) poses of its body's links."""
    vertices = shape.mesh.vertices
    if not len(vertices) or shape.infinite:
        return np.zeros((0, 3))
    chosen = outermost(vertices * np.asarray(shape.scale))
    frame = frames[shape.owner[1]]
    local = chosen @ np.asarray(shape.rotation, dtype=float).T + np.asarray(shape.position, dtype=float)
    return local @ frame[:3, :3].T + frame[:3, 3]


def _fixed(body: Body) -> frozenset[tuple[int, int]]:
    """Return body id and link index of the links that are fixed to the world."""
    fixed: set[tuple[int, int]] = set()
    for link in body.built.links:
        holds = body.built.free_joint is None if link.joint is None else link.joint.type == "fixed"
        if holds and (link.parent < 0 or (body.id, link.parent) in fixed):
            fixed.add((body.id, link.place))
    return frozenset(fixed)
