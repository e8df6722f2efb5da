"""getClosestPoints of two bodies, of their links and of shapes at poses, as machine code; see `fast_entries`.

The compiled search writes numbers, of which this makes tuples. Worlds in which the search does not find all,
and shapes that are not copied yet, go to the Python function.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import (
    ATTRIBUTE,
    FOUND,
    HAS_LENGTH,
    ITEM,
    NUMBER,
    NUMBER_IN,
    PLAIN,
    TRIPLE,
    parts,
)
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.closest.search import FEW, ZEROS

if TYPE_CHECKING:
    from roboyard.pybullet.fast.closest.search import ClosestSearch
    from roboyard.pybullet.state.bodies.body_records import Side

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
    none: None = None
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read


class ShapePlan(NamedTuple):
    """A query with shapes at poses; the machine code has the same order."""

    world: Any
    update: Any
    """Computes the frames of all links, where a side is a body that may have moved; else None."""
    shapes: dict[int, Any]
    """All collision shapes by id."""
    owners: tuple[Any, ...]
    """The id of each side's shape, and its owner; None twice for a body."""
    loop: Any
    arguments: tuple[Any, ...]
    """All arguments of the loop but the distance, which is that before the last two."""
    out: Any
    places: Any
    """The pairs of the last argument in one row."""
    poses: tuple[Any, Any]
    """(7,) poses that the loop reads."""
    first: tuple[Any, ...]
    """Links of the shapes of the first side."""
    second: tuple[Any, ...]
    bodies: tuple[int, ...]


