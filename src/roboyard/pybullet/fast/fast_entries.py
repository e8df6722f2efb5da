"""Commands that are machine code as a whole, where a body's arrays are prepared: pushes, boxes and motors.

A command's first call of a body is the Python function's, which prepares the body's arrays. Later ones are
read, computed and answered by machine code, until rows of MuJoCo's arrays change (`Engine.prepared`). What
is irregular (a keyword, another length, text, a number that is not finite) goes to the Python function.
"""

from __future__ import annotations

from roboyard.native.entry_parts import ATTRIBUTE, FOUND, HAS_LENGTH, ITEM, WHOLE_ITEM, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.bullet_rules.motor_kernels import write_motor
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

_PUSH = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, OLD, KEPT, PENDING, PUSHED, HAS_POINT = range(3, 14)
SCENE, WORLD, WRENCHES, XPOS, XQUAT, XIPOS, QPOS, FRAMES, APPLIED, ROWS, FREE, CENTRES = range(3, 15)

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
    link, frame = PyLong_AsLongLong(given[2]), PyLong_AsLongLong(flags)
    rows, world = integers(word(body, ROWS)), word(body, WORLD)
    if link < -1 or link >= len(rows) - 1 or frame < 1 or frame > 2:
        return False
    place = PyLong_AsLongLong(word(body, FREE)) if link < 0 else -1
    if place < 0 and attribute(word(body, SCENE), word(state, OLD)) == true:
        return False
    shown, turns = word(body, XPOS), word(body, XQUAT)
    kept = attribute(world, word(state, KEPT))
    if kept != word(state, NONE) and kept != 0:
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

_BOX = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, SINGLE_READS = range(3, 10)
WORLD, XPOS, XQUAT, FRAMES, BOXES, ROWS, OUT, SCENE, LOOP, CHAIN, NUMBERS, LAST = range(3, 15)

@part
def corner(out, first):
    made = PyTuple_New(3)
    for k in range(3):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(out[first + k]))
    return made

