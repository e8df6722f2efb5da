"""setCollisionFilterGroupMask as machine code, for a link that has a filter which no pair depends on.

A filter that is set again is as before. The first one since a step goes to the Python function, as it changes
the order in which contacts are solved. One that lets its link meet the same links, none of which has a
filter of its own, changes no pair. Anything else goes to the Python function; see `fast_entries`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from roboyard.native.entry_parts import ATTRIBUTE, FOUND, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.state.pair_filters import DEFAULT_GROUP, STATIC_GROUP


class FilterState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    none: None = None
    whole: int = 0
    scene: str = "scene"
    filters: str = "filters"
    groups: str = "groups"
    alone: str = "alone"
    last_step: str = "last_step"
    filtered: str = "filtered"
    changes: str = "changes"


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
COMMAND, NONE, WHOLE, SCENE, FILTERS, GROUPS, ALONE, LAST_STEP, FILTERED, CHANGES = range(3, 13)
{parts(ATTRIBUTE, FOUND)}
@part
def has_64_bits(value):
    if PyLong_AsLongLong(value) == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
        return False
    return True

@part
def pair(one, other):
    made = PyTuple_New(2)
    Py_IncRef(one)
    Py_IncRef(other)
    PyTuple_SetItem(made, 0, one)
    PyTuple_SetItem(made, 1, other)
    return made

@part
def meets_moving(group, mask):
    return group != 0 or (mask & {DEFAULT_GROUP}) != 0

@part
def meets_static(group, mask):
    return (group & ~{STATIC_GROUP}) != 0 or (mask & {STATIC_GROUP}) != 0

@part
def is_set(state, given):
    for place in range(1, 5):
        if word(given[place], KIND) != word(word(state, WHOLE), KIND) or not has_64_bits(given[place]):
            return False
    scene = attribute(given[0], word(state, SCENE))
    filters = attribute(scene, word(state, FILTERS)) if scene != 0 else 0
    if filters == 0:
        return False
    groups, place = attribute(filters, word(state, GROUPS)), pair(given[1], given[2])
    filtered = attribute(attribute(scene, word(state, LAST_STEP)), word(state, FILTERED))
    old = found(groups, place) if found(filtered, place) != 0 else 0
    done = False
    if old != 0 and has_64_bits(word(old, ITEMS)) and has_64_bits(word(old, ITEMS + 1)):
        group, mask = PyLong_AsLongLong(given[3]), PyLong_AsLongLong(given[4])
        old_group, old_mask = PyLong_AsLongLong(word(old, ITEMS)), PyLong_AsLongLong(word(old, ITEMS + 1))
        done = group == old_group and mask == old_mask
        body, alone = PyLong_AsLongLong(given[1]), attribute(filters, word(state, ALONE))
        if not done and alone != word(state, NONE) and PyLong_AsLongLong(alone) == body:
            moving = meets_moving(group, mask) == meets_moving(old_group, old_mask)
            if moving and meets_static(group, mask) == meets_static(old_group, old_mask):
                new = pair(given[3], given[4])
                PyDict_SetItem(groups, place, new)
                Py_DecRef(new)
                new = PyLong_FromLongLong(PyLong_AsLongLong(attribute(filters, word(state, CHANGES))) + 1)
                PyObject_SetAttr(filters, word(state, CHANGES), new)
                Py_DecRef(new)
                done = True
    Py_DecRef(place)
    return done

def entry(state, given, count, keywords):
    if keywords == 0 and count == 5 and is_set(state, given):
        Py_IncRef(word(state, NONE))
        return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def filter_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


FILTER = Front(filter_call, EntrySignature(_SOURCE))
"""setCollisionFilterGroupMask."""
vars(filter_call)["front"] = FILTER
