"""resetJointStatesMultiDof as machine code, for joints at rest that have one degree of freedom."""

from __future__ import annotations

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS

_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, MOVED, FASTER, OLD = range(3, 11)
SCENE, WORLD, QPOS, QVEL, POSITIONS, VELOCITIES, READ = range(3, 10)

@part
def read(given, length, into, positions):
    for k in range(length):
        index = whole_item(given[2], k)
        if index < 0 or index >= len(positions) or positions[index] < 0:
            return False
        values = PySequence_GetItem(given[3], k)
        if values == 0:
            PyErr_Clear()
            return False
        value = item(values, 0) if has_length(values, 1) else np.nan
        Py_DecRef(values)
        if value - value != 0.0:
            return False
        into[k, 0], into[k, 1] = index, value
    return True

@part
def reset(state, body, given):
    length = PySequence_Size(given[2])
    if length < 0:
        PyErr_Clear()
    into, positions = matrix(word(body, READ)), integers(word(body, POSITIONS))
    if length < 1 or length > len(into) or not has_length(given[3], length):
        return False
    if not read(given, length, into, positions):
        return False
    qpos, qvel = numbers(word(body, QPOS)), numbers(word(body, QVEL))
    velocities = integers(word(body, VELOCITIES))
    for k in range(length):
        joint = np.int64(into[k, 0])
        qpos[positions[joint]] = into[k, 1]
        qvel[velocities[joint]] = 0.0
    true = word(state, TRUE)
    PyObject_SetAttr(word(body, WORLD), word(state, MOVED), true)
    PyObject_SetAttr(word(body, WORLD), word(state, FASTER), true)
    PyObject_SetAttr(word(body, SCENE), word(state, OLD), true)
    return True

def entry(state, given, count, keywords):
    if keywords == 0 and (count == 4 or (count == 5 and given[4] == word(state, NONE))):
        body = prepared(state, given[0], given[1])
        if body != 0:
            Py_IncRef(body)
            is_done = reset(state, body, given)
            Py_DecRef(body)
            if is_done:
                Py_IncRef(word(state, NONE))
                return word(state, NONE)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def joints_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


JOINTS = Front(joints_call, EntrySignature(_SOURCE))
vars(joints_call)["front"] = JOINTS
