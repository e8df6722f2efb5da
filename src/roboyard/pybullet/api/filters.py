"""Collision filters: setCollisionFilterPair and setCollisionFilterGroupMask."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.pybullet.face.arguments import whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.fast.fast_commands import replace_filters

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
        scene.last_step.filtered.update({first: None, second: None})
    for body in (bodyUniqueIdA, bodyUniqueIdB):
        scene.filters.refresh(whole(body))


@command()
def setCollisionFilterGroupMask(
    client: Client, bodyUniqueId: int, linkIndexA: int, collisionFilterGroup: int, collisionFilterMask: int
) -> None:
    """Set the group and mask of a link; two links collide if a group shares a bit with the other's mask."""
    scene, group, mask = client.scene, collisionFilterGroup, collisionFilterMask
    if not type(bodyUniqueId) is type(linkIndexA) is type(group) is type(mask) is int:
        bodyUniqueId, linkIndexA, group, mask = map(whole, (bodyUniqueId, linkIndexA, group, mask))
    record, place = scene.bodies.get(bodyUniqueId), (bodyUniqueId, linkIndexA)
    if record is not None and -1 <= linkIndexA < record.joint_count:
        scene.filters.set_group(place, group, mask)
        scene.last_step.filtered[place] = None


START.later(replace_filters, "setCollisionFilterGroupMask")
