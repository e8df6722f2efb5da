"""Warnings of MuJoCo's solver during a step, kept by thread; others are logged."""

from __future__ import annotations

from _thread import _local

from roboyard._lazy import LazyLogger
from roboyard._mujoco import mujoco

log = LazyLogger("roboyard.simulation")


class _SolverWarning(_local):
    """The warning of MuJoCo during the step of this thread."""

    is_raised: bool = False
    message: str | None = None
    lacks_memory: bool = False
    """Whether contacts were dropped for lack of memory."""


solver_warning = _SolverWarning()


def _on_warning(message: str) -> None:
    if "unstable" in message:
        solver_warning.is_raised = True
        solver_warning.message = solver_warning.message or message  # where it began
    elif "arena memory" in message:
        solver_warning.is_raised = solver_warning.lacks_memory = True
    else:
        log.warning("MuJoCo: %s", message)


mujoco.set_mju_user_warning(_on_warning)
