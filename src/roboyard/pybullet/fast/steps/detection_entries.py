"""performCollisionDetection as machine code, where a step has prepared the compiled calls that it makes.

It brings the frames of bodies up to date, and makes the calls one after another. Kept contacts, new bodies
and rules that have changed since go to the Python function, and so does what raised an error; see
`fast_entries`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboyard._records import NamedTuple
from roboyard.native import loaded
from roboyard.native.entry_parts import ATTRIBUTE, CALLED, FOUND, IS_DONE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.sim import frame_updates
from roboyard.sim.stepping.impulses.records import DONE, ROWS_ARE_OLD

if TYPE_CHECKING:
    from roboyard.pybullet.state.physics_scene import PhysicsScene

KIND = "detection"


class DetectionState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    prepared: Any
    key: int = 0
    """Of what is prepared of the whole scene."""
    none: None = None
    true: bool = True
    false: bool = False
    poses: int = frame_updates.POSES
    poses_kept: int = frame_updates.POSES | frame_updates.KEEP
    stale: str = "is_stale"
    moved: str = "is_moved"
    centres_moved: str = "_centres_moved"
    kept_frames: str = "kept_frames"
    new: str = "_new"
    contacts: str = "_contacts"
    seen: str = "_seen"
    filtered: str = "filtered"


_SOURCE = f"""
ITEMS, SIZE = 3, 2  # of tuples, in words
COMMAND, PREPARED, KEY, NONE, TRUE, FALSE, POSES, POSES_KEPT, STALE, MOVED, CENTRES = range(3, 14)
KEPT_FRAMES, NEW, CONTACTS, SEEN, FILTERED = range(14, 19)
WORLD, LAST, UPDATE, ADDRESSES, ARRAYS, KEPT, SAME, MANIFOLDS, COLLIDE, COLLIDED = range(3, 13)
EXECUTE, EXECUTED, FINISH, SHIFT, SHIFTED = range(13, 18)
{parts(ATTRIBUTE, FOUND, CALLED, IS_DONE)}
@part
def is_same(state, scene):
    world, last, same = word(scene, WORLD), word(scene, LAST), word(scene, SAME)
    if attribute(world, word(state, STALE)) != word(state, FALSE):
        return False
    if attribute(last, word(state, CONTACTS)) != word(state, NONE):
        return False
    if attribute(last, word(state, SEEN)) != word(state, NONE):
        return False
    filtered = attribute(last, word(state, FILTERED))
    new = attribute(word(scene, MANIFOLDS), word(state, NEW))
    if filtered == 0 or new == 0 or PyDict_Size(filtered) != 0 or PyDict_Size(new) != 0:
        return False
    for place in range(0, word(same, SIZE), 3):
        at = ITEMS + place
        if attribute(word(same, at), word(same, at + 1)) != word(same, at + 2):
            return False
    return True

@part
def is_placed(state, scene):
    world = word(scene, WORLD)
    if attribute(world, word(state, MOVED)) != word(state, TRUE):
        return True
    passed, count = words(), 0
    addresses, arrays = word(scene, ADDRESSES), word(scene, ARRAYS)
    for place in range(word(addresses, SIZE)):
        passed[count] = word(addresses, ITEMS + place)
        count += 1
    keeps = attribute(world, word(state, KEPT_FRAMES)) == word(state, NONE)
    passed[count] = word(state, POSES_KEPT if keeps else POSES)
    count += 1
    for place in range(word(arrays, SIZE)):
        passed[count] = word(arrays, ITEMS + place)
        count += 1
    if not is_done(PyObject_Vectorcall(word(scene, UPDATE), passed, count, 0)):
        return False
    if keeps:
        PyObject_SetAttr(world, word(state, KEPT_FRAMES), word(scene, KEPT))
    PyObject_SetAttr(world, word(state, MOVED), word(state, FALSE))
    PyObject_SetAttr(world, word(state, CENTRES), word(state, TRUE))
    return True

@part
def is_detected(state, scene):
    if not is_placed(state, scene) or not is_done(called(word(scene, COLLIDE), word(scene, COLLIDED))):
        return False
    answer = called(word(scene, EXECUTE), word(scene, EXECUTED))
    if answer == 0:
        return False
    number = PyLong_AsLongLong(answer)
    if number == {DONE} or number == {ROWS_ARE_OLD}:
        Py_DecRef(answer)
        return is_done(called(word(scene, SHIFT), word(scene, SHIFTED)))
    passed = words()
    passed[0] = answer
    made = PyObject_Vectorcall(word(scene, FINISH), passed, 1, 0)
    Py_DecRef(answer)
    return is_done(made)

def entry(state, given, count, keywords):
    clients = word(state, PREPARED)
    known = found(clients, given[0]) if keywords == 0 and count == 1 else 0
    scene = found(known, word(state, KEY)) if known != 0 else 0
    if scene != 0 and is_same(state, scene):
        Py_IncRef(scene)
        has_found = is_detected(state, scene)
        Py_DecRef(scene)
        if has_found:
            Py_IncRef(word(state, NONE))
            return word(state, NONE)
        PyErr_Clear()
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def detection_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


DETECTION = Front(detection_call, EntrySignature(_SOURCE))
"""performCollisionDetection."""
vars(detection_call)["front"] = DETECTION


def prepare(scene: PhysicsScene) -> None:
    """Let machine code detect contacts, once they were detected by the Python function."""
    world = scene.world
    known: Any = world.prepared.get(KIND)
    if known is None or world.is_stale:
        return
    found = world.stepping.detection(world.live_model, world.live_data)
    updates = world.frame_updates
    if found is None or updates.arguments is None or not world.keeps_frames:
        return
    known[0] = (
        *(world, scene.last_step, loaded(frame_updates.update_frames), *updates.arguments, updates.kept),
        *(found.kept, found.manifolds, loaded(found.collide), found.collided),
        *(loaded(found.execute), found.executed, found.finish, loaded(found.shift), found.shifted),
    )
