"""The simulator: a `World` of bodies on MuJoCo."""

from __future__ import annotations

from roboyard.sim.body import Body
from roboyard.sim.contacts import Contact, ContactArrays
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.sim.rays import RayHit, RayHits
from roboyard.sim.state import WorldState
from roboyard.sim.world import World

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
