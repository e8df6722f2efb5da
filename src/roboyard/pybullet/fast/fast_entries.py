"""Commands that are machine code as a whole, where a body's arrays are prepared: pushes and boxes.

A command's first call of a body is the Python function's, which prepares the body's arrays. Later ones are
read, computed and answered by machine code, until rows of MuJoCo's arrays change (`Engine.prepared`). What
is irregular (a keyword, another length, text, a number that is not finite) goes to the Python function.
"""

from __future__ import annotations

from roboyard.native.entry_parts import ATTRIBUTE, FOUND, HAS_LENGTH, ITEM, WHOLE, WHOLE_ITEM, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.state.frames import SINGLE_READS
from roboyard.pybullet.state.state_kernels import link_box_of, push_link_of

PARTS = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
{parts(ATTRIBUTE, FOUND, ITEM, WHOLE_ITEM, HAS_LENGTH)}
@part
def prepared(state, client, body):
    bodies = found(word(state, ITEMS + 1), client)
    return 0 if bodies == 0 else found(bodies, body)
"""
"""The start of all these entries."""

_PUSH = f"""{PARTS}{parts(WHOLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, OLD, KEPT, PENDING, PUSHED, HAS_POINT = range(3, 14)
SCENE, WORLD, WRENCHES, XPOS, XQUAT, XIPOS, QPOS, FRAMES, APPLIED, ROWS, FREE, CENTRES = range(3, 15)
STEPS, SHOWN = range(15, 17)

@part
def push(state, body, given, count, has_point):
    flags, one, true = given[count - 1], word(state, ONE), word(state, TRUE)
    if word(given[2], KIND) != word(one, KIND) or word(flags, KIND) != word(one, KIND):
        return False
    if not has_length(given[3], 3) or (has_point and not has_length(given[4], 3)):
        return False
    fx = fy = fz = tx = ty = tz = px = py = pz = 0.0
    x, y, z = item(given[3], 0), item(given[3], 1), item(given[3], 2)
    if has_point:
        fx, fy, fz = x, y, z
        px, py, pz = item(given[4], 0), item(given[4], 1), item(given[4], 2)
    else:
        tx, ty, tz = x, y, z
    link, frame = whole(given[2]), whole(flags)
    rows, world = integers(word(body, ROWS)), word(body, WORLD)
    if link < -1 or link >= len(rows) - 1 or frame < 1 or frame > 2:
        return False
    place = PyLong_AsLongLong(word(body, FREE)) if link < 0 else -1
    if place < 0 and attribute(word(body, SCENE), word(state, OLD)) == true:
        return False
    steps, marked = numbers(word(body, STEPS)), numbers(word(body, SHOWN))
    is_fresh = place < 0 and marked[0] == steps[0]
    if is_fresh and attribute(world, word(state, MOVED)) == true:
        return False
    shown, turns = word(body, XPOS), word(body, XQUAT)
    kept = attribute(world, word(state, KEPT))
    if not is_fresh and kept != word(state, NONE) and kept != 0:
        shown, turns = word(kept, ITEMS), word(kept, ITEMS + 1)
    local = (1 if frame == 1 else 0) + (0 if has_point else 2)
    if place < 0 and attribute(world, word(state, MOVED)) == true:
        local += 4
    if _loop(
        matrix(word(body, XPOS)), matrix(word(body, XQUAT)), matrix(word(body, XIPOS)),
        numbers(word(body, QPOS)), matrix(word(body, FRAMES)), matrix(word(body, APPLIED)),
        matrix(word(body, CENTRES)), matrix(shown), matrix(turns), rows[link + 1], link + 1, place, local,
        fx, fy, fz, tx, ty, tz, px, py, pz,
    ) != 1:
        return False
    PyObject_SetAttr(word(body, WRENCHES), word(state, PENDING), true)
    PyObject_SetAttr(word(body, WRENCHES), word(state, PUSHED), true)
    return True

def entry(state, given, count, keywords):
    has_point = word(state, HAS_POINT) == word(state, TRUE)
    if keywords == 0 and count == (6 if has_point else 5):
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            is_done = push(state, body, given, count, has_point)
            Py_DecRef(body)
            if is_done:
                Py_IncRef(word(state, NONE))
                return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
PUSH = Front(push_link_of, EntrySignature(_PUSH))
"""applyExternalForce and applyExternalTorque."""

_BOX = f"""{PARTS}{parts(WHOLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, SINGLE_READS, OLD, KEPT = range(3, 12)
WORLD, XPOS, XQUAT, FRAMES, BOXES, ROWS, OUT, SCENE, LOOP, CHAIN, NUMBERS, LAST, STEPS, MARKED = range(3, 17)

@part
def corner(out, first):
    made = PyTuple_New(3)
    for k in range(3):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(out[first + k]))
    return made

@part
def is_found(state, body, link):
    moved = attribute(word(body, WORLD), word(state, MOVED))
    steps, marked = numbers(word(body, STEPS)), numbers(word(body, MARKED))
    of_step = link >= 0 and marked[0] != steps[0]
    if attribute(word(body, SCENE), word(state, OLD)) == word(state, TRUE):
        of_step = False
    shown, turns = word(body, XPOS), word(body, XQUAT)
    if of_step:
        kept = attribute(word(body, WORLD), word(state, KEPT))
        if kept != word(state, NONE) and kept != 0:
            shown, turns = word(kept, ITEMS), word(kept, ITEMS + 1)
    if of_step or moved != word(state, TRUE):
        rows, out = integers(word(body, ROWS)), numbers(word(body, OUT))
        _loop(
            matrix(shown), matrix(turns), matrix(word(body, FRAMES)),
            matrix(word(body, BOXES)), rows[link + 1], link + 1, out,
        )
        return True
    reads = PyLong_AsLongLong(attribute(word(body, SCENE), word(state, SINGLE_READS)))
    if not 0 <= reads < {SINGLE_READS}:
        return False
    made = PyLong_FromLongLong(reads + 1)
    PyObject_SetAttr(word(body, SCENE), word(state, SINGLE_READS), made)
    Py_DecRef(made)
    passed, numbered = words(), word(body, NUMBERS)
    passed[0], passed[1], passed[2] = word(body, CHAIN), word(body, FRAMES), word(body, BOXES)
    passed[3] = word(numbered, ITEMS + 2 * (link + 1))
    passed[4] = word(numbered, ITEMS + 2 * (link + 1) + 1)
    passed[5] = word(body, OUT)
    done = PyObject_Vectorcall(word(body, LOOP), passed, 6, 0)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return True

def entry(state, given, count, keywords):
    if keywords == 0 and (count == 2 or count == 3):
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            link, made = whole(given[2]) if count == 3 else -1, 0
            if -1 <= link < PyLong_AsLongLong(word(body, LAST)) and is_found(state, body, link):
                out = numbers(word(body, OUT))
                made = PyTuple_New(2)
                PyTuple_SetItem(made, 0, corner(out, 0))
                PyTuple_SetItem(made, 1, corner(out, 3))
            Py_DecRef(body)
            if made != 0:
                return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
BOX = Front(link_box_of, EntrySignature(_BOX))
"""getAABB."""


for _front in (PUSH, BOX):
    vars(_front.core)["front"] = _front
