"""Replacing commands by machine code once a program has called many; see `fast_entries`."""

from __future__ import annotations

from typing import Any

from roboyard.native.builtin import bound_function
from roboyard.native.fronts import Front
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.direct_calls import PREPARED, START


def replace_pushes(compiles: bool) -> None:
    """Replace applyExternalForce and applyExternalTorque."""
    from roboyard.pybullet.fast.fast_entries import PUSH

    names = "is_moved", "frames_are_old", "kept_frames", "pending", "pushed"
    _replace("applyExternalForce", PUSH, "push", (*names, True), compiles=compiles)
    _replace("applyExternalTorque", PUSH, "push", (*names, False), compiles=compiles)


def replace_boxes(compiles: bool) -> None:
    """Replace getAABB."""
    from roboyard.pybullet.fast.fast_entries import BOX

    _replace("getAABB", BOX, "box", ("is_moved",), compiles=compiles)


def _replace(name: str, front: Front, kind: str, words: tuple[Any, ...], *, compiles: bool) -> None:
    """Replace a command where its machine code is stored, or may be compiled.

    Args:
        name: of the command.
        front: its entry.
        kind: of what is prepared.
        words: further objects of the entry's state.
        compiles: whether machine code may be compiled that is not stored.
    """
    address = front.address() if front.is_stored or (compiles and front.is_cheap) else 0
    if address:
        state = (COMMANDS[name].function, PREPARED[kind], None, True, 1, *words)
        START.replace(name, bound_function(name, address, state))
