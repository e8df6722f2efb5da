"""The simulator: a `World` of bodies on MuJoCo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names
from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.sim.world import World

if TYPE_CHECKING:
    from roboyard.sim.queries.contacts import Contact, ContactArrays
    from roboyard.sim.queries.rays import RayHit, RayHits
    from roboyard.sim.world_state import WorldState

__getattr__ = lazy_names(
    __name__,
    {
        "Contact": "roboyard.sim.queries.contacts",
        "ContactArrays": "roboyard.sim.queries.contacts",
        "RayHit": "roboyard.sim.queries.rays",
        "RayHits": "roboyard.sim.queries.rays",
        "WorldState": "roboyard.sim.world_state",
    },
)

__all__ = [
    "Body",
    "Contact",
    "ContactArrays",
    "Joint",
    "Link",
    "RayHit",
    "RayHits",
    "World",
    "WorldState",
]
