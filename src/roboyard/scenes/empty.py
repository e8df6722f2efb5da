"""Nothing but a floor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.scenes.scene import Scene, world_or_new

if TYPE_CHECKING:
    from roboyard.sim import World


def empty(world: World | None = None) -> Scene:
    """An endless chequered floor, in `world` or in a new one."""
    place = world_or_new(world)
    floor = place.add_plane(name="floor")
    return Scene(name="empty", world=place, bodies={"floor": floor})
