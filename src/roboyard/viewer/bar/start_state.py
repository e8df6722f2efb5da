"""The state to which the button *reset* returns."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.sim.world_state import WorldState


class StartState:
    """The state of a world after bodies were last added or removed."""

    def __init__(self) -> None:
        """Start without a state."""
        self._world: World | None = None
        self._revision = -1
        self._state: WorldState | None = None

    def keep(self, world: World, *, is_held: bool) -> None:
        """Save the state of a changed world; call it in the thread that steps, between two steps.

        Args:
            world: the compiled world.
            is_held: whether a page holds a body, on a constraint that will be removed.
        """
        if world is self._world and (world.revision == self._revision or is_held):
            return
        now = world.save_state()
        before = self._state
        fits = (
            world is self._world
            and before is not None
            and before.signature == now.signature
            and len(before.values) == len(now.values)
        )
        self._world, self._revision = world, world.revision
        if not fits:
            self._state = now

    def restore(self, world: World) -> bool:
        """Restore the state; returns whether there is one of this world."""
        if self._state is None or world is not self._world:
            return False
        world.restore_state(self._state)
        return True
