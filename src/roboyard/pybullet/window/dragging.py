"""Dragging bodies with the mouse, by a constraint between a point of the body and the mouse position."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.transforms import conjugate, rotate
from roboyard.viewer.scene.drags import Drag

if TYPE_CHECKING:
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.stepping.constraints import Constraint
    from roboyard.sim.world import World

PULL = 2.0
"""Largest impulse in a step (N s), as in PyBullet."""
LIFT = 20.0
"""Smallest force on heavy bodies per mass (m/s²)."""


class Dragging:
    """One body at a time on a point-to-point constraint with a limited force.

    Drags arrive in a thread of the page's server; `apply` executes them in the thread of the world.
    """

    def __init__(self) -> None:
        """Start without a drag."""
        self._wanted: Drag | None = None
        self._start: Drag | None = None
        """Start of a drag whose constraint is not created yet."""
        self._fresh = False
        self._held: tuple[World, Constraint] | None = None

    @property
    def is_pending(self) -> bool:
        """Whether `apply` has something to do."""
        return self._fresh

    def on_drag(self, drag: Drag) -> None:
        """Store a drag event; only one page at a time can drag."""
        before = self._wanted
        if before is not None and before.client != drag.client:
            return
        if drag.phase == "end":
            self.drop()
        elif np.isfinite((drag.grip, drag.target)).all():
            if drag.phase == "start":
                self._start = drag
            self._wanted, self._fresh = drag, True

    def drop(self, client: int | None = None) -> None:
        """End the drag; with a client number, only the drag of this client."""
        wanted = self._wanted
        if client is None or (wanted is not None and wanted.client == client):
            self._wanted, self._start, self._fresh = None, None, True

    def apply(self, scene: PhysicsScene) -> None:
        """Create, move or remove the constraint."""
        if not self._fresh:
            return
        self._fresh, drag, start = False, self._wanted, self._start
        self._start = None
        world = scene.world
        if self._held is not None and (
            self._held[0] is not world or drag is None or start is not None or self._is_removed(world)
        ):
            self._release(world)
        if drag is None:
            return
        if start is not None:
            self._attach(scene, start)
        if self._held is not None:
            world.constraints.set_frame(self._held[1], "b", drag.target)

    def _attach(self, scene: PhysicsScene, drag: Drag) -> None:
        world = scene.world
        body = world.body_by_id.get(drag.owner[0])
        if body is None or not 0 <= drag.owner[1] < len(body.links):
            return
        link = body.links[drag.owner[1]]
        position, quaternion = link.pose
        local = rotate(conjugate(quaternion), np.array(drag.grip) - position)
        force = max(PULL / scene.time_step, LIFT * body.mass)
        held = world.constraints.add_point(
            link, None, position_a=local, position_b=drag.target, max_force=force
        )
        self._held = world, held

    def _is_removed(self, world: World) -> bool:
        assert self._held is not None
        try:
            world.constraints.get(self._held[1].id)
        except RoboyardError:
            return True
        return False

    def _release(self, world: Any) -> None:
        if self._held is not None and self._held[0] is world and not self._is_removed(world):
            world.constraints.remove(self._held[1])
        self._held = None