_SOURCE = f"""
SIZE, ITEMS, KIND = 2, 3, 1  # of tuples and of any object, in words
COMMAND, PREPARED, TRUE, NOTHING, WHOLE, NUMBER, ANY_LINK, ZEROS, ONE, ZERO = range(3, 13)
MOVED, NONE, LISTED = range(13, 16)
WORLD, UPDATE, LOOP, SHAPES, MARGINS, OUT, PAIRS, PLACES = range(3, 11)
GEOMS, LINKS = range(3, 5)  # of a side
PLAN_WORLD, PLAN_UPDATE, PLAN_SHAPES, OWNERS, PLAN_LOOP, ARGUMENTS, PLAN_OUT, PLAN_PLACES = range(3, 11)
POSES, FIRST_LINKS, SECOND_LINKS, BODIES = range(11, 15)
TUPLE = NOTHING
{parts(ATTRIBUTE, FOUND, PLAIN, TRIPLE, NUMBER, ITEM, HAS_LENGTH, NUMBER_IN)}
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
def point(state, numbers_of, places, bodies, first, second, row):
    made, out, pairs = PyTuple_New(14), matrix(numbers_of), integers(places)
    put(made, 0, word(state, ZERO))
    put(made, 1, bodies[0])
    put(made, 2, bodies[1])
    put(made, 3, word(first, ITEMS + pairs[2 * row]))
    put(made, 4, word(second, ITEMS + pairs[2 * row + 1]))
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
def all_points(state, number, numbers_of, places, bodies, first, second):
    if number == 0:
        Py_IncRef(word(state, NOTHING))
        return word(state, NOTHING)
    if number < 0:
        return 0
    made = PyTuple_New(number)
    for row in range(number):
        PyTuple_SetItem(made, row, point(state, numbers_of, places, bodies, first, second, row))
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
    number = count_of(state, scene, first, second, given[3])
    made = all_points(
        state, number, word(scene, OUT), word(scene, PLACES), (given[1], given[2]),
        word(first, LINKS), word(second, LINKS),
    )
    Py_DecRef(first)
    Py_DecRef(second)
    return made

@part
def is_posed(state, position, turn, pose):
    total = 0.0
    for k in range(3):
        pose[k] = 0.0
        if position != word(state, NONE):
            pose[k] = number_in(state, position, k)
        total += pose[k]
    pose[3], pose[4], pose[5], pose[6] = 0.0, 0.0, 0.0, 1.0
    if turn != word(state, NONE):
        x, y = number_in(state, turn, 0), number_in(state, turn, 1)
        z, w = number_in(state, turn, 2), number_in(state, turn, 3)
        length = np.sqrt(x * x + y * y + z * z + w * w)
        if not length > 0.0:
            return False
        total += length
        pose[3], pose[4], pose[5], pose[6] = x / length, y / length, z / length, w / length
    return total - total == 0.0

@part
def are_posed(state, plan, given, count):
    for side in range(2):
        owner, place = word(word(plan, OWNERS), ITEMS + 2 * side + 1), word(state, NONE)
        if owner == place:
            continue
        if found(word(plan, PLAN_SHAPES), word(word(plan, OWNERS), ITEMS + 2 * side)) != owner:
            return False
        position = given[8 + side] if count > 8 + side else word(state, NONE)
        turn = given[10 + side] if count > 10 + side else word(state, NONE)
        if position != word(state, NONE) and not has_length(position, 3):
            return False
        if turn != word(state, NONE) and not has_length(turn, 4):
            return False
        if not is_posed(state, position, turn, numbers(word(word(plan, POSES), ITEMS + side))):
            return False
    return True

@part
def is_updated(state, plan):
    if word(plan, PLAN_UPDATE) == word(state, NONE):
        return True
    if attribute(word(plan, PLAN_WORLD), word(state, MOVED)) != word(state, TRUE):
        return True
    done = PyObject_Vectorcall(word(plan, PLAN_UPDATE), words(), 0, 0)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return True

@part
def count_of_plan(plan, limit):
    passed, arguments = words(), word(plan, ARGUMENTS)
    count = word(arguments, SIZE)
    for place in range(count - 2):
        passed[place] = word(arguments, ITEMS + place)
    passed[count - 2] = limit
    for place in range(count - 2, count):
        passed[place + 1] = word(arguments, ITEMS + place)
    done = PyObject_Vectorcall(word(plan, PLAN_LOOP), passed, count + 1, 0)
    if done == 0:
        PyErr_Clear()
        return -1
    found = PyLong_AsLongLong(done)
    Py_DecRef(done)
    return found

@part
def plan_of(state, plans, given, count):
    key, made = PyTuple_New(6), 0
    places = (1, 4, 6, 2, 5, 7)
    for k in range(6):
        value = given[places[k]] if places[k] < count else word(state, WHOLE)
        if word(value, KIND) != word(word(state, WHOLE), KIND):
            Py_DecRef(key)
            return 0
        put(key, k, value)
    made = found(plans, key)
    Py_DecRef(key)
    return made

@part
def points_of_shapes(state, plans, given, count):
    limit, plan = plain(state, given[3]), plan_of(state, plans, given, count)
    if plan == 0 or limit - limit != 0.0:
        return 0
    Py_IncRef(plan)
    made = 0
    if are_posed(state, plan, given, count) and is_updated(state, plan):
        bodies = word(plan, BODIES)
        made = all_points(
            state, count_of_plan(plan, given[3]), word(plan, PLAN_OUT), word(plan, PLAN_PLACES),
            (word(bodies, ITEMS), word(bodies, ITEMS + 1)), word(plan, FIRST_LINKS), word(plan, SECOND_LINKS),
        )
    Py_DecRef(plan)
    return made

def entry(state, given, count, keywords):
    plans = found(word(state, PREPARED), given[0]) if keywords == 0 and 4 <= count <= 12 else 0
    if plans != 0 and count > 6:
        made = points_of_shapes(state, plans, given, count)
        if made != 0:
            return made
    scene = found(plans, word(state, WHOLE)) if plans != 0 and count <= 6 else 0
    if scene != 0:
        Py_IncRef(scene)
        made = points(state, plans, scene, given, count)
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
