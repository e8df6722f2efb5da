"""Replacing commands by machine code once a program has called many; see `fast_entries`."""

from __future__ import annotations

from itertools import count
from typing import Any

from roboyard._lazy import LazyLogger
from roboyard.native.builtin import bound_function
from roboyard.native.fronts import Front
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.direct_calls import MOST, PREPARED, START

_log = LazyLogger("roboyard")


def replace_pushes() -> None:
    """Replace applyExternalForce and applyExternalTorque."""
    from roboyard.pybullet.fast.fast_entries import PUSH

    names = "is_moved", "frames_are_old", "kept_frames", "pending", "pushed"
    _replace("applyExternalForce", PUSH, "push", (*names, True))
    _replace("applyExternalTorque", PUSH, "push", (*names, False))


def replace_boxes() -> None:
    """Replace getAABB."""
    from roboyard.pybullet.fast.fast_entries import BOX

    _replace("getAABB", BOX, "box", ("is_moved",))


def replace_motors() -> None:
    """Replace setJointMotorControlArray."""
    from roboyard.pybullet.fast.fast_entries import MOTORS

    words = "pending", "time_step"
    _replace("setJointMotorControlArray", MOTORS, "motors", words)


def replace_dynamics() -> None:
    """Replace calculateInverseDynamics and calculateMassMatrix."""
    from roboyard.pybullet.fast.tree_entries import TREE

    names = "_applied_revision", "revision"
    _replace("calculateInverseDynamics", TREE, "efforts", (*names, False), one=0)
    _replace("calculateMassMatrix", TREE, "masses", (*names, True), one=0)


def is_machine_code(name: str) -> bool:
    """Return whether a command is machine code as a whole."""
    return name in _machine_code


_machine_code: set[str] = set()


def _replace(name: str, front: Front, kind: str, words: tuple[Any, ...], *, one: int = 1) -> None:
    """Replace a command by stored machine code; without any, compile it after many calls of the command.

    Args:
        name: of the command.
        front: its entry.
        kind: of what is prepared.
        words: further objects of the entry's state.
        one: whole number in its state.
    """
    function, calls = COMMANDS[name].function, count(1)

    def load() -> None:
        address = front.address()
        if address:
            state = (function, PREPARED[kind], None, True, one, *words)
            START.replace(name, bound_function(name, address, state))
            _machine_code.add(name)

    def counted(*given: Any) -> Any:
        if next(calls) == MOST:
            START.replace(name, function)
            if front.is_cheap:
                _log.warning("compiling %s for this machine: once, about 5 seconds", name)
                load()
        return function(*given)

    if front.is_stored:
        load()
    else:
        START.replace(name, counted)
