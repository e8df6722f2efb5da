"""Which links may collide."""

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
    """Let two links collide, or not; unknown bodies and links are no error."""
    scene = client.scene
    a = scene.link(whole(bodyUniqueIdA), whole(linkIndexA))
    b = scene.link(whole(bodyUniqueIdB), whole(linkIndexB))
    if a is not None and b is not None and a is not b:
        scene.filters.set_pair(
            (bodyUniqueIdA, linkIndexA), (bodyUniqueIdB, linkIndexB), bool(whole(enableCollision))
        )


@command()
def setCollisionFilterGroupMask(
    client: Client, bodyUniqueId: int, linkIndexA: int, collisionFilterGroup: int, collisionFilterMask: int
) -> None:
    """Give a link a group and a mask: two links collide if each one's group has a bit of the other's mask."""
    scene = client.scene
    if scene.link(whole(bodyUniqueId), whole(linkIndexA)) is not None:
        scene.filters.set_group(
            (bodyUniqueId, linkIndexA), whole(collisionFilterGroup), whole(collisionFilterMask)
        )
