"""The simulator: a `World` of bodies on MuJoCo."""

from __future__ import annotations

from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.sim.queries.contacts import Contact, ContactArrays
from roboyard.sim.queries.rays import RayHit, RayHits
from roboyard.sim.world import World
from roboyard.sim.world_state import WorldState

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
