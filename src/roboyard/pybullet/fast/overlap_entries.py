"""getOverlappingObjects as machine code; see `fast_entries`."""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS
from roboyard.pybullet.state.frames import BROADPHASE_MARGIN
from roboyard.pybullet.state.state_kernels import write_links_in_box


class OverlapState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    prepared: Any
    none: None = None
    true: bool = True
    zero: int = 0
    """Key of what is prepared of the whole scene."""
    moved: str = "is_moved"
    old: str = "frames_are_old"
    boxes: str = "boxes_are_old"
    kept: str = "kept_frames"


_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ZERO, MOVED, OLD, BOXES_OLD, KEPT = range(3, 12)
WORLD, UPDATE, XPOS, XQUAT, FRAMES, BOXES, ROWS, REACHES = range(3, 11)
FIRST, BOX, FOUND_LINKS, OWNERS, SCENE = range(11, 16)

@part
def has_frames(state, scene):
    is_moved = attribute(word(scene, WORLD), word(state, MOVED)) == word(state, TRUE)
    owner, true = word(scene, SCENE), word(state, TRUE)
    if attribute(owner, word(state, OLD)) != true and attribute(owner, word(state, BOXES_OLD)) != true:
        return is_moved or attribute(word(scene, WORLD), word(state, KEPT)) == word(state, NONE)
    if not is_moved:
        return True
    done = PyObject_Vectorcall(word(scene, UPDATE), words(), 0, 0)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return True

@part
def overlapping(state, scene, low, high):
    ax, ay, az = item(low, 0), item(low, 1), item(low, 2)
    bx, by, bz = item(high, 0), item(high, 1), item(high, 2)
    total = ax + ay + az + bx + by + bz
    if total - total != 0.0 or not has_frames(state, scene):
        return 0
    links = integers(word(scene, FOUND_LINKS))
    count = _loop(
        matrix(word(scene, XPOS)), matrix(word(scene, XQUAT)), matrix(word(scene, FRAMES)),
        matrix(word(scene, BOXES)), integers(word(scene, ROWS)), numbers(word(scene, REACHES)),
        matrix(word(scene, FIRST)),
        ax, ay, az, bx, by, bz, {BROADPHASE_MARGIN}, numbers(word(scene, BOX)), links,
    )
    if count == 0:
        Py_IncRef(word(state, NONE))
        return word(state, NONE)
    made, owners = PyTuple_New(count), word(scene, OWNERS)
    for k in range(count):
        owner = word(owners, ITEMS + links[k])
        Py_IncRef(owner)
        PyTuple_SetItem(made, k, owner)
    return made

def entry(state, given, count, keywords):
    scene = prepared(state, given[0], word(state, ZERO)) if keywords == 0 and count == 3 else 0
    if scene != 0:
        made = 0
        Py_IncRef(scene)
        if has_length(given[1], 3) and has_length(given[2], 3):
            made = overlapping(state, scene, given[1], given[2])
        Py_DecRef(scene)
        if made != 0:
            return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
OVERLAPS = Front(write_links_in_box, EntrySignature(_SOURCE))
"""getOverlappingObjects."""
vars(OVERLAPS.core)["front"] = OVERLAPS
