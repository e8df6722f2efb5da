"""stepSimulation as machine code, where the last step was a few compiled calls that are the same now.

It applies motor commands that wait, sums masses that have changed, makes the calls, and notes that positions
are new. Everything else goes to the Python function; see `fast_entries`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from roboyard._records import NamedTuple
from roboyard.native import loaded
from roboyard.native.entry_parts import ATTRIBUTE, CALLED, FOUND, IS_DONE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.sim.stepping.impulses.records import DONE
from roboyard.sim.stepping.solver_warning import RAISED

if TYPE_CHECKING:
    from roboyard.pybullet.logs.log_set import LogSet
    from roboyard.pybullet.state.physics_scene import PhysicsScene

KIND, ONCE = "step", 1
"""Kind of what is prepared, and its key for a first step of the Python function."""


class StepState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    prepared: Any
    key: int = 0
    """Of what is prepared of the whole scene, and the number of reads of single links after a step."""
    none: None = None
    true: bool = True
    false: bool = False
    done: int = DONE
    answer: tuple[()] = ()
    moved: str = "is_moved"
    velocity_moved: str = "_velocity_moved"
    kept_frames: str = "kept_frames"
    old: str = "frames_are_old"
    single_reads: str = "single_reads"
    frames_revision: str = "frames_revision"
    motor_revision: str = "motor_revision"
    motor_forces: str = "_motor_forces"
    wrenches: str = "_wrenches"
    pending: str = "pending"
    pushed: str = "pushed"
    no_force: float = 0.0
    new: str = "_new"
    revision: str = "revision"
    inertia_changed: str = "_inertia_changed"
    boxes: str = "boxes_are_old"


_SOURCE = f"""
ITEMS, SIZE = 3, 2  # of tuples, in words
COMMAND, PREPARED, KEY, NONE, TRUE, FALSE, IS_DONE, ANSWER, MOVED, VELOCITY_MOVED, KEPT_FRAMES = range(3, 14)
OLD, SINGLE_READS, FRAMES_REVISION, MOTOR_REVISION, MOTOR_FORCES, WRENCHES, PENDING, PUSHED = range(14, 22)
NO_FORCE, NEW, CHANGES, INERTIA_CHANGED, BOXES = range(22, 27)
SCENE, WORLD, PUSHES, MANIFOLDS, REVISION, SAME, EMPTY_DICTS, EMPTY_LISTS, COMMANDS, FLUSH = range(3, 13)
FIND, FINDS, EXECUTE, EXECUTED, INTEGRATE, INTEGRATED, FINISH, RAISED, HEED = range(13, 22)
SETTINGS, CHANGED, FORCES, FILL_LINKS, FILL_JOINTS, OF_WORLD, OF_SCENE, SUM_INERTIA, STEPS = range(22, 31)
{parts(ATTRIBUTE, FOUND, CALLED, IS_DONE)}
@part
def is_same(state, scene):
    same = word(scene, SAME)
    for place in range(0, word(same, SIZE), 3):
        at = ITEMS + place
        if found(word(same, at), word(same, at + 1)) != word(same, at + 2):
            return False
    if attribute(word(scene, SETTINGS), word(state, CHANGES)) != word(scene, CHANGED):
        return False
    dicts, lists = word(scene, EMPTY_DICTS), word(scene, EMPTY_LISTS)
    new = found(word(scene, MANIFOLDS), word(state, NEW))
    if new == 0 or PyDict_Size(new) != 0:
        return False
    for place in range(word(dicts, SIZE)):
        if PyDict_Size(word(dicts, ITEMS + place)) != 0:
            return False
    for place in range(word(lists, SIZE)):
        if PyList_Size(word(lists, ITEMS + place)) != 0:
            return False
    return True

@part
def is_summed(state, scene):
    if found(word(scene, OF_WORLD), word(state, INERTIA_CHANGED)) != word(state, TRUE):
        return True
    return is_done(PyObject_Vectorcall(word(scene, SUM_INERTIA), words(), 0, 0))

@part
def is_flushed(scene):
    if PySequence_Size(word(scene, COMMANDS)) == 0:
        return True
    return is_done(PyObject_Vectorcall(word(scene, FLUSH), words(), 0, 0))

@part
def is_ended(state, scene, answer):
    passed = words()
    passed[0] = answer
    return is_done(PyObject_Vectorcall(word(scene, FINISH), passed, 1, 0))

@part
def forget_forces(state, scene):
    owner, passed = word(scene, FORCES), words()
    passed[0] = word(state, NO_FORCE)
    if found(word(scene, PUSHES), word(state, PUSHED)) == word(state, TRUE):
        is_done(PyObject_Vectorcall(word(scene, FILL_LINKS), passed, 1, 0))
        PyObject_SetAttr(owner, word(state, PUSHED), word(state, FALSE))
    is_done(PyObject_Vectorcall(word(scene, FILL_JOINTS), passed, 1, 0))
    PyObject_SetAttr(owner, word(state, PENDING), word(state, FALSE))

