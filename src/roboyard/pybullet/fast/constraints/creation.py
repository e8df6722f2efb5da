"""createConstraint and removeConstraint as machine code; see `fast_entries`.

A constraint of plain numbers becomes a request, which the scene builds when it next steps or reads
constraints. One that is removed before was only an entry in a dictionary. Gears of joints that cannot have
any, and slides without an axis, go to the Python function, which raises the error.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import (
    ATTRIBUTE,
    FOUND,
    HAS_LENGTH,
    ITEM,
    NUMBER,
    NUMBER_IN,
    PLAIN,
    parts,
)
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.state.constraint_records import DEFAULT_MAX_FORCE, IDENTITY


class CreationState(NamedTuple):
    """State of createConstraint; the machine code has the same order."""

    command: Any
    none: None = None
    true: bool = True
    whole: int = -1
    """The world as a body."""
    number: float = 0.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    joined: tuple[Any, ...] = ()
    scene: str = "scene"
    bodies: str = "bodies"
    joints: str = "joint_count"
    requested: str = "requested"
    ids: str = "constraint_ids"
    following: str = "_next"
    world: str = "world"
    moved: str = "is_moved"
    velocity_moved: str = "_velocity_moved"
    scalar: str = "is_scalar"
    identity: tuple[float, ...] = IDENTITY
    order: str = "constraint_order"
    rest: tuple[Any, ...] = (DEFAULT_MAX_FORCE, 0.0, 0, 0.0, 0.0, None)
    """The fields of a request after those that are given."""


_CREATION = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words
COMMAND, NONE, TRUE, WHOLE, NUMBER, LISTED, JOINED, SCENE, BODIES, JOINTS = range(3, 13)
REQUESTED, IDS, NEXT, WORLD, MOVED, VELOCITY_MOVED, SCALAR, IDENTITY, ORDER, REST = range(13, 23)
GIVEN, FIRST_VECTOR, FIRST_TURN = 10, 5, 8  # arguments after the client
TUPLE = JOINED
{parts(ATTRIBUTE, FOUND, PLAIN, ITEM, HAS_LENGTH, NUMBER, NUMBER_IN)}
@part
def has_link(state, bodies, body, link):
    record = found(bodies, body)
    if record == 0:
        return False
    place = PyLong_AsLongLong(link)
    if place == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
        return False
    return -1 <= place < PyLong_AsLongLong(attribute(record, word(state, JOINTS)))

@part
def has_scalar_joint(state, bodies, body, link):
    if not has_link(state, bodies, body, link) or PyLong_AsLongLong(link) < 0:
        return False
    scalar = attribute(found(bodies, body), word(state, SCALAR))  # a list
    return scalar != 0 and word(word(scalar, ITEMS), PyLong_AsLongLong(link)) == word(state, TRUE)

@part
def vector_of_sequence(values, length):
    if not has_length(values, length):
        return 0
    made, total = PyTuple_New(length), 0.0
    for place in range(length):
        size = item(values, place)
        total += size * size
        PyTuple_SetItem(made, place, PyFloat_FromDouble(size))
    if total < 1e100:
        return made
    Py_DecRef(made)
    return 0

@part
def vector(state, values, length):
    is_tuple = word(values, KIND) == word(word(state, JOINED), KIND)
    if not is_tuple and word(values, KIND) != word(word(state, LISTED), KIND):
        return vector_of_sequence(values, length)
    if word(values, SIZE) != length:
        return 0
    made, total = PyTuple_New(length), 0.0
    for place in range(length):
        value = held(state, values, place)
        size = plain(state, value) if value != 0 else np.nan
        if size != size:
            size, value = number_in(state, values, place), 0  # whose function may free the object
        total += size * size
        if value != 0 and word(value, KIND) == word(word(state, NUMBER), KIND):
            Py_IncRef(value)
        elif size == 0.0 and 1.0 / size > 0.0:  # the most frequent number
            value = word(state, NUMBER)
            Py_IncRef(value)
        else:
            value = PyFloat_FromDouble(size)
        PyTuple_SetItem(made, place, value)
    if total < 1e100:
        return made
    Py_DecRef(made)
    return 0

@part
def field(state, given, count, place):
    if place < FIRST_VECTOR:
        value = given[place + 1]
    elif place < FIRST_TURN:
        return vector(state, given[place + 1], 3)
    elif place < GIVEN:
        if place + 1 < count and given[place + 1] != word(state, NONE):
            return vector(state, given[place + 1], 4)
        value = word(state, IDENTITY)
    else:
        value = word(word(state, REST), ITEMS + place - GIVEN)
    Py_IncRef(value)
    return value

@part
def mark(state, owner, name):
    if attribute(owner, name) != word(state, TRUE):
        PyObject_SetAttr(owner, name, word(state, TRUE))

@part
def request(state, given, count):
    size = GIVEN + word(word(state, REST), SIZE)
    made = PyList_New(size)
    for place in range(size):
        value = field(state, given, count, place)
        if value == 0:
            Py_DecRef(made)
            return 0
        PyList_SetItem(made, place, value)
    return made

@part
def has_ends(state, bodies, given):
    for place in range(1, 6):
        if word(given[place], KIND) != word(word(state, WHOLE), KIND):
            return False
    kind = PyLong_AsLongLong(given[5])
    if kind == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
    if kind == {c.JOINT_GEAR}:
        return has_scalar_joint(state, bodies, given[1], given[2]) and has_scalar_joint(
            state, bodies, given[3], given[4]
        )
    if kind != {c.JOINT_FIXED} and kind != {c.JOINT_POINT2POINT} and kind != {c.JOINT_PRISMATIC}:
        return False
    if kind == {c.JOINT_PRISMATIC}:
        x, y, z = item(given[6], 0), item(given[6], 1), item(given[6], 2)
        size = x * x + y * y + z * z
        if not 0.0 < size < 1e100:
            return False
    if not has_link(state, bodies, given[1], given[2]):
        return False
    return given[3] == word(state, WHOLE) or has_link(state, bodies, given[3], given[4])

def entry(state, given, count, keywords):
    fits = keywords == 0 and 9 <= count <= 11
    scene = attribute(given[0], word(state, SCENE)) if fits else 0
    made = 0
    if scene != 0:
        bodies = attribute(scene, word(state, BODIES))
        Py_IncRef(scene)  # reading a number may reset the simulation
        Py_IncRef(bodies)
        if has_ends(state, bodies, given):
            made = request(state, given, count)
        Py_DecRef(bodies)
        if made != 0 and attribute(given[0], word(state, SCENE)) != scene:
            Py_DecRef(made)
            made = 0
    if made == 0:
        if scene != 0:
            Py_DecRef(scene)
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    ids = attribute(scene, word(state, IDS))
    number = attribute(ids, word(state, NEXT))
    Py_IncRef(number)
    following = PyLong_FromLongLong(PyLong_AsLongLong(number) + 1)
    PyObject_SetAttr(ids, word(state, NEXT), following)
    Py_DecRef(following)
    PyDict_SetItem(attribute(scene, word(state, REQUESTED)), number, made)
    Py_DecRef(made)
    PyList_Append(attribute(scene, word(state, ORDER)), number)
    world = attribute(scene, word(state, WORLD))
    mark(state, world, word(state, MOVED))
    mark(state, world, word(state, VELOCITY_MOVED))
    Py_DecRef(scene)
    return number
"""


