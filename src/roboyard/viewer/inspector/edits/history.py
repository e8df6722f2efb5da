"""Earlier and later states of the edits, for undo and redo."""

from __future__ import annotations

from time import monotonic

from roboyard.viewer.inspector.edits.edit_state import EditState

PAUSE = 0.8
"""Changes that follow each other faster, as of a dragged handle, are one step (s)."""
MOST = 200
"""Steps that are kept."""


class History:
    """Keeps a copy of the edits before each change; `undo` and `redo` restore them in place."""

    def __init__(self, edits: EditState) -> None:
        """Start at the current state, without steps."""
        self._edits = edits
        self._now = edits.copy()
        self._before: list[EditState] = []
        self._after: list[EditState] = []
        self._last = float("-inf")

    @property
    def can_undo(self) -> bool:
        """Whether there is an earlier state."""
        return bool(self._before)

    @property
    def can_redo(self) -> bool:
        """Whether there is an undone state."""
        return bool(self._after)

    def note(self) -> bool:
        """Keep the state before a change, if there was one since the last call; returns whether there was."""
        if self._edits == self._now:
            return False
        time = monotonic()
        if time - self._last > PAUSE or not self._before:
            self._before = [*self._before[1 - MOST :], self._now]
        self._now, self._last = self._edits.copy(), time
        self._after.clear()
        return True

    def undo(self) -> bool:
        """Restore the state before the last step; returns False if there is none."""
        self.note()
        if not self._before:
            return False
        self._after.append(self._now)
        self._restore(self._before.pop())
        return True

    def redo(self) -> bool:
        """Restore the state after the last undone step; returns False if there is none."""
        self.note()
        if not self._after:
            return False
        self._before.append(self._now)
        self._restore(self._after.pop())
        return True

    def _restore(self, state: EditState) -> None:
        self._now, self._last = state, float("-inf")
        fresh, edits = state.copy(), self._edits
        edits.sensors[:] = fresh.sensors
        for mine, theirs in (
            (edits.planner_pairs, fresh.planner_pairs),
            (edits.physics_pairs, fresh.physics_pairs),
        ):
            mine.clear()
            mine.update(theirs)
        edits.spheres.clear()
        edits.spheres.update(fresh.spheres)
