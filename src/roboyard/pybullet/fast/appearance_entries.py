"""changeVisualShape and its old name as machine code; see `fast_entries`.

Each change waits in the World until the shapes are rendered or read. Unknown bodies, other lengths of colours
and textures of bodies that have no ids yet go to the Python function.
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
    WHOLE,
    parts,
)
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature


class AppearanceState(NamedTuple):
    """State of the commands; the machine code has the same order."""

    command: Any
    none: None = None
    whole: int = -1
    """The default of the index of a shape: all."""
    number: float = 0.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    scene: str = "scene"
    bodies: str = "bodies"
    joints: str = "joint_count"
    colors: str = "colors"
    body: str = "body"
    ids: str = "id"
    world: str = "world"
    shapes: str = "render_shapes"
    changes: str = "_changes"
    ordered: str = "_are_in_order"
    true: bool = True
    textures: str = "textures"
    pending: str = "_pending"
    images: str = "_images"
    color: str = "rgba"
    specular: str = "specular"
    texture: str = "texture"
    joined: tuple[()] = ()
    """Of which the type is read."""


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words
COMMAND, NONE, WHOLE, NUMBER, LISTED, SCENE, BODIES, JOINTS, COLORS, BODY, IDS, WORLD = range(3, 15)
SHAPES, CHANGES, ORDERED, TRUE, TEXTURES, PENDING, IMAGES, COLOR, SPECULAR, TEXTURE, TUPLE = range(15, 26)
GIVEN_SHAPE, GIVEN_TEXTURE, GIVEN_COLOR, GIVEN_SPECULAR, MOST = 3, 4, 5, 6, 8  # arguments with the client
{parts(ATTRIBUTE, FOUND, WHOLE, NUMBER, PLAIN, ITEM, HAS_LENGTH, NUMBER_IN)}
@part
def argument(state, given, count, place):
    return given[place] if place < count else word(state, NONE)

@part
def fits(state, given, count):
    for place in range(1, min(count, 5)):
        if word(given[place], KIND) != word(word(state, WHOLE), KIND):
            return False
    if count > GIVEN_SHAPE and whole(given[GIVEN_SHAPE]) < -1:
        return False
    for place in range(GIVEN_COLOR, GIVEN_SPECULAR + 1):
        values, total = argument(state, given, count, place), 0.0
        if values != word(state, NONE):
            length = 4 if place == GIVEN_COLOR else 3
            if not has_length(values, length):
                return False
            for k in range(length):
                total += number_in(state, values, k)
        if total - total != 0.0:
            return False
    return True

@part
def change(state, body, shapes, link, shape, name, value):
    changes = attribute(shapes, word(state, CHANGES))
    if changes == 0:  # the simulation was reset
        return
    key, made = PyTuple_New(4), PyTuple_New(2)
    number = attribute(body, word(state, IDS))
    Py_IncRef(number)
    PyTuple_SetItem(key, 0, number)
    PyTuple_SetItem(key, 1, PyLong_FromLongLong(link))
    Py_IncRef(shape)
    PyTuple_SetItem(key, 2, shape)
    Py_IncRef(name)
    PyTuple_SetItem(key, 3, name)
    Py_IncRef(body)
    PyTuple_SetItem(made, 0, body)
    Py_IncRef(value)
    PyTuple_SetItem(made, 1, value)
    if whole(shape) >= 0:
        PyObject_SetAttr(shapes, word(state, ORDERED), word(state, TRUE))
    if attribute(shapes, word(state, ORDERED)) == word(state, TRUE) and found(changes, key) != 0:
        PyDict_DelItem(changes, key)
    PyDict_SetItem(changes, key, made)
    Py_DecRef(key)
    Py_DecRef(made)

@part
def color_of(state, values):
    made = PyTuple_New(4)
    for k in range(4):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(number_in(state, values, k)))
    return made

@part
def is_changed(state, scene, record, given, count):
    link, image = whole(given[2]), 0
    if not -1 <= link < whole(attribute(record, word(state, JOINTS))):
        return False
    textures = attribute(scene, word(state, TEXTURES))
    if count > GIVEN_TEXTURE and whole(given[GIVEN_TEXTURE]) >= -1:
        if PyList_Size(attribute(textures, word(state, PENDING))) > 0:
            return False
        image = found(attribute(textures, word(state, IMAGES)), given[GIVEN_TEXTURE])
        image = word(state, NONE) if image == 0 else image
    body = attribute(record, word(state, BODY))
    shapes = attribute(attribute(scene, word(state, WORLD)), word(state, SHAPES))
    Py_IncRef(body)  # reading a number may reset the simulation
    Py_IncRef(shapes)
    Py_IncRef(image)
    shape = given[GIVEN_SHAPE] if count > GIVEN_SHAPE else word(state, WHOLE)
    color = argument(state, given, count, GIVEN_COLOR)
    specular = argument(state, given, count, GIVEN_SPECULAR)
    if color != word(state, NONE):
        made, place = color_of(state, color), PyLong_FromLongLong(link + 1)
        PyDict_SetItem(attribute(record, word(state, COLORS)), place, made)
        Py_DecRef(place)
        change(state, body, shapes, link + 1, shape, word(state, COLOR), made)
        Py_DecRef(made)
    if specular != word(state, NONE):
        total = number_in(state, specular, 0) + number_in(state, specular, 1) + number_in(state, specular, 2)
        made = PyFloat_FromDouble(total / 3.0)
        change(state, body, shapes, link + 1, shape, word(state, SPECULAR), made)
        Py_DecRef(made)
    if image != 0:
        change(state, body, shapes, link + 1, shape, word(state, TEXTURE), image)
        Py_DecRef(image)
    Py_DecRef(shapes)
    Py_DecRef(body)
    return True

def entry(state, given, count, keywords):
    if keywords == 0 and 3 <= count <= MOST and fits(state, given, count):
        scene = attribute(given[0], word(state, SCENE))
        record = found(attribute(scene, word(state, BODIES)), given[1]) if scene != 0 else 0
        is_done = False
        if record != 0:
            Py_IncRef(record)
            is_done = is_changed(state, scene, record, given, count)
            Py_DecRef(record)
        if is_done:
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def appearance_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


APPEARANCE = Front(appearance_call, EntrySignature(_SOURCE))
"""changeVisualShape and resetVisualShapeData."""
vars(appearance_call)["front"] = APPEARANCE
