"""Dragging bodies with the mouse: while a shape is held, a point of it is tied to where the mouse is."""

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
"""N s that a step may pull with; PyBullet's bound"""
LIFT = 20.0
"""m/s²: heavy bodies are pulled with at least their mass times this"""


class Dragging:
    """One body at a time on a point-to-point constraint with a bounded force.

    Drags come in a thread of the page's server; `apply`, in one that may touch the world, acts on them.
    """

    def __init__(self) -> None:
        self._wanted: Drag | None = None
        self._start: Drag | None = None
        """Of the drag whose body is still to be taken hold of."""
        self._fresh = False
        self._held: tuple[World, Constraint] | None = None

    @property
    def is_pending(self) -> bool:
        """Whether `apply` has something to do."""
        return self._fresh

    def hear(self, drag: Drag) -> None:
        """Someone drags, or lets go."""
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
        """Let go; with a client's number given only what this one holds."""
        wanted = self._wanted
        if client is None or (wanted is not None and wanted.client == client):
            self._wanted, self._start, self._fresh = None, None, True

    def apply(self, scene: PhysicsScene) -> None:
        """Take hold, pull along or let go."""
        if not self._fresh:
            return
        self._fresh, drag, start = False, self._wanted, self._start
        self._start = None
        world = scene.world
        if self._held is not None and (
            self._held[0] is not world or drag is None or start is not None or self._is_gone(world)
        ):
            self._let_go(world)
        if drag is None:
            return
        if start is not None:
            self._take_hold(scene, start)
        if self._held is not None:
            world.constraints.set_frame(self._held[1], "b", drag.target)

    def _take_hold(self, scene: PhysicsScene, drag: Drag) -> None:
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

    def _is_gone(self, world: World) -> bool:
        assert self._held is not None
        try:
            world.constraints.get(self._held[1].id)
        except RoboyardError:
            return True
        return False

    def _let_go(self, world: Any) -> None:
        if self._held is not None and self._held[0] is world and not self._is_gone(world):
            world.constraints.remove(self._held[1])
        self._held = None
