"""The first half of a step without rows, in one call of MuJoCo's functions."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

from roboyard._mujoco import mujoco
from roboyard.native import c_function, can_call, compiled
from roboyard.native.views import integers_at, numbers_at
from roboyard.sim.mujoco_library import mujoco_library, stored_numbers

NO_ROWS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
_FLAGS = 0x2A5A5A
"""A number that no model has as its flags."""
_OPTIONS = 400
"""Bytes after the gravity in which the flags are looked for."""

mj_step1 = c_function("mj_step1", "i8 i8 -> i8", library=mujoco_library)
mj_collision = c_function("mj_collision", "i8 i8 -> i8", library=mujoco_library)
mj_makeM = c_function("mj_makeM", "i8 i8 -> i8", library=mujoco_library)
mj_factorM = c_function("mj_factorM", "i8 i8 -> i8", library=mujoco_library)
mj_fwdVelocity = c_function("mj_fwdVelocity", "i8 i8 -> i8", library=mujoco_library)


@compiled("i8 i8 i8 i8 i8 i8 i8 i8 i8 i8 i8", library=mujoco_library)
def find_contacts(  # pragma: no cover
    model, data, flags, lengths, moves, count, welds, freedoms, others, bodies, more
):
    """Compute all that mj_step1 does, and contacts, but no rows.

    model, data: addresses of MjModel and MjData. flags: address of what is disabled. lengths: address of
    `Engine.axis_lengths`, moves: of `cdof`, for so many degrees of freedom; none where all are 1. welds,
    freedoms: addresses of the bodies to which bodies are fixed, and of numbers of their degrees of freedom.
    others: of `touching_welds`, which take their place while contacts are found; of no bodies where these
    are the same. more: flags besides while contacts are found.
    """
    disabled = integers_at(flags, 1)
    kept = disabled[0]
    disabled[0] = kept | NO_ROWS
    mj_step1(model, data)
    if count > 0:
        length, move = numbers_at(lengths, count), numbers_at(moves, 6 * count)
        for dof in range(count):
            for k in range(6 * dof, 6 * dof + 6):
                move[k] *= length[dof]
        mj_makeM(model, data)
        mj_factorM(model, data)
        mj_fwdVelocity(model, data)
    disabled[0] = kept
    collide_with(model, data, disabled, welds, freedoms, others, bodies, more)


@compiled("i8 i8 i8 i8 i8 i8 i8 i8 i8 i8 i8", library=mujoco_library)
def collide(  # pragma: no cover
    model, data, flags, lengths, moves, count, welds, freedoms, others, bodies, more
):
    """Compute contacts of bodies whose positions are known; the arguments are those of `find_contacts`."""
    collide_with(model, data, integers_at(flags, 1), welds, freedoms, others, bodies, more)


def collide_with(model, data, disabled, welds, freedoms, others, bodies, more):
    """Compute contacts with further flags and other numbers of bodies, which are put back then."""
    kept = disabled[0]
    disabled[0] = kept | more
    if bodies > 0:
        swap(welds, freedoms, others, bodies)
    mj_collision(model, data)
    if bodies > 0:
        swap(welds, freedoms, others, bodies)
    disabled[0] = kept


def swap(welds, freedoms, others, bodies):
    """Exchange the numbers of bodies at two addresses with those at a third one."""
    one, two, other = (
        integers_at(welds, bodies),
        integers_at(freedoms, bodies),
        integers_at(others, 2 * bodies),
    )
    for k in range(bodies):
        one[k], other[k] = other[k], one[k]
        two[k], other[bodies + k] = other[bodies + k], two[k]


@cache
def flags_place() -> int:
    """Return bytes from a model's gravity to its flags; -1 where they cannot be found, or not called with."""
    if not can_call(mujoco_library):
        return -1
    numbers = stored_numbers("flags", _find_flags)
    return numbers[0] if len(numbers) == 1 else -1


def _find_flags() -> list[int]:
    from array import array

    model: Any = mujoco.MjModel.from_xml_string("<mujoco/>")
    if not hasattr(model, "_address"):
        return []
    model.opt.disableflags = _FLAGS
    words = array("i", ctypes.string_at(model.opt.gravity.ctypes.data, _OPTIONS))
    return [4 * k for k, value in enumerate(words) if value == _FLAGS]
