"""Collision filters: setCollisionFilterPair and setCollisionFilterGroupMask."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import whole
from roboyard.pybullet.face.commands import command

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client


@command()
def setCollisionFilterPair(
    client: Client,
    bodyUniqueIdA: int,
    bodyUniqueIdB: int,
    linkIndexA: int,
    linkIndexB: int,
    enableCollision: int,
) -> None:
    """Enable or disable collisions of two links; unknown bodies and links are ignored."""
    scene = client.scene
    a = scene.link(whole(bodyUniqueIdA), whole(linkIndexA))
    b = scene.link(whole(bodyUniqueIdB), whole(linkIndexB))
    if a is not None and b is not None and a is not b:
        first, second = (bodyUniqueIdA, linkIndexA), (bodyUniqueIdB, linkIndexB)
        scene.filters.set_pair(first, second, bool(whole(enableCollision)))
        scene.last_step.filtered.update((first, second))


@command()
def setCollisionFilterGroupMask(
    client: Client, bodyUniqueId: int, linkIndexA: int, collisionFilterGroup: int, collisionFilterMask: int
) -> None:
    """Set the group and mask of a link; two links collide if a group shares a bit with the other's mask."""
    scene = client.scene
    if scene.link(whole(bodyUniqueId), whole(linkIndexA)) is not None:
        place = bodyUniqueId, linkIndexA
        scene.filters.set_group(place, whole(collisionFilterGroup), whole(collisionFilterMask))
        scene.last_step.filtered.add(place)
