"""An empty scene: a floor only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.scenes.scene import Scene, world_or_new

if TYPE_CHECKING:
    from roboyard.sim import World


def empty(world: World | None = None) -> Scene:
    """Add an infinite chequered floor to `world` or a new world."""
    place = world_or_new(world)
    floor = place.add_plane(name="floor")
    return Scene(name="empty", world=place, bodies={"floor": floor})
