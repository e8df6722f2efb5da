"""getJointState, getJointStates and their forms for joints of any kind as machine code; see `fast_entries`.

They read joints of at most one degree of freedom after a step, without force-torque sensors. Forces of motors
are found by a function of Python once after each step. Anything else goes to the Python functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import IS_ARRAY, NUMBER, NUMBER_IN, PLAIN, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS
from roboyard.pybullet.state.bodies.joint_groups import NO_REACTION
from roboyard.pybullet.state.bodies.joint_tables import POSITION_COUNT

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

KIND = "states"
_UNREAD = -2
"""In place of a position of a joint with several degrees of freedom; -1 of one with none."""


class JointState(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Any
    prepared: Any
    is_many: bool
    has_tuples: bool
    """Whether numbers are tuples of one number."""
    none: None = None
    true: bool = True
    whole: int = 0
    number: float = 0.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    forces: str = "_motor_forces"
    revision: str = "motor_revision"
    reaction: tuple[float, ...] = NO_REACTION
    array: Any = np.zeros(0, np.int64)
    """Of which the type of numbers is read."""


_SOURCE = f"""{PARTS}
COMMAND, PREPARED, IS_MANY, HAS_TUPLES, NONE, TRUE, WHOLE, NUMBER, LISTED = range(3, 12)
FORCES, REVISION, REACTION, ARRAY = range(12, 16)
SCENE, QPOS, QVEL, POSITIONS, VELOCITIES, MOTORED, APPLIED, SENSORS, FIND, MODEL_REVISION = range(3, 13)
TUPLE = REACTION
{parts(PLAIN, WHOLE, NUMBER, NUMBER_IN, IS_ARRAY)}
@part
def has_forces(state, body):
    if whole(attribute(word(body, SCENE), word(state, REVISION))) != whole(word(body, MODEL_REVISION)):
        return False
    if attribute(word(body, SCENE), word(state, FORCES)) != word(state, NONE):
        return True
    done = PyObject_Vectorcall(word(body, FIND), words(), 0, 0)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return attribute(word(body, SCENE), word(state, FORCES)) != word(state, NONE)

@part
def has_sensor(body, joint):
    if PySet_Size(word(body, SENSORS)) == 0:
        return False
    number = PyLong_FromLongLong(joint)
    answer = PySet_Contains(word(body, SENSORS), number)
    Py_DecRef(number)
    return answer != 0

@part
def put(state, made, place, value):
    if word(state, HAS_TUPLES) == word(state, TRUE):
        one = PyTuple_New(1)
        PyTuple_SetItem(one, 0, value)
        value = one
    PyTuple_SetItem(made, place, value)

@part
def state_of(state, body, forces, joint):
    positions, velocities = integers(word(body, POSITIONS)), integers(word(body, VELOCITIES))
    if not 0 <= joint < len(positions) or positions[joint] < -1:
        return 0
    place = positions[joint]
    if has_sensor(body, joint):
        return 0
    if place < 0 and word(state, HAS_TUPLES) == word(state, TRUE):
        return 0
    made = PyTuple_New(4)
    if place < 0:
        for k in (0, 1, 3):
            Py_IncRef(word(state, NUMBER))
            PyTuple_SetItem(made, k, word(state, NUMBER))
    else:
        dof = velocities[joint]
        put(state, made, 0, PyFloat_FromDouble(numbers(word(body, QPOS))[place]))
        put(state, made, 1, PyFloat_FromDouble(numbers(word(body, QVEL))[dof]))
        if PyList_GetItem(word(body, MOTORED), joint) == word(state, TRUE):
            put(state, made, 3, PyFloat_FromDouble(numbers(forces)[dof]))
        else:
            kept = PyList_GetItem(word(body, APPLIED), joint)
            Py_IncRef(kept)
            put(state, made, 3, kept)
    Py_IncRef(word(state, REACTION))
    PyTuple_SetItem(made, 2, word(state, REACTION))
    return made

@part
def joint_at(state, values, place):
    value = held(state, values, place)
    if value != 0 and word(value, KIND) == word(word(state, WHOLE), KIND):
        return whole(value)
    return whole_item(values, place)

@part
def many(state, body, forces, values):
    are_integers, length = is_array(values, word(state, ARRAY)), 0
    if are_integers:
        length = len(integers(values))
    else:
        length = PySequence_Size(values)
        if length < 0:
            PyErr_Clear()
    if length < 1:
        return 0
    made = PyTuple_New(length)
    for k in range(length):
        joint = integers(values)[k] if are_integers else joint_at(state, values, k)
        one = state_of(state, body, forces, joint)
        if one == 0:
            Py_DecRef(made)
            return 0
        PyTuple_SetItem(made, k, one)
    return made

def entry(state, given, count, keywords):
    body = prepared(state, given[0], given[1]) if keywords == 0 and count == 3 else 0
    if body != 0:
        made = 0
        Py_IncRef(body)
        if has_forces(state, body):
            forces = attribute(word(body, SCENE), word(state, FORCES))
            Py_IncRef(forces)  # reading an index may make a step
            if word(state, IS_MANY) == word(state, TRUE):
                made = many(state, body, forces, given[2])
            elif word(given[2], KIND) == word(word(state, WHOLE), KIND):
                made = state_of(state, body, forces, whole(given[2]))
            Py_DecRef(forces)
        Py_DecRef(body)
        if made != 0:
            return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def states_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


STATES = Front(states_call, EntrySignature(_SOURCE))
"""getJointState, getJointStates, getJointStateMultiDof and getJointStatesMultiDof."""
vars(states_call)["front"] = STATES


def prepare(scene: PhysicsScene, record: BodyRecord) -> None:
    """Let machine code read the joints of a body that has rows in the arrays, once they are read again."""
    world = scene.world
    known: Any = world.prepared.get(KIND)
    if known is None or record.number in known or world.is_stale or record.soft is not None:
        return
    if record.revision != world.revision:
        return
    read: Any = world.prepared["read"]
    if (KIND, record.number) not in read:  # to prepare what is read once between edits would take longer
        read[KIND, record.number] = None
        return
    positions = [
        record.position_addresses[joint]
        if record.is_scalar[joint]
        else _UNREAD
        if POSITION_COUNT[record.joint_type(joint)]
        else -1
        for joint in range(record.joint_count)
    ]
    known[record.number] = (
        *(scene, record.qpos, record.qvel, np.array(positions, np.int64)),
        *(np.array(record.velocity_addresses, np.int64), record.motored, record.applied, record.sensors),
        *(scene.motor_forces, world.revision),
    )
