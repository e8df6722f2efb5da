"""rayTest and rayTestBatch as machine code, for rays in lists; see `fast_entries`.

It reads the points into arrays, brings those that move with a link to the world, calls a compiled loop that
finds the first shape of each ray, and makes tuples of what that has written. Anything else, such as an array
of points or groups of links that have changed since, goes to the Python functions.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import PLAIN, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS
from roboyard.pybullet.fast.ray_masks import LARGEST_MASK


class RayState(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Any
    prepared: Any
    is_batch: bool
    none: None = None
    true: bool = True
    zero: int = 0
    """Also the key of what is prepared of the whole scene."""
    one: int = 1
    """Key of what is prepared for hits by numbers."""
    number: float = 0.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    moved: str = "is_moved"
    changes: str = "changes"
    base: int = -1
    """Link with which rays move by default."""
    miss: tuple[Any, ...] = (-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


_SOURCE = f"""{PARTS}
COMMAND, PREPARED, IS_BATCH, NONE, TRUE, WHOLE, ONE, NUMBER, LISTED, MOVED, CHANGES = range(3, 14)
BASE, MISS = range(14, 16)
WORLD, FILTERS, UPDATE, LOOP, SHAPES, MOST, STARTS, ENDS, GEOMS, HITS, OWNERS, RANKS, LIST = range(3, 16)
CARRY, CHAIN, PARENTS, CHANGED = range(16, 20)
FRAMES, ROWS = range(3, 5)  # of a parent
LARGEST_MASK = {LARGEST_MASK}
{parts(PLAIN)}
@part
def first_of(state, values, length):
    if word(values, KIND) == word(word(state, LISTED), KIND):
        return word(values, ITEMS) if word(values, SIZE) == length else 0
    is_tuple = word(values, KIND) == word(word(state, MISS), KIND)
    return values + 8 * ITEMS if is_tuple and word(values, SIZE) == length else 0

@part
def is_read(state, values, into, row):
    place = first_of(state, values, 3)
    if place == 0 and not has_length(values, 3):
        return False
    total = 0.0
    for k in range(3):
        into[row, k] = plain(state, word(place, k)) if place != 0 else item(values, k)
        total += into[row, k]
    return total - total == 0.0

@part
def rays_in(state, scene, given):
    starts, ends = matrix(word(scene, STARTS)), matrix(word(scene, ENDS))
    if word(state, IS_BATCH) != word(state, TRUE):
        fits = is_read(state, given[1], starts, 0) and is_read(state, given[2], ends, 0)
        return 1 if fits else 0
    count = PySequence_Size(given[1])
    if count < 0:
        PyErr_Clear()
    if count < 1 or count > len(starts):
        return 0
    for row in range(count):
        for side in range(2):
            first = first_of(state, given[1 + side], count)  # again: an item may have changed the list
            if first == 0:
                return 0
            values = word(first, row)
            Py_IncRef(values)
            fits = is_read(state, values, starts if side == 0 else ends, row)
            Py_DecRef(values)
            if not fits:
                return 0
    return count

@part
def are_numbers(state, given, count):
    is_batch = word(state, IS_BATCH) == word(state, TRUE)
    for place in range(3, count):
        kind = word(given[place], KIND)
        is_share = is_batch and place == 8 and kind == word(word(state, NUMBER), KIND)
        if not is_share and kind != word(word(state, WHOLE), KIND):
            return False
    return True

@part
def prepared_for(state, given, count, wanted):
    place, mask = 7 if word(state, IS_BATCH) == word(state, TRUE) else 3, -1
    if place < count:
        mask = PyLong_AsLongLong(given[place])
        if mask == -1 and PyErr_Occurred() != 0:
            PyErr_Clear()
            return 0
    if mask == -1:
        return prepared(state, given[0], word(state, WHOLE if wanted == 0 else ONE))
    if abs(mask) > LARGEST_MASK:
        return 0
    key = PyLong_FromLongLong(2 * (mask + 1) + (0 if wanted == 0 else 1))  # `key_of`
    scene = prepared(state, given[0], key)
    Py_DecRef(key)
    return scene