def creation_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


CREATION = Front(creation_call, EntrySignature(_CREATION))
"""createConstraint."""


class RemovalState(NamedTuple):
    """State of removeConstraint; the machine code has the same order."""

    command: Any
    none: None = None
    whole: int = 0
    scene: str = "scene"
    requested: str = "requested"
    order: str = "constraint_order"


_REMOVAL = f"""
KIND, ITEMS = 1, 3  # of any object and of lists, in words
COMMAND, NONE, WHOLE, SCENE, REQUESTED, ORDER = range(3, 9)
{parts(ATTRIBUTE, FOUND)}
@part
def drop(order, number):
    last = PyList_Size(order) - 1
    for place in range(last, -1, -1):
        if PyLong_AsLongLong(word(word(order, ITEMS), place)) == number:
            if place < last:
                moved = word(word(order, ITEMS), last)
                Py_IncRef(moved)
                PyList_SetItem(order, place, moved)
            PyList_SetSlice(order, last, last + 1, 0)
            return

def entry(state, given, count, keywords):
    fits = keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, WHOLE), KIND)
    scene = attribute(given[0], word(state, SCENE)) if fits else 0
    requested = attribute(scene, word(state, REQUESTED)) if scene != 0 else 0
    if requested == 0 or found(requested, given[1]) == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    PyDict_DelItem(requested, given[1])
    drop(attribute(scene, word(state, ORDER)), PyLong_AsLongLong(given[1]))
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def removal_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


REMOVAL = Front(removal_call, EntrySignature(_REMOVAL))
"""removeConstraint."""

for _front in (CREATION, REMOVAL):
    vars(_front.core)["front"] = _front
