"""External forces and torques for one step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from roboyard.errors import RoboyardError
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_pushes

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.state.physics_scene import PhysicsScene

Vector = Sequence[float]
_PLAIN = (tuple, list)


@command()
def applyExternalForce(
    client: Client, objectUniqueId: int, linkIndex: int, forceObj: Vector, posObj: Vector, flags: int
) -> None:
    """Apply a force to a point of a link (-1: the base) during the next step.

    With WORLD_FRAME, force (N) and point (m) are in the world frame; with LINK_FRAME, they are in the link's
    inertial frame. An unknown body or link is ignored.

    Raises:
        error: a vector does not have three numbers, or the flag is unknown.
    """
    if not (type(forceObj) in _PLAIN and type(posObj) in _PLAIN and len(forceObj) == len(posObj) == 3):
        forceObj = vector3(forceObj, "force needs a 3 coordinates [x,y,z].")
        posObj = vector3(posObj, "position needs a 3 coordinates [x,y,z].")
    numbers = (*forceObj, 0.0, 0.0, 0.0, *posObj)
    _push(client.scene, objectUniqueId, linkIndex, flags, 0, numbers)


@command()
def applyExternalTorque(
    client: Client, objectUniqueId: int, linkIndex: int, torqueObj: Vector, flags: int
) -> None:
    """Apply a torque (N m) to a link (-1: the base) during the next step; flags as in applyExternalForce.

    Raises:
        error: the torque does not have three numbers, or the flag is unknown.
    """
    if not (type(torqueObj) in _PLAIN and len(torqueObj) == 3):
        torqueObj = vector3(torqueObj, "torque needs a 3 coordinates [x,y,z].")
    numbers = (0.0, 0.0, 0.0, *torqueObj, 0.0, 0.0, 0.0)
    _push(client.scene, objectUniqueId, linkIndex, flags, 2, numbers)


def _push(
    scene: PhysicsScene, body: int, link: int, flags: int, at_centre: int, numbers: tuple[Any, ...]
) -> None:
    """Push a link; its axes and point are those that getLinkState shows, a step old after a step.

    Args:
        scene: the client's bodies.
        body: a body's id.
        link: -1 for the base.
        flags: WORLD_FRAME or LINK_FRAME, for all vectors.
        at_centre: 2 for a push at the centre of mass, 0 for one at a point.
        numbers: force (N), torque (N m) and point (m), three each.
    """
    record = scene.bodies.get(body)
    if record is None or record.revision != scene.world.revision or scene.world.is_stale:
        if whole(body) not in scene.bodies:
            _checked(flags, numbers)
            return
        record = scene.ready(body, "")
    if flags is not c.LINK_FRAME and flags is not c.WORLD_FRAME:
        _checked(flags, numbers)
    if not -1 <= whole(link) < record.joint_count:
        _checked(flags, numbers)
        return
    push = record.link_pusher
    if push is None:
        from roboyard.pybullet.state.bodies.link_groups import link_pusher

        push = link_pusher(scene, record)
    local = at_centre + 1 if flags == c.LINK_FRAME else at_centre
    if not push(link, local, numbers):
        raise RoboyardError(f"force, torque and point must be finite, got {numbers}")


def _checked(flags: int, numbers: Iterable[Any]) -> None:
    """Raise the error of an unknown flag, or of what is not a number."""
    if whole(flags) not in (c.WORLD_FRAME, c.LINK_FRAME):
        raise failure("flag has to be either WORLD_FRAME or LINK_FRAME", f"got flags={flags}")
    for value in numbers:
        number(value)


START.later(replace_pushes, "applyExternalForce", "applyExternalTorque")
