"""Arrows of all contact forces of a world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.mass_properties import GRAVITY
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.viewer.scene.snapshot import Links

LENGTH = 0.3
"""Length (m) of the arrow of a force equal to the weight of the heaviest movable body."""
RADIUS = 0.006
"""Radius of an arrow's shaft (m)."""
RED, BLUE = (230, 40, 30), (30, 90, 230)
LEAST = 0.02
"""Shortest arrow that is drawn, as a fraction of the longest allowed one."""
LONGEST = 1.5
"""Longest arrow (m)."""


def force_arrows(world: World, links: Links) -> Array:
    """Return (k, 2, 3) start and end of the arrows of the last step's contact forces, world frame (m).

    An arrow is the force on the movable one of two links. Call it from the simulation thread.
    """
    arrays = world.contact_arrays()
    if not len(arrays.force):
        return np.zeros((0, 2, 3))
    force = np.einsum("ki,kij->kj", arrays.force, arrays.frame)
    for k, owner in enumerate(arrays.owners.tolist()):
        if (owner[2], owner[3]) in links.fixed:
            force[k] = -force[k]
    movable = [body.mass for body in world.bodies if (body.id, 0) not in links.fixed]
    weight = max([*movable, 1e-3]) * GRAVITY
    ways = LENGTH / weight * force
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    ways *= np.minimum(1.0, LONGEST / np.maximum(length, 1e-9))
    kept = length[:, 0] > LEAST * LENGTH
    return np.stack([arrays.position, arrays.position + ways], axis=1)[kept]


class ForceArrows:
    """A node with arrows; it exists while there are any."""

    def __init__(self, scene: Any, name: str = "contact forces", rgb: tuple[int, int, int] = RED) -> None:
        """Start without arrows in a `viser.SceneApi`."""
        self._scene, self._name, self._rgb = scene, name, rgb
        self._node: Any = None

    def show(self, arrows: Array | None) -> None:
        """Draw (k, 2, 3) arrows (m); None: remove them."""
        if arrows is None or not len(arrows):
            if self._node is not None:
                self._node.remove()
                self._node = None
        elif self._node is None:
            self._node = self._scene.add_arrows(
                f"/roboyard {self._name}",
                arrows.astype(np.float32),
                self._rgb,
                shaft_radius=RADIUS,
                head_radius=2.5 * RADIUS,
                head_length=5.0 * RADIUS,
            )
        else:
            self._node.points = arrows.astype(np.float32)