@part
def is_found(state, body, link):
    moved = attribute(word(body, WORLD), word(state, MOVED))
    if moved != word(state, TRUE):
        rows, out = integers(word(body, ROWS)), numbers(word(body, OUT))
        _loop(
            matrix(word(body, XPOS)), matrix(word(body, XQUAT)), matrix(word(body, FRAMES)),
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
        body, one = prepared(state, given[0], given[1]), word(state, ONE)
        if body != 0 and (count == 2 or word(given[2], KIND) == word(one, KIND)):
            link = PyLong_AsLongLong(given[2]) if count == 3 else -1
            if -1 <= link < PyLong_AsLongLong(word(body, LAST)) and is_found(state, body, link):
                out = numbers(word(body, OUT))
                made = PyTuple_New(2)
                PyTuple_SetItem(made, 0, corner(out, 0))
                PyTuple_SetItem(made, 1, corner(out, 3))
                return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
BOX = Front(link_box_of, EntrySignature(_BOX))
"""getAABB."""

_MOTORS = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, PENDING, TIME_STEP, FORM, UNSET, TORQUES = range(3, 13)
WRENCHES, EFFORTS, DOFS, ROOM = range(3, 7)  # for torques
FLAT, NESTED, SINGLE = range(3)  # lists of numbers, lists of lists of one number, lists of one number
COMMANDS, PARAMETERS, MOTORS, TARGETS, ROWS, LIMITS, IMPULSES, READ, FORCE = range(3, 12)
JOINT, POSITION, VELOCITY, LIMIT, KP, KD = range(6)

@part
def number_in(values, k, is_nested):
    if not is_nested:
        return item(values, k)
    inner = PySequence_GetItem(values, k)
    if inner == 0:
        PyErr_Clear()
        return np.nan
    found = item(inner, 0) if has_length(inner, 1) else np.nan
    Py_DecRef(inner)
    return found

@part
def read_one(given, count, state, defaults, table, joints):
    if word(given[2], KIND) != word(word(state, ONE), KIND):
        return False
    index = PyLong_AsLongLong(given[2])
    if index < 0 or index >= joints:
        return False
    table[0, JOINT] = index
    for column in range(1, 6):
        values = given[column + 3] if column + 3 < count else word(state, NONE)
        if column < 4:
            if values != word(state, NONE) and not has_length(values, 1):
                return False
            table[0, column] = defaults[column] if values == word(state, NONE) else item(values, 0)
        elif column + 3 >= count:
            table[0, column] = defaults[column]
        else:
            if word(values, KIND) != word(word(state, UNSET), KIND):
                return False
            table[0, column] = PyFloat_AsDouble(values)
    return True

@part
def read(given, count, state, body, length, defaults, table, joints, is_nested):
    for k in range(length):
        index = whole_item(given[2], k)
        if index < 0 or index >= joints:
            return False
        table[k, JOINT] = index
        for column in range(1, 6):
            values = given[column + 3] if column + 3 < count else word(state, NONE)
            if values == word(state, NONE):
                table[k, column] = defaults[column]
            else:
                table[k, column] = number_in(values, k, is_nested and column < 4)
    return True

@part
def command(state, body, given, count):
    if word(given[3], KIND) != word(word(state, ONE), KIND):
        return False
    mode, form, length = PyLong_AsLongLong(given[3]), PyLong_AsLongLong(word(state, FORM)), 1
    if form != SINGLE:
        length = PySequence_Size(given[2])
        if length < 0:
            PyErr_Clear()
    if form != FLAT and mode != 2:
        return False
    table, rows = matrix(word(body, READ)), integers(word(body, ROWS))
    impulses = numbers(word(body, IMPULSES))
    if length < 1 or length > len(table) or (mode != 0 and mode != 2):
        return False
    for place in range(4, count if form != SINGLE else 4):
        if given[place] != word(state, NONE) and not has_length(given[place], length):
            return False
    defaults = (0.0, 0.0, 0.0, PyFloat_AsDouble(word(body, FORCE)), 0.1, 1.0)
    if form == SINGLE:
        if not read_one(given, count, state, defaults, table, len(rows)):
            return False
    elif not read(given, count, state, body, length, defaults, table, len(rows), form == NESTED):
        return False
    time_step = attribute(word(body, PARAMETERS), word(state, TIME_STEP))
    pending = attribute(word(body, COMMANDS), word(state, PENDING))
    if time_step == 0 or pending == 0 or PyDict_Size(pending) != 0:
        return False
    seconds, driven = PyFloat_AsDouble(time_step), 0
    for k in range(length):
        total = 0.0
        for column in range(1, 6):
            total += table[k, column]
        joint = np.int64(table[k, JOINT])
        if total - total != 0.0 or not table[k, LIMIT] > 0.0:
            return False
        if rows[joint] >= 0:
            driven += 1
            if table[k, LIMIT] * seconds != impulses[joint]:
                return False
    if driven == 0:
        return False
    motors, targets = matrix(word(body, MOTORS)), matrix(word(body, TARGETS))
    limits = matrix(word(body, LIMITS))
    for k in range(length):
        joint = np.int64(table[k, JOINT])
        if rows[joint] >= 0:
            goal = min(max(table[k, POSITION], limits[joint, 0]), limits[joint, 1]) if mode == 2 else 0.0
            kp = table[k, KP] if mode == 2 else 0.0
            _loop(motors, targets, rows[joint], mode, goal, table[k, VELOCITY], kp, table[k, KD], 0.0)
    return True

@part
def read_torques(given, length, room, joints):
    total = 0.0
    for k in range(length):
        index = whole_item(given[2], k)
        if index < 0 or index >= joints:
            return False
        room[k, 0], room[k, 1] = index, item(given[6], k)
        total += room[k, 1]
    return total - total == 0.0

@part
def add_torques(state, given, count):
    if word(given[3], KIND) != word(word(state, ONE), KIND) or PyLong_AsLongLong(given[3]) != 1:
        return False
    for place in (4, 5, 7, 8):
        if place < count and given[place] != word(state, NONE):
            return False
    bodies = found(word(state, TORQUES), given[0])
    body = found(bodies, given[1]) if bodies != 0 else 0
    length = PySequence_Size(given[2]) if body != 0 else 0
    if length < 0:
        PyErr_Clear()
    if length < 1 or not has_length(given[6], length):
        return False
    room, dofs = matrix(word(body, ROOM)), integers(word(body, DOFS))
    efforts, wrenches = numbers(word(body, EFFORTS)), word(body, WRENCHES)
    Py_IncRef(body)
    fits = length <= len(room) and read_torques(given, length, room, len(dofs))
    if fits:
        for k in range(length):
            dof = dofs[np.int64(room[k, 0])]
            if dof >= 0:
                efforts[dof] += room[k, 1]
        PyObject_SetAttr(wrenches, word(state, PENDING), word(state, TRUE))
    Py_DecRef(body)
    return fits

def entry(state, given, count, keywords):
    fits = keywords == 0 and count >= 4
    if fits and 7 <= count <= 9 and PyLong_AsLongLong(word(state, FORM)) == FLAT:
        if add_torques(state, given, count):
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
    if count > 9:  # a largest velocity, and damping of joints that have one degree of freedom here
        is_single = PyLong_AsLongLong(word(state, FORM)) == SINGLE
        fastest = word(state, UNSET if is_single else NONE)
        fits = fits and count <= (11 if is_single else 10) and given[9] == fastest
        if count > 10 and fits:
            fits = word(given[10], KIND) == word(word(state, UNSET), KIND)
    if fits:
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            is_done = command(state, body, given, count)
            Py_DecRef(body)
            if is_done:
                Py_IncRef(word(state, NONE))
                return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
MOTORS = Front(write_motor, EntrySignature(_MOTORS))
"""setJointMotorControlArray and its forms for joints of any kind, where no largest impulse changes."""


for _front in (PUSH, BOX, MOTORS):
    vars(_front.core)["front"] = _front
