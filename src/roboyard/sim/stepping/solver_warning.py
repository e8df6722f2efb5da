"""Warnings of MuJoCo's solver during a step, kept by thread; others are logged."""

from __future__ import annotations

from _thread import _local, get_ident

from roboyard._lazy import LazyLogger
from roboyard._mujoco import mujoco

log = LazyLogger("roboyard.simulation")


RAISED: dict[int, bool] = {}
"""The threads in which there is a warning, by their numbers."""


class _SolverWarning(_local):
    """The warning of MuJoCo during the step of this thread."""

    is_raised: bool = False
    message: str | None = None
    lacks_memory: bool = False
    """Whether contacts were dropped for lack of memory."""

    def begin(self) -> None:
        """Note that there is a warning."""
        self.is_raised = RAISED[get_ident()] = True

    def end(self) -> None:
        """Note that what it requires is done."""
        self.is_raised = False
        RAISED.pop(get_ident(), None)


solver_warning = _SolverWarning()


def _on_warning(message: str) -> None:
    if "unstable" in message:
        solver_warning.begin()
        solver_warning.message = solver_warning.message or message  # where it began
    elif "arena memory" in message:
        solver_warning.begin()
        solver_warning.lacks_memory = True
    else:
        log.warning("MuJoCo: %s", message)


mujoco.set_mju_user_warning(_on_warning)
