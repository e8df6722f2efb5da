"""Bodies grabbed with the mouse, on a constraint between a point of the body and the mouse position."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.transforms import Array, conjugate, rotate
from roboyard.viewer.scene.drags import Drag

if TYPE_CHECKING:
    from roboyard.sim.constraints.records import Constraint
    from roboyard.sim.link import Link
    from roboyard.sim.world import World

PULL = 2.0
"""Largest impulse in a step (N s), as in PyBullet."""
LIFT = 20.0
"""Smallest force on heavy bodies per mass (m/s²)."""


class Grab:
    """One body at a time on a point-to-point constraint with a limited force.

    Drags arrive in a thread of the page's server; `apply` executes them in the thread of the world.
    """

    def __init__(self) -> None:
        """Start without a drag."""
        self._wanted: Drag | None = None
        self._start: Drag | None = None
        """Start of a drag whose constraint is not created yet."""
        self._fresh = False
        self._lock = threading.RLock()
        """Held while the drag changes."""
        self._held: tuple[World, Constraint, Link, Array] | None = None

    @property
    def is_holding(self) -> bool:
        """Whether a body is held."""
        return self._held is not None

    @property
    def drag(self) -> Drag | None:
        """The drag as it is now; None: nothing is dragged."""
        return self._wanted

    def take(self) -> tuple[Drag | None, Drag | None]:
        """Return the start of a new drag and the drag as it is now, for others who execute it.

        The start is returned once; None: no new drag, or nothing is dragged.
        """
        with self._lock:
            start, self._start, self._fresh = self._start, None, False
            return start, self._wanted

    @property
    def is_pending(self) -> bool:
        """Whether `apply` has something to do."""
        return self._fresh

    def on_drag(self, drag: Drag) -> None:
        """Store a drag event; only one page at a time can drag.

        A page does not know of a drag that was dropped: its updates count no more until the button is
        pressed again.
        """
        with self._lock:
            before = self._wanted
            if before is None and drag.phase != "start":
                return
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
        with self._lock:
            wanted = self._wanted
            if client is None or (wanted is not None and wanted.client == client):
                self._wanted, self._start, self._fresh = None, None, True

    def apply(self, world: World, time_step: float) -> None:
        """Create, move or remove the constraint; call it between two steps.

        Args:
            world: the world.
            time_step: simulated time between two calls of the thread that steps (s).
        """
        if not self._fresh:
            return
        start, drag = self.take()
        if self._held is not None and (
            self._held[0] is not world or drag is None or start is not None or self._is_removed(world)
        ):
            self._release(world)
        if drag is None:
            return
        if start is not None:
            self._attach(world, time_step, start)
        if self._held is not None:
            world.constraints.set_frame(self._held[1], "b", drag.target)

    def release(self, world: World) -> None:
        """End the drag and remove the constraint now."""
        with self._lock:  # else a press in between would be attached
            self.drop()
            self.apply(world, world.timestep)

    def arrow(self) -> Array | None:
        """Return (1, 2, 3) the grabbed point and the mouse, world frame (m); None: nothing is held."""
        held, drag = self._held, self._wanted
        if held is None or drag is None:
            return None
        position, quaternion = held[2].pose
        return np.array([[position + rotate(quaternion, held[3]), drag.target]])

    def _attach(self, world: World, time_step: float, drag: Drag) -> None:
        body = world.body_by_id.get(drag.owner[0])
        if body is None or not 0 <= drag.owner[1] < len(body.links):
            return
        link = body.links[drag.owner[1]]
        position, quaternion = link.pose
        local = rotate(conjugate(quaternion), np.array(drag.grip) - position)
        force = max(PULL / time_step, LIFT * body.mass)
        held = world.constraints.add_point(
            link, None, position_a=local, position_b=drag.target, max_force=force
        )
        self._held = world, held, link, local

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
