"""getLinkState and getLinkStates as machine code; see `fast_entries`.

What brings frames and velocities up to date is called where it is due, as by the Python functions, or one
link's chain of joints is followed.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.native import Kernel
from roboyard.native.entry_parts import TRIPLE, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS
from roboyard.pybullet.state.bodies.link_groups import chain_kernels, chain_of, inertial_frames
from roboyard.pybullet.state.frames import SINGLE_READS
from roboyard.pybullet.state.state_kernels import link_pose, link_state

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.physics_scene import PhysicsScene

KIND = "links"


def link_numbers(  # pragma: no cover
    shown, turns, frames, row, place, with_velocity, turned, cvel, xipos, subtree_com, rootid, out
):
    """Write what `write_link_pose`, or with velocity `write_link_state`, writes."""
    if with_velocity == 1:
        position, orientation, frame_position, frame_orientation, linear, angular = link_state(
            shown, turns, frames, row, place, turned, cvel, xipos, subtree_com, rootid
        )
        for k in range(3):
            out[14 + k], out[17 + k] = linear[k], angular[k]
    else:
        position, orientation, frame_position, frame_orientation = link_pose(shown, turns, frames, row, place)
    for k in range(3):
        out[k], out[7 + k] = position[k], frame_position[k]
    for k in range(4):
        out[3 + k], out[10 + k] = orientation[k], frame_orientation[k]


_SOURCE = f"""{PARTS}{parts(WHOLE, TRIPLE)}
COMMAND, PREPARED, NONE, TRUE, ONE, FALSE, ZERO, IS_MANY = range(3, 11)
MOVED, OLD, KEPT, FRAMES_REVISION, READS, LONG = range(11, 17)
SCENE, WORLD, XPOS, XQUAT, FRAMES, ROWS, OUT, LOCAL, CVEL, XIPOS, CENTRES, ROOTS = range(3, 15)
CHAIN, POSE_OF, STATE_OF, PLACES, UPDATE, VELOCITIES, REVISION, STEPS, SHOWN = range(15, 24)

@part
def flag_of(state, given, count, place):
    if place >= count or given[place] == word(state, FALSE):
        return 0
    if given[place] == word(state, TRUE):
        return 1
    if word(given[place], KIND) != word(word(state, ONE), KIND):
        return -1
    return 0 if whole(given[place]) == 0 else 1

@part
def is_called(function):
    done = PyObject_Vectorcall(function, words(), 0, 0)
    if done == 0:
        PyErr_Clear()
        return False
    Py_DecRef(done)
    return True

@part
def four(values, first):
    made = PyTuple_New(4)
    for k in range(4):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(values[first + k]))
    return made

@part
def made_of(body, link, with_velocity):
    out, local = numbers(word(body, OUT)), word(word(body, LOCAL), ITEMS + link + 1)
    made = PyTuple_New(8 if with_velocity == 1 else 6)
    PyTuple_SetItem(made, 0, triple(out[0], out[1], out[2]))
    PyTuple_SetItem(made, 1, four(out, 3))
    for k in range(2):
        value = word(local, ITEMS + k)
        Py_IncRef(value)
        PyTuple_SetItem(made, 2 + k, value)
    PyTuple_SetItem(made, 4, triple(out[7], out[8], out[9]))
    PyTuple_SetItem(made, 5, four(out, 10))
    if with_velocity == 1:
        PyTuple_SetItem(made, 6, triple(out[14], out[15], out[16]))
        PyTuple_SetItem(made, 7, triple(out[17], out[18], out[19]))
    return made

@part
def read(state, body, link, with_velocity, is_fresh):
    shown, turns = word(body, XPOS), word(body, XQUAT)
    kept = attribute(word(body, WORLD), word(state, KEPT))
    if not is_fresh and kept != word(state, NONE) and kept != 0:
        shown, turns = word(kept, ITEMS), word(kept, ITEMS + 1)
    rows = integers(word(body, ROWS))
    _loop(
        matrix(shown), matrix(turns), matrix(word(body, FRAMES)), rows[link + 1], link + 1, with_velocity,
        matrix(word(body, XQUAT)), matrix(word(body, CVEL)), matrix(word(body, XIPOS)),
        matrix(word(body, CENTRES)), integers(word(body, ROOTS)), numbers(word(body, OUT)),
    )
    return made_of(body, link, with_velocity)

@part
def follow(state, body, link, with_velocity, is_fresh, reads):
    scene, places, passed, count = word(body, SCENE), word(body, PLACES), words(), 0
    passed[0] = word(body, CHAIN)
    if with_velocity == 1:
        passed[1], passed[2], count = word(body, XPOS), word(body, XQUAT), 2
        kept = attribute(word(body, WORLD), word(state, KEPT))
        if kept != word(state, NONE) and kept != 0:
            passed[1], passed[2] = word(kept, ITEMS), word(kept, ITEMS + 1)
    passed[count + 1] = word(body, FRAMES)
    passed[count + 2] = word(places, ITEMS + 2 * (link + 1))
    passed[count + 3] = word(places, ITEMS + 2 * (link + 1) + 1)
    if with_velocity == 1:
        passed[count + 4] = word(state, ONE if is_fresh else ZERO)
        count += 1
    passed[count + 4] = word(body, OUT)
    loop = word(body, STATE_OF if with_velocity == 1 else POSE_OF)
    done = PyObject_Vectorcall(loop, passed, count + 5, 0)
    if done == 0:
        PyErr_Clear()
        return 0
    Py_DecRef(done)
    made = PyLong_FromLongLong(reads + 1)
    PyObject_SetAttr(scene, word(state, READS), made)
    Py_DecRef(made)
    return made_of(body, link, with_velocity)

