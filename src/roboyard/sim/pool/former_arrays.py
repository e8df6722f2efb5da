"""MuJoCo's arrays of a world that another one replaces, where the new model differs in numbers only.

Programs that learn with robots of random sizes load others in each of their episodes. Their models have to be
compiled, but an MjData, and what steps made of MuJoCo's arrays, take longer to make than the numbers take to
be written into the arrays of the world before.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import NamedTuple
from roboyard.sim.pool.model_memory import array_names, memory_of

_WITHOUT = ("mesh_", "bvh_", "oct_", "name", "text_", "paths")
"""Beginnings of names of arrays of which nothing is made: triangles, trees of boxes and texts."""
_NUMBERS = frozenset({"geom_condim", "geom_priority", "geom_group"})
"""Names of integers that are no structure; nothing is made of them either."""
_SETTINGS: dict[str, tuple[str, ...]] = {}
"""Names of the fields of an MjModel's `opt` and `stat`."""


class _Layout(NamedTuple):
    """Where the arrays of a model are in its memory."""

    first: str
    """Name of the array at its beginning."""
    memory: np.ndarray
    """(n,) its bytes."""
    structure: np.ndarray
    """(n,) uint8, 255 for the bytes of integers that have to be the same, else 0."""


class FormerArrays:
    """An MjModel and its MjData that nothing else uses any more."""

    def __init__(self, model: Any, data: Any, of_arrays: dict[str, Any]) -> None:
        """Keep them.

        Args:
            model: the MjModel.
            data: its MjData.
            of_arrays: the `Engine.of_arrays` of their world.
        """
        self.model, self.data, self.of_arrays = model, data, of_arrays

    def take(self, model: Any) -> bool:
        """Give the arrays the numbers of another MjModel and its initial state, where only numbers differ.

        Only settings of the picture stay as they were.

        Returns:
            Whether that was so; else nothing was changed.
        """
        own = self.model
        if not hasattr(model, "_sizes") or model.signature != own.signature or model.nhfield or model.nflex:
            return False
        if (model._sizes != own._sizes).any():
            return False
        layout = self.of_arrays.get(_LAYOUT)
        if layout is None:
            layout = self.of_arrays[_LAYOUT] = _layout_of(own)
        if not layout:
            return False
        address = getattr(model, layout.first).__array_interface__["data"][0]
        count = len(layout.memory)
        other = np.frombuffer(memoryview((ctypes.c_uint8 * count).from_address(address)), np.uint8)
        if ((layout.memory ^ other) & layout.structure).any():
            return False
        layout.memory[:] = other
        for part in ("opt", "stat"):
            ours, theirs = getattr(own, part), getattr(model, part)
            names = _SETTINGS.get(part)
            if names is None:
                names = _SETTINGS[part] = tuple(name for name in dir(theirs) if not name.startswith("_"))
            for name in names:
                setattr(ours, name, getattr(theirs, name))
        mujoco.mj_resetData(own, self.data)
        return True


_LAYOUT = "layout of the model's memory"
"""Name in `Engine.of_arrays`."""


def _layout_of(model: Any) -> _Layout | tuple[()]:
    """Return where the arrays of an MjModel are; nothing where they are not in one block."""
    memory = memory_of(model)
    if memory is None:
        return ()
    begin, first = memory.__array_interface__["data"][0], ""
    structure = np.zeros(len(memory), np.uint8)
    for name in array_names(model):
        values = getattr(model, name)
        at = values.__array_interface__["data"][0] - begin
        if not values.size or values.flags.owndata or not 0 <= at < len(memory):
            continue
        if at == 0:
            first = name
        if values.dtype.kind != "f" and name not in _NUMBERS and not name.startswith(_WITHOUT):
            structure[at : at + values.nbytes] = 255
    return _Layout(first, memory, structure) if first else ()
