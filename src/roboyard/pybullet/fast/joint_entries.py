"""resetJointState and its forms as machine code, for joints of one degree of freedom; see `fast_entries`."""

from __future__ import annotations

from roboyard.native.entry_parts import NUMBER, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS

_SOURCE = f"""{PARTS}{parts(NUMBER, WHOLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, FASTER, BOXES_OLD, FORM = range(3, 12)
SCENE, WORLD, QPOS, QVEL, POSITIONS, VELOCITIES, READ, STEPS, SHOWN = range(3, 12)
NESTED, SINGLE, PLAIN = range(3)  # lists of lists of one number, lists of one number, numbers
JOINT, POSITION, VELOCITY = range(3)

@part
def only_item(values):
    return item(values, 0) if has_length(values, 1) else np.nan

@part
def inner_item(values, k):
    inner = PySequence_GetItem(values, k)
    if inner == 0:
        PyErr_Clear()
        return np.nan
    value = only_item(inner)
    Py_DecRef(inner)
    return value

@part
def read_nested(state, given, count, length, into):
    speeds = given[4] if count == 5 else word(state, NONE)
    for k in range(length):
        into[k, JOINT], into[k, POSITION] = whole_item(given[2], k), inner_item(given[3], k)
        into[k, VELOCITY] = 0.0 if speeds == word(state, NONE) else inner_item(speeds, k)

@part
def read_one(state, given, count, form, into):
    speed = given[4] if count == 5 else word(state, NONE)
    into[0, JOINT] = whole(given[2])
    if form == PLAIN:
        into[0, POSITION], into[0, VELOCITY] = number(given[3]), number(speed) if count == 5 else 0.0
    else:
        into[0, POSITION] = only_item(given[3])
        into[0, VELOCITY] = 0.0 if speed == word(state, NONE) else only_item(speed)

@part
def reset(state, body, given, count):
    into, positions = matrix(word(body, READ)), integers(word(body, POSITIONS))
    form, length = PyLong_AsLongLong(word(state, FORM)), 1
    if form == NESTED:
        length = PySequence_Size(given[2])
        if length < 0:
            PyErr_Clear()
        if length < 1 or length > len(into) or not has_length(given[3], length):
            return False
        if count == 5 and given[4] != word(state, NONE) and not has_length(given[4], length):
            return False
        read_nested(state, given, count, length, into)
    else:
        read_one(state, given, count, form, into)
    for k in range(length):
        index, total = into[k, JOINT], into[k, POSITION] + into[k, VELOCITY]
        if not 0.0 <= index < len(positions) or total - total != 0.0 or positions[np.int64(index)] < 0:
            return False
    qpos, qvel = numbers(word(body, QPOS)), numbers(word(body, QVEL))
    velocities = integers(word(body, VELOCITIES))
    for k in range(length):
        joint = np.int64(into[k, JOINT])
        qpos[positions[joint]] = into[k, POSITION]
        qvel[velocities[joint]] = into[k, VELOCITY]
    true = word(state, TRUE)
    PyObject_SetAttr(word(body, WORLD), word(state, MOVED), true)
    PyObject_SetAttr(word(body, WORLD), word(state, FASTER), true)
    PyObject_SetAttr(word(body, SCENE), word(state, BOXES_OLD), true)
    steps, shown = numbers(word(body, STEPS)), numbers(word(body, SHOWN))
    shown[0] = steps[0]
    return True

def entry(state, given, count, keywords):
    if keywords == 0 and (count == 4 or count == 5):
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            is_done = reset(state, body, given, count)
            Py_DecRef(body)
            if is_done:
                Py_IncRef(word(state, NONE))
                return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def joints_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


JOINTS = Front(joints_call, EntrySignature(_SOURCE))
"""resetJointStatesMultiDof, resetJointStateMultiDof and resetJointState."""
vars(joints_call)["front"] = JOINTS
