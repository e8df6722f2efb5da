"""getClosestPoints of two bodies, or of their links, as machine code; see `fast_entries`.

The compiled search writes numbers, of which this makes tuples. Query shapes, and worlds in which the search
does not find all, go to the Python function.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, FOUND, PLAIN, TRIPLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.closest.search import FEW, ZEROS

if TYPE_CHECKING:
    from roboyard.pybullet.fast.closest.search import ClosestSearch
    from roboyard.pybullet.state.body_records import Side

KIND = "closest"
_SCENE, _ROOM = -1, 256
"""Key of what is prepared of the whole scene, and number of pairs of shapes that a call finds at most."""


class ClosestState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    prepared: Any
    true: bool = True
    nothing: tuple[()] = ()
    whole: int = _SCENE
    number: float = 0.0
    any_link: int = -2
    zeros: tuple[float, float, float] = ZEROS
    one: int = 1
    zero: int = 0
    moved: str = "is_moved"


_SOURCE = f"""
SIZE, ITEMS, KIND = 2, 3, 1  # of tuples and of any object, in words
COMMAND, PREPARED, TRUE, NOTHING, WHOLE, NUMBER, ANY_LINK, ZEROS, ONE, ZERO, MOVED = range(3, 14)
WORLD, UPDATE, LOOP, SHAPES, MARGINS, OUT, PAIRS, PLACES = range(3, 11)
GEOMS, LINKS = range(3, 5)  # of a side
{parts(ATTRIBUTE, FOUND, PLAIN, TRIPLE)}
@part
def side_of(state, bodies, body, link):
    if word(body, KIND) != word(word(state, WHOLE), KIND):
        return 0
    if word(link, KIND) != word(word(state, WHOLE), KIND):
        return 0
    links = found(bodies, body)
    return 0 if links == 0 else found(links, link)

@part
def is_placed(state, scene, shapes):
    if attribute(word(scene, WORLD), word(state, MOVED)) != word(state, TRUE):
        return word(state, ZERO)
    if shapes <= {FEW}:
        return word(state, ONE)
    done = PyObject_Vectorcall(word(scene, UPDATE), words(), 0, 0)
    if done == 0:
        PyErr_Clear()
        return 0
    Py_DecRef(done)
    return word(state, ZERO)

@part
def count_of(state, scene, first, second, limit):
    passed = words()
    a, b = len(integers(word(first, GEOMS))), len(integers(word(second, GEOMS)))
    if a * b > len(matrix(word(scene, OUT))):
        return -1
    moved = is_placed(state, scene, a + b)
    if moved == 0:
        return -1
    passed[0], passed[1] = word(scene, SHAPES), word(scene, MARGINS)
    passed[2], passed[3], passed[4], passed[5] = word(first, GEOMS), word(second, GEOMS), limit, moved
    passed[6], passed[7] = word(scene, OUT), word(scene, PAIRS)
    done = PyObject_Vectorcall(word(scene, LOOP), passed, 8, 0)
    if done == 0:
        PyErr_Clear()
        return -1
    count = PyLong_AsLongLong(done)
    Py_DecRef(done)
    return count

@part
def put(made, place, value):
    Py_IncRef(value)
    PyTuple_SetItem(made, place, value)

@part
def point(state, scene, given, first, second, row):
    made, out, pairs = PyTuple_New(14), matrix(word(scene, OUT)), integers(word(scene, PLACES))
    put(made, 0, word(state, ZERO))
    put(made, 1, given[1])
    put(made, 2, given[2])
    put(made, 3, word(word(first, LINKS), ITEMS + pairs[2 * row]))
    put(made, 4, word(word(second, LINKS), ITEMS + pairs[2 * row + 1]))
    for k in range(3):
        PyTuple_SetItem(made, 5 + k, triple(out[row, 3 * k], out[row, 3 * k + 1], out[row, 3 * k + 2]))
    PyTuple_SetItem(made, 8, PyFloat_FromDouble(out[row, 9]))
    put(made, 9, word(state, NUMBER))
    put(made, 10, word(state, NUMBER))
    put(made, 11, word(state, ZEROS))
    put(made, 12, word(state, NUMBER))
    put(made, 13, word(state, ZEROS))
    return made

@part
def points(state, bodies, scene, given, count):
    any_link, limit = word(state, ANY_LINK), plain(state, given[3])
    if limit - limit != 0.0:
        return 0
    first = side_of(state, bodies, given[1], given[4] if count > 4 else any_link)
    second = side_of(state, bodies, given[2], given[5] if count > 5 else any_link)
    if first == 0 or second == 0:
        return 0
    Py_IncRef(first)
    Py_IncRef(second)
    number, made = count_of(state, scene, first, second, given[3]), 0
    if number == 0:
        made = word(state, NOTHING)
        Py_IncRef(made)
    elif number > 0:
        made = PyTuple_New(number)
        for row in range(number):
            PyTuple_SetItem(made, row, point(state, scene, given, first, second, row))
    Py_DecRef(first)
    Py_DecRef(second)
    return made

def entry(state, given, count, keywords):
    bodies = found(word(state, PREPARED), given[0]) if keywords == 0 and 4 <= count <= 6 else 0
    scene = found(bodies, word(state, WHOLE)) if bodies != 0 else 0
    if scene != 0:
        Py_IncRef(scene)
        made = points(state, bodies, scene, given, count)
        Py_DecRef(scene)
        if made != 0:
            return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


_MOST_SEEN = 64
"""Most sides of queries that are prepared again when a body comes or goes."""


def closest_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


CLOSEST = Front(closest_call, EntrySignature(_SOURCE))
"""getClosestPoints."""
vars(closest_call)["front"] = CLOSEST


def prepare(search: ClosestSearch, sides: tuple[tuple[int, Side], ...]) -> None:
    """Let machine code find the closest points of two sides of bodies.

    Args:
        search: of their scene.
        sides: link, -2 for all, and shapes, of which there are some.
    """
    world = search.scene.world
    known: Any = world.prepared.get(KIND)
    if known is None or world.is_stale or world.windows.is_active:
        return
    seen = search.seen
    if _SCENE not in known:
        update, room = partial(world.link_frames, keeps_last=True), search.make_room(_ROOM)
        known[_SCENE] = world, update, *search.arguments(), *room, room[1].reshape(-1)
        for (body, link), (side, entry) in list(seen.items()):  # before rows of others changed
            record = search.scene.bodies.get(body)
            if record is not None and record.sides is not None and record.sides.get(link) is side:
                known.setdefault(body, {})[link] = entry
            else:
                del seen[body, link]
    for link, side in sides:
        body = side.places[0][0]
        links = known.setdefault(body, {})
        if link not in links:
            entry = np.ascontiguousarray(side.geoms, np.int64), tuple(place[1] for place in side.places)
            links[link], seen[body, link] = entry, (side, entry)
            if len(seen) > _MOST_SEEN:
                del seen[next(iter(seen))]