@part
def note(owner, attributes, name, value):
    if found(attributes, name) != value:
        PyObject_SetAttr(owner, name, value)

@part
def is_noted(state, scene):
    owner, attributes, none = word(scene, WORLD), word(scene, OF_WORLD), word(state, NONE)
    note(owner, attributes, word(state, MOVED), word(state, TRUE))
    note(owner, attributes, word(state, VELOCITY_MOVED), word(state, TRUE))
    note(owner, attributes, word(state, KEPT_FRAMES), none)
    if PyDict_Size(word(scene, RAISED)) != 0:
        if not is_done(PyObject_Vectorcall(word(scene, HEED), words(), 0, 0)):
            return False
    owner, attributes, revision = word(scene, SCENE), word(scene, OF_SCENE), word(scene, REVISION)
    note(owner, attributes, word(state, OLD), word(state, FALSE))
    note(owner, attributes, word(state, BOXES), word(state, FALSE))
    note(owner, attributes, word(state, SINGLE_READS), word(state, KEY))
    note(owner, attributes, word(state, FRAMES_REVISION), revision)
    note(owner, attributes, word(state, MOTOR_REVISION), revision)
    steps = numbers(word(scene, STEPS))
    steps[0] += 1.0
    note(owner, attributes, word(state, MOTOR_FORCES), none)
    note(owner, attributes, word(state, WRENCHES), none)
    return True

@part
def is_stepped(state, scene):
    is_done(called(word(scene, FIND), word(scene, FINDS)))
    answer = called(word(scene, EXECUTE), word(scene, EXECUTED))
    if answer == 0:
        return False
    if PyLong_AsLongLong(answer) != {DONE}:
        ended = is_ended(state, scene, answer)
        Py_DecRef(answer)
        return ended
    Py_DecRef(answer)
    if not is_done(called(word(scene, INTEGRATE), word(scene, INTEGRATED))):
        PyErr_Clear()  # positions are as before; the same call raises it again
        return is_ended(state, scene, word(state, IS_DONE))
    if found(word(scene, PUSHES), word(state, PENDING)) == word(state, TRUE):
        forget_forces(state, scene)
    return is_noted(state, scene)

def entry(state, given, count, keywords):
    clients = word(state, PREPARED)
    known = found(clients, given[0]) if keywords == 0 and count == 1 else 0
    scene = found(known, word(state, KEY)) if known != 0 else 0
    if scene != 0:
        Py_IncRef(scene)
        if is_flushed(scene) and is_same(state, scene) and is_summed(state, scene):
            done = is_stepped(state, scene)
            Py_DecRef(scene)
            if not done:
                return 0
            Py_IncRef(word(state, ANSWER))
            return word(state, ANSWER)
        Py_DecRef(scene)
        if PyErr_Occurred() != 0:
            return 0
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def step_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


STEP = Front(step_call, EntrySignature(_SOURCE))
"""stepSimulation."""
vars(step_call)["front"] = STEP


def prepare(scene: PhysicsScene, logs: LogSet) -> None:
    """Let machine code step, once the Python function has done so twice with the same bodies.

    Programs that make their world again and again take one step in it.
    """
    world, parameters = scene.world, scene.parameters
    known: Any = world.prepared.get(KIND)
    if known is None or (0 in known and _is_same(known[0])):
        return
    if ONCE not in known:
        known[ONCE] = ()
        return
    known.pop(0, None)
    step = world.direct_step()
    if step is None or not scene.knows_parameters or scene.parts > 1 or scene.new_bodies:
        return
    owners = (
        *step.kept, (scene, "parts"), (scene, "records_user_torques"), (scene.last_step, "_contacts"),
        (scene.last_step, "_seen"),
    )  # fmt: skip
    same = tuple(part for owner, name in owners for part in (vars(owner), name, getattr(owner, name)))
    data = world.live_data
    known[0] = (
        *(scene, world, vars(world.wrenches), vars(step.manifolds), world.revision, same),
        (scene.requested, scene.spring_dampers, scene.last_step.filtered, logs.recorders),
        (world.before_step, world.after_step),
        *(scene.pending_commands, scene.flush_motors),
        *(loaded(step.find), step.found, loaded(step.execute), step.executed),
        *(step.integrate, (world.live_model, data), scene.end_step, RAISED, world.heed_warning),
        *(parameters, parameters.revision, world.wrenches, data.xfrc_applied.fill, data.qfrc_applied.fill),
        *(vars(world), vars(scene), world.sum_inertia, scene.step_count),
    )


def _is_same(known: tuple[Any, ...]) -> bool:
    """Return whether attributes of objects are as they were when this was prepared."""
    parts, (parameters, revision) = iter(known[5]), known[-9:-7]
    are_same = all(owned.get(name) is value for owned, name, value in zip(parts, parts, parts, strict=True))
    return are_same and parameters.revision == revision