@part
def is_shown(state, body):
    return whole(attribute(word(body, SCENE), word(state, FRAMES_REVISION))) == whole(word(body, REVISION))

@part
def is_present(state, body, is_asked):
    steps, shown = numbers(word(body, STEPS)), numbers(word(body, SHOWN))
    if is_asked:
        shown[0] = steps[0]
    if shown[0] == steps[0]:
        return True
    return attribute(word(body, SCENE), word(state, OLD)) == word(state, TRUE)

@part
def is_due(state, body):
    true = word(state, TRUE)
    if attribute(word(body, WORLD), word(state, MOVED)) == true or not is_shown(state, body):
        return True
    return attribute(word(body, SCENE), word(state, OLD)) == true

@part
def one(state, body, given, with_velocity, is_fresh):
    scene, world, link = word(body, SCENE), word(body, WORLD), whole(given[2])
    if link < 0 or link >= len(integers(word(body, ROWS))) - 1:
        return 0
    is_fresh = is_present(state, body, is_fresh)
    if not is_fresh and not is_shown(state, body):
        return 0
    if (is_fresh or with_velocity == 1) and attribute(world, word(state, MOVED)) == word(state, TRUE):
        reads, axes = whole(attribute(scene, word(state, READS))), attribute(world, word(state, LONG))
        if reads < {SINGLE_READS} and (with_velocity == 0 or (axes != 0 and PyDict_Size(axes) == 0)):
            return follow(state, body, link, with_velocity, is_fresh, reads)
    if is_fresh and is_due(state, body) and not is_called(word(body, UPDATE)):
        return 0
    if with_velocity == 1 and not is_called(word(body, VELOCITIES)):
        return 0
    return read(state, body, link, with_velocity, is_fresh)

@part
def many(state, body, given, with_velocity, is_fresh):
    length, last = PySequence_Size(given[2]), len(integers(word(body, ROWS))) - 1
    if length < 0:
        PyErr_Clear()
    for k in range(length):
        if not 0 <= whole_item(given[2], k) < last:
            return 0
    if length < 1:
        return 0
    is_fresh = is_present(state, body, is_fresh)
    if is_fresh and is_due(state, body) and not is_called(word(body, UPDATE)):
        return 0
    if not is_fresh and not is_shown(state, body) and not is_called(word(body, UPDATE)):
        return 0
    if with_velocity == 1 and not is_called(word(body, VELOCITIES)):
        return 0
    made = PyTuple_New(length)
    for k in range(length):
        link = whole_item(given[2], k)
        if not 0 <= link < last:  # given by an object that gave another one before
            Py_DecRef(made)
            return 0
        PyTuple_SetItem(made, k, read(state, body, link, with_velocity, is_fresh))
    return made

def entry(state, given, count, keywords):
    body = prepared(state, given[0], given[1]) if keywords == 0 and 3 <= count <= 5 else 0
    if body != 0:
        with_velocity, is_fresh = flag_of(state, given, count, 3), flag_of(state, given, count, 4)
        if with_velocity >= 0 and is_fresh >= 0:
            Py_IncRef(body)
            if word(state, IS_MANY) == word(state, TRUE):
                made = many(state, body, given, with_velocity, is_fresh == 1)
            else:
                made = one(state, body, given, with_velocity, is_fresh == 1)
            Py_DecRef(body)
            if made != 0:
                return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""
LINKS = Front(link_numbers, EntrySignature(_SOURCE))
"""getLinkState and getLinkStates."""
vars(LINKS.core)["front"] = LINKS


def prepare(scene: PhysicsScene, record: BodyRecord) -> None:
    """Let machine code read the links of a body that has rows in MuJoCo's arrays, once it is read again."""
    world = scene.world
    known: Any = world.prepared.get(KIND)
    if known is None or record.number in known or world.is_stale or record.soft is not None:
        return
    if record.revision != world.revision:
        return
    read = world.prepared["read"]
    if record.number not in read:  # to prepare what is read once between edits would take longer
        read[record.number] = None
        return
    model, data, loops = world.live_model, world.live_data, chain_kernels()
    of_chain = loops.write_pose_of_chain, loops.write_state_of_chain
    rows = [int(row) for row in record.rows]
    known[record.number] = (
        *(scene, world, data.xpos, data.xquat, inertial_frames(record), np.array(rows, np.int64)),
        *(np.zeros(20), tuple((link.frame.position, link.frame.quaternion) for link in record.links)),
        *(data.cvel, data.xipos, data.subtree_com, model.body_rootid.astype(np.int64), chain_of(world)),
        *(loop.load() if isinstance(loop, Kernel) else loop for loop in of_chain),
        tuple(number for place, row in enumerate(rows) for number in (row, place)),
        *(partial(scene.frames, fresh=True), world.link_velocities, world.revision),
        *(scene.step_count, record.shown),
    )