@part
def are_carried(state, scene, given, count, rays):
    if word(state, IS_BATCH) != word(state, TRUE) or count < 5 or plain(state, given[4]) == -1.0:
        return True
    parent = found(word(scene, PARENTS), given[4])
    if parent == 0:
        return False
    passed, made = words(), PyLong_FromLongLong(rays)
    passed[0], passed[1], passed[2] = word(scene, CHAIN), word(parent, FRAMES), word(parent, ROWS)
    passed[3] = given[5] if count > 5 else word(state, BASE)
    passed[4], passed[5], passed[6] = word(scene, STARTS), word(scene, ENDS), made
    done = PyObject_Vectorcall(word(scene, CARRY), passed, 7, 0)
    Py_DecRef(made)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return True

@part
def triple(values, row, first):
    made = PyTuple_New(3)
    for k in range(3):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(values[row, first + k]))
    return made

@part
def hit(state, scene, row):
    geoms, hits = integers(word(scene, GEOMS)), matrix(word(scene, HITS))
    if geoms[row] < 0:
        Py_IncRef(word(state, MISS))
        return word(state, MISS)
    owners, made = integers(word(scene, OWNERS)), PyTuple_New(5)
    PyTuple_SetItem(made, 0, PyLong_FromLongLong(owners[2 * geoms[row]]))
    PyTuple_SetItem(made, 1, PyLong_FromLongLong(owners[2 * geoms[row] + 1]))
    PyTuple_SetItem(made, 2, PyFloat_FromDouble(hits[row, 0]))
    PyTuple_SetItem(made, 3, triple(hits, row, 1))
    PyTuple_SetItem(made, 4, triple(hits, row, 4))
    return made

@part
def number_of(state, given, count):
    place = 6 if word(state, IS_BATCH) == word(state, TRUE) else 4
    if place >= count:
        return 0
    made = PyLong_AsLongLong(given[place])
    if made == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
    return 0 if made < 0 else given[place]

@part
def is_cast(state, scene, rays, wanted):
    passed = words()
    if attribute(word(scene, WORLD), word(state, MOVED)) == word(state, TRUE):
        done = PyObject_Vectorcall(word(scene, UPDATE), passed, 0, 0)
        if done == 0:
            PyErr_Clear()
            return False
        Py_DecRef(done)
    made = PyLong_FromLongLong(rays)
    passed[0], passed[1], passed[2] = word(scene, SHAPES), made, word(scene, MOST)
    if wanted != 0:
        passed[3], passed[4], passed[5] = wanted, word(scene, RANKS), word(scene, LIST)
    done = PyObject_Vectorcall(word(scene, LOOP), passed, 3 if wanted == 0 else 6, 0)
    Py_DecRef(made)
    if done == 0:
        PyErr_Clear()
        return False
    entered = PyLong_AsLongLong(done)
    Py_DecRef(done)
    return entered >= 0

def entry(state, given, count, keywords):
    fits = keywords == 0 and 3 <= count <= (9 if word(state, IS_BATCH) == word(state, TRUE) else 5)
    scene = wanted = 0
    if fits and are_numbers(state, given, count):
        wanted = number_of(state, given, count)
        scene = prepared_for(state, given, count, wanted)
    if scene != 0:
        changes = attribute(word(scene, FILTERS), word(state, CHANGES))
        Py_IncRef(scene)
        is_same = changes != 0 and PyLong_AsLongLong(changes) == PyLong_AsLongLong(word(scene, CHANGED))
        rays = rays_in(state, scene, given) if is_same else 0
        if rays > 0 and not are_carried(state, scene, given, count, rays):
            rays = 0
        if rays > 0 and is_cast(state, scene, rays, wanted):
            made = PyTuple_New(rays)
            for row in range(rays):
                PyTuple_SetItem(made, row, hit(state, scene, row))
            Py_DecRef(scene)
            return made
        Py_DecRef(scene)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def ray_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


RAYS = Front(ray_call, EntrySignature(_SOURCE))
"""rayTest and rayTestBatch."""
vars(ray_call)["front"] = RAYS
