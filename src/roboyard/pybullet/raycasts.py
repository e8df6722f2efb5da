"""Rays, boxes and overlaps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboyard.poses import rotate
from roboyard.pybullet import constants as c
from roboyard.pybullet.arguments import number, vector3, whole
from roboyard.pybullet.commands import command
from roboyard.pybullet.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.clients import Client
    from roboyard.pybullet.records import BodyRecord
    from roboyard.pybullet.scene import Scene

Vector = Sequence[float]
Hit = tuple[int, int, float, tuple[float, ...], tuple[float, ...]]
_NOTHING = (0.0, 0.0, 0.0)
_MISS: Hit = (-1, -1, 1.0, _NOTHING, _NOTHING)
_STEP_BEHIND = 1e-5
"""Of the ray: from where the search for its next hit starts."""


@command()
def rayTest(
    client: Client,
    rayFromPosition: Vector,
    rayToPosition: Vector,
    collisionFilterMask: int = -1,
    reportHitNumber: int = -1,
) -> tuple[Hit, ...]:
    """The first surface (or the reportHitNumber-th) between two points; see rayTestBatch."""
    start = vector3(rayFromPosition, "Error in rayTest: rayFromPosition")
    end = vector3(rayToPosition, "Error in rayTest: rayToPosition")
    return _cast(
        client.scene, np.array([start]), np.array([end]), whole(collisionFilterMask), whole(reportHitNumber)
    )


@command()
def rayTestBatch(
    client: Client,
    rayFromPositions: Sequence[Vector],
    rayToPositions: Sequence[Vector],
    numThreads: int = 1,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    reportHitNumber: int = -1,
    collisionFilterMask: int = -1,
    fractionEpsilon: float = 1.0,
) -> tuple[Hit, ...]:
    """The first surface that each of k rays meets.

    Args:
        rayFromPositions: (k, 3) m in the world, or in the parent link's frame.
        rayToPositions: (k, 3) m.
        numThreads: rays here share one thread.
        parentObjectUniqueId: body that the rays move with; -1 for none.
        parentLinkIndex: its link.
        reportHitNumber: report the n-th surface instead of the first (0).
        collisionFilterMask: meet only shapes whose filter group has one of these bits.
        fractionEpsilon: hits of one ray that are nearer to one another than this count as one.

    Returns:
        for each ray: body, link, fraction, position (m), normal; (-1, -1, 1.0, zeros, zeros) for a miss.
    """
    starts, ends = _points(rayFromPositions), _points(rayToPositions)
    if len(starts) != len(ends):
        raise failure("Size of from_positions need to be equal to size of to_positions.")
    if len(starts) > c.MAX_RAY_INTERSECTION_BATCH_SIZE:
        raise failure("Number of rays exceed the maximum batch size.", f"{len(starts)} rays")
    scene = client.scene
    if whole(parentObjectUniqueId) in scene.bodies:
        record = scene.ready(parentObjectUniqueId, "")
        position, orientation = record.body.links[whole(parentLinkIndex) + 1].pose
        starts, ends = position + rotate(orientation, starts), position + rotate(orientation, ends)
    number(fractionEpsilon)
    return _cast(scene, starts, ends, whole(collisionFilterMask), whole(reportHitNumber))


@command()
def getAABB(
    client: Client, bodyUniqueId: int, linkIndex: int = -1
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Lower and upper corner (m) of the box around a link's collision shapes, in the world."""
    scene = client.scene
    if whole(bodyUniqueId) < 0:
        raise failure("getAABB failed; invalid bodyUniqueId")
    if whole(linkIndex) < -1:
        raise failure("getAABB failed; invalid linkIndex")
    record = scene.ready(bodyUniqueId, "getAABB failed.")
    if linkIndex >= record.joint_count:
        raise failure("getAABB failed.", f"body {bodyUniqueId} has no link {linkIndex}")
    lower, upper = _box(record, linkIndex)
    return tuple(lower.tolist()), tuple(upper.tolist())


@command()
def getOverlappingObjects(
    client: Client, aabbMin: Vector, aabbMax: Vector
) -> tuple[tuple[int, int], ...] | None:
    """Body and link of everything whose box overlaps a box; None for nothing."""
    low = np.array(vector3(aabbMin, "getOverlappingObjects: aabbMin"))
    high = np.array(vector3(aabbMax, "getOverlappingObjects: aabbMax"))
    scene = client.scene
    found = []
    for number_ in scene.order:
        record = scene.ready(number_, "")
        for link in range(-1, record.joint_count):
            if not record.model.links[link + 1].collisions:
                continue
            lower, upper = _box(record, link)
            if (lower <= high).all() and (upper >= low).all():
                found.append((number_, link))
    return tuple(found) or None


def _box(record: BodyRecord, link: int) -> np.ndarray:
    """(2, 3) corners of Bullet's box around a link's shapes; m."""
    bounds, margin = record.bounds(link)
    return bounds.in_world(margin, *record.to_inertial(*record.body.links[link + 1].pose, link))


def _points(values: Sequence[Vector]) -> np.ndarray:
    try:
        return np.array(values, dtype=float).reshape(-1, 3)
    except (TypeError, ValueError):
        raise failure(
            "Items in the from/to positions need to be an [x,y,z] list of 3 floats/doubles"
        ) from None


def _cast(scene: Scene, starts: np.ndarray, ends: np.ndarray, mask: int, wanted: int) -> tuple[Hit, ...]:
    """Hits of rays; they pass shapes that they start in, shapes outside the mask, and `wanted` hits."""
    if not scene.bodies or not len(starts):
        return (_MISS,) * len(starts)
    found = scene.world.rays(starts, ends)
    owners = found.owners.tolist()
    fractions, positions, normals = found.fraction.tolist(), found.position.tolist(), found.normal.tolist()
    leaving = (np.einsum("ij,ij->i", found.normal, ends - starts) > 0.0).tolist()
    hits: list[Hit] = []
    for i, (body, link) in enumerate(owners):
        if body < 0:
            hits.append(_MISS)
            continue
        number_ = scene.of_world(body).number
        hit: Hit = (number_, link - 1, fractions[i], tuple(positions[i]), tuple(normals[i]))
        if wanted > 0 or leaving[i] or not scene.filters.group_of(number_, link - 1) & mask:
            hit = _later_hit(scene, starts[i], ends[i], hit, mask, max(wanted, 0))
        hits.append(hit)
    return tuple(hits)


def _later_hit(scene: Scene, start: np.ndarray, end: np.ndarray, hit: Hit, mask: int, wanted: int) -> Hit:
    """The `wanted`-th surface (from 0) that a ray enters and the mask lets it see, from the first hit on."""
    whole_way = end - start
    while hit[0] >= 0:
        if whole_way @ hit[4] <= 0.0 and scene.filters.group_of(hit[0], hit[1]) & mask:
            if wanted == 0:
                return hit
            wanted -= 1
        fraction = hit[2] + _STEP_BEHIND
        if fraction >= 1.0:
            break
        again = scene.world.ray(start + fraction * whole_way, end)
        if again is None:
            break
        number_ = scene.of_world(again.body.id).number
        total = fraction + again.fraction * (1.0 - fraction)
        hit = (
            number_,
            again.link.index - 1,
            total,
            tuple(again.position.tolist()),
            tuple(again.normal.tolist()),
        )
    return _MISS
