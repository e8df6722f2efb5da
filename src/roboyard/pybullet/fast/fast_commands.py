"""Replacing commands by machine code once a program has called many; see `fast_entries`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

import numpy as np

from roboyard._lazy import LazyLogger
from roboyard.native.builtin import bound_function
from roboyard.native.fronts import Front
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.direct_calls import MOST, PREPARED, START

FEW = 15
"""After so many calls of a command its stored machine code is loaded, which takes as long as they do."""
_log = LazyLogger("roboyard")


def replace_pushes() -> None:
    """Replace applyExternalForce and applyExternalTorque."""
    from roboyard.pybullet.fast.fast_entries import PUSH

    names = "is_moved", "frames_are_old", "kept_frames", "pending", "pushed"
    _replace("applyExternalForce", PUSH, "push", (*names, True))
    _replace("applyExternalTorque", PUSH, "push", (*names, False))


def replace_boxes() -> None:
    """Replace getAABB."""
    from roboyard.pybullet.fast.fast_entries import BOX

    _replace("getAABB", BOX, "box", ("is_moved", "single_reads", "frames_are_old", "kept_frames"))


def replace_overlaps() -> None:
    """Replace getOverlappingObjects."""
    from roboyard.pybullet.fast.overlap_entries import OVERLAPS, OverlapState

    name = "getOverlappingObjects"
    replace(name, OVERLAPS, OverlapState(COMMANDS[name].function, PREPARED["overlaps"]))


def replace_rays() -> None:
    """Replace rayTest and rayTestBatch."""
    from roboyard.pybullet.fast.ray_entries import RAYS, RayState

    for name, is_batch in (("rayTest", False), ("rayTestBatch", True)):
        replace(name, RAYS, RayState(COMMANDS[name].function, PREPARED["rays"], is_batch))


def replace_motors() -> None:
    """Replace setJointMotorControl2, setJointMotorControlArray and the two forms for joints of any kind."""
    from roboyard.pybullet.fast.motor_entries import MOTORS

    forms = "Array", "MultiDofArray", "MultiDof", "2"  # with the numbers that the entry has
    for form, suffix in enumerate(forms):
        name = f"setJointMotorControl{suffix}"
        code, defaults = COMMANDS[name].function.__code__, COMMANDS[name].function.__defaults__ or ()
        by_name = dict(zip(reversed(code.co_varnames[: code.co_argcount]), reversed(defaults), strict=False))
        fastest = by_name.get("maxVelocity", -1.0)
        words = "pending", "time_step", form, fastest, PREPARED["torques"], "_bounds_in_use"
        _replace(name, MOTORS, "motors", words)


def replace_old_motors(function: Callable[..., Any], kp: float) -> None:
    """Replace setJointMotorControl, which no table has.

    Args:
        function: of the client and the arguments.
        kp: gain of positions, where setJointMotorControl2 is given none.
    """
    from roboyard.pybullet.fast.old_motor_entries import OLD, OldMotorState

    state = OldMotorState(function, START.replaced, kp)
    replace("setJointMotorControl", OLD, state, function)


def replace_joints() -> None:
    """Replace resetJointState and its forms for joints of any kind."""
    from roboyard.pybullet.fast.joint_entries import JOINTS

    names = "resetJointStatesMultiDof", "resetJointStateMultiDof", "resetJointState"
    for form, name in enumerate(names):  # with the numbers that the entry has
        _replace(name, JOINTS, "joints", ("is_moved", "_velocity_moved", "boxes_are_old", form))


def replace_joint_reads() -> None:
    """Replace what reads the state of joints."""
    from roboyard.pybullet.fast.joint_states import KIND, STATES, JointState

    for name, is_many, has_tuples in (
        ("getJointState", False, False),
        ("getJointStates", True, False),
        ("getJointStateMultiDof", False, True),
        ("getJointStatesMultiDof", True, True),
    ):
        state = JointState(COMMANDS[name].function, PREPARED[KIND], is_many, has_tuples)
        replace(name, STATES, state)


def replace_bases() -> None:
    """Replace resetBasePositionAndOrientation, resetBaseVelocity and getBaseVelocity."""
    from roboyard.pybullet.fast.base_entries import POSE, SPEED, VELOCITY

    words = "is_moved", "_velocity_moved", "fixed_poses", "placed", "boxes_are_old"
    _replace("resetBasePositionAndOrientation", POSE, "bases", words)
    _replace("resetBaseVelocity", SPEED, "bases", words)
    zero = (0.0, 0.0, 0.0)
    _replace("getBaseVelocity", VELOCITY, "bases", ((zero, zero),))


def replace_links() -> None:
    """Replace getLinkState and getLinkStates."""
    from roboyard.pybullet.fast.link_entries import KIND, LINKS

    names = "is_moved", "frames_are_old", "kept_frames", "frames_revision", "single_reads", "long_axes"
    for name, is_many in (("getLinkState", False), ("getLinkStates", True)):
        _replace(name, LINKS, KIND, (False, 0, is_many, *names))


def replace_constraint_reads() -> None:
    """Replace what reads constraints."""
    from roboyard.pybullet.fast.constraints.reads import COUNT, INFO, NUMBER, STATE, ReadState
    from roboyard.pybullet.state.constraint_records import NO_EFFORTS

    _replace("getConstraintState", STATE, "constraints", ("scene", "requested", NO_EFFORTS))
    for name, front in (
        ("getConstraintInfo", INFO),
        ("getNumConstraints", COUNT),
        ("getConstraintUniqueId", NUMBER),
    ):
        replace(name, front, ReadState(COMMANDS[name].function))


def replace_constraints() -> None:
    """Replace createConstraint and removeConstraint."""
    from roboyard.pybullet.fast.constraints.creation import CREATION, REMOVAL, CreationState, RemovalState

    replace("createConstraint", CREATION, CreationState(COMMANDS["createConstraint"].function))
    replace("removeConstraint", REMOVAL, RemovalState(COMMANDS["removeConstraint"].function))


def replace_dynamics() -> None:
    """Replace calculateInverseDynamics and calculateMassMatrix."""
    from roboyard.pybullet.fast.tree_entries import TREE

    names = "_applied_revision", "revision"
    _replace("calculateInverseDynamics", TREE, "efforts", (*names, False), one=0)
    _replace("calculateMassMatrix", TREE, "masses", (*names, True), one=0)


def replace_dynamics_info() -> None:
    """Replace getDynamicsInfo."""
    from roboyard.pybullet.fast.dynamics_entries import INFO, InfoState

    replace("getDynamicsInfo", INFO, InfoState(COMMANDS["getDynamicsInfo"].function))


def replace_settings(name: str) -> None:
    """Replace a command that stores settings."""
    from roboyard.pybullet.fast.settings_entries import SETTINGS, Settings
    from roboyard.pybullet.fast.settings_tables import table_of

    function = COMMANDS[name].function
    code = function.__code__
    (owner, table, revision), steps = table_of(name, code.co_varnames[1 : code.co_argcount])
    defaults = function.__defaults__ or ()  # the same objects as given for missing arguments
    first = len(steps) - len(defaults)
    steps = tuple(
        step if place < first else step._replace(default=defaults[place - first])
        for place, step in enumerate(steps)
    )
    kinds = np.array([step.kind for step in steps], np.int64)
    bounds = np.array([(step.least, step.most) for step in steps])
    replace(name, SETTINGS, Settings(function, kinds, bounds, owner, table, revision, steps))


def replace_properties(
    name: str,
    changes: Mapping[str, Callable[..., None]],
    lengths: Mapping[str, int] | None = None,
    records: str | None = None,
    present: Mapping[str, str] | None = None,
    kind: str | None = None,
    ignored: tuple[str, ...] = (),
    ranks: Mapping[str, int] | None = None,
    requests: tuple[str, Mapping[str, tuple[int, ...]]] | None = None,
) -> None:
    """Replace a command with many optional arguments.

    Args:
        name: of the command, whose other arguments are the client and integers.
        changes: optional argument to a function of those and of its number, or numbers.
        lengths: arguments that are several numbers, and how many, or SIGNED, PAIR or SIGNED_PAIR.
        records: attribute of the scene with records by the first integer, if any.
        present: arguments to the record's attribute that is equal where they change nothing.
        kind: of what functions prepare by `prepare_write`.
        ignored: arguments that change nothing.
        ranks: arguments to `Properties.ranks`.
        requests: attribute of the scene and arguments to `Properties.request_places`, if it has requests.
    """
    from roboyard.pybullet.fast.properties.entries import IGNORED, PROPERTIES, Properties

    function = COMMANDS[name].function
    code, defaults = function.__code__, function.__defaults__ or ()
    first = code.co_argcount - len(defaults)
    names = code.co_varnames[first : code.co_argcount]
    by_place = tuple(IGNORED if argument in ignored else changes.get(argument) for argument in names)
    sizes = tuple((lengths or {}).get(argument, 0) for argument in names)
    attributes = tuple((present or {}).get(argument) for argument in names)
    prepared = None if kind is None else PREPARED[kind]
    order = tuple((ranks or {}).get(argument, 0) for argument in names)
    owner, written = requests or (None, {})
    state = Properties(
        *(function, by_place, sizes, defaults, first, records, attributes),
        prepared=prepared,
        ranks=order,
        requests=owner,
        request_places=tuple(written.get(argument, ()) for argument in names),
    )
    replace(name, PROPERTIES, state)


def prepare_write(
    name: str, argument: str, prepared: Mapping[str, Any], kind: str, places: tuple[int, ...], write: Any
) -> None:
    """Let a command that is machine code do what an optional argument changes.

    Args:
        name: of the command.
        argument: of `replace_properties`.
        prepared: `Engine.prepared` of the world.
        kind: of what is prepared.
        places: the command's first arguments after the client.
        write: `properties.writes.Write`.
    """
    by_place: Any = prepared[kind]
    for place in places[:-1]:
        by_place = by_place.setdefault(place, {})
    function = COMMANDS[name].function
    count = len(function.__defaults__ or ())
    names = function.__code__.co_varnames[: function.__code__.co_argcount][-count:]
    by_place.setdefault(places[-1], [None] * count)[names.index(argument)] = write


def is_changed_again(
    name: str, argument: str, prepared: Mapping[str, Any], kind: str, places: tuple[int, ...]
) -> bool:
    """Return whether a command that is machine code has changed an argument before; see `prepare_write`.

    To prepare what many programs change once would take them longer.
    """
    known: Any = prepared.get(kind)
    if known is None or not is_machine_code(name):
        return False
    key = argument, *places
    if key in known:
        return True
    known[key] = True
    return False


def forget_write(
    name: str, argument: str, prepared: Mapping[str, Any], kind: str, places: tuple[int, ...]
) -> None:
    """Let the function of an argument do again what it changes; see `prepare_write`."""
    if places[0] in prepared[kind]:
        prepare_write(name, argument, prepared, kind, places, None)


def replace_appearance() -> None:
    """Replace changeVisualShape and resetVisualShapeData."""
    from roboyard.pybullet.fast.appearance_entries import APPEARANCE, AppearanceState

    for name in ("changeVisualShape", "resetVisualShapeData"):
        replace(name, APPEARANCE, AppearanceState(COMMANDS[name].function))


def replace_lines() -> None:
    """Replace what adds and removes debug drawings and sliders."""
    from roboyard.pybullet.fast.item_entries import (
        LINE,
        POINTS,
        REMOVAL,
        SLIDER,
        TEXT,
        ItemState,
        RemovalState,
        SliderState,
    )
    from roboyard.pybullet.state.debug_items import clock

    for name, front, place in (
        ("addUserDebugLine", LINE, 3),
        ("addUserDebugText", TEXT, 4),
        ("addUserDebugPoints", POINTS, 2),
    ):
        function = COMMANDS[name].function
        defaults: Any = function.__defaults__
        replace(name, front, ItemState(function, clock, defaults[place]))
    name = "addUserDebugParameter"
    function = COMMANDS[name].function
    replace(name, SLIDER, SliderState(function, function.__defaults__ or ()))
    replace("removeUserDebugItem", REMOVAL, RemovalState(COMMANDS["removeUserDebugItem"].function))


def replace_contacts() -> None:
    """Replace getContactPoints."""
    from roboyard.pybullet.fast.contact_entries import CONTACT, ContactState

    name = "getContactPoints"
    replace(name, CONTACT, ContactState(COMMANDS[name].function, PREPARED["contacts"]))


def replace_detection() -> None:
    """Replace performCollisionDetection."""
    from roboyard.pybullet.fast.steps.detection_entries import DETECTION, KIND, DetectionState

    name = "performCollisionDetection"
    replace(name, DETECTION, DetectionState(COMMANDS[name].function, PREPARED[KIND]))


def replace_step() -> None:
    """Replace stepSimulation."""
    from roboyard.pybullet.fast.steps.step_entries import KIND, STEP, StepState

    name = "stepSimulation"
    replace(name, STEP, StepState(COMMANDS[name].function, PREPARED[KIND]))


def replace_closest() -> None:
    """Replace getClosestPoints."""
    from roboyard.pybullet.fast.closest.entries import CLOSEST, KIND, ClosestState

    name = "getClosestPoints"
    replace(name, CLOSEST, ClosestState(COMMANDS[name].function, PREPARED[KIND]))


def replace_filters() -> None:
    """Replace setCollisionFilterGroupMask."""
    from roboyard.pybullet.fast.filter_entries import FILTER, FilterState

    name = "setCollisionFilterGroupMask"
    replace(name, FILTER, FilterState(COMMANDS[name].function))


def replace_user_data() -> None:
    """Replace addUserData, getUserDataId, getUserData and removeUserData."""
    from roboyard.pybullet.fast.data_entries import DATA, DATA_ID, DATA_REMOVAL, DATA_VALUE, DataState

    for name, front in (
        ("addUserData", DATA),
        ("getUserDataId", DATA_ID),
        ("getUserData", DATA_VALUE),
        ("removeUserData", DATA_REMOVAL),
    ):
        replace(name, front, DataState(COMMANDS[name].function))


def is_machine_code(name: str) -> bool:
    """Return whether a command is machine code as a whole."""
    return name in _machine_code


_machine_code: set[str] = set()


def _replace(name: str, front: Front, kind: str, words: tuple[Any, ...], *, one: int = 1) -> None:
    """Replace a command by machine code that needs what is prepared of a body; see `replace`.

    Args:
        name: of the command.
        front: its entry.
        kind: of what is prepared.
        words: further objects of the entry's state.
        one: whole number in its state.
    """
    replace(name, front, (COMMANDS[name].function, PREPARED[kind], None, True, one, *words))


def replace(
    name: str, front: Front, state: tuple[Any, ...], command: Callable[..., Any] | None = None
) -> None:
    """Replace a command by stored machine code after a few calls; compile it after many without any.

    Args:
        name: of the command.
        front: its entry.
        state: of the entry.
        command: the function of the command, if it is not that of the table.
    """
    function, calls = command or COMMANDS[name].function, count(1)

    def load() -> None:
        address = front.address()
        if address:
            START.replace(name, bound_function(name, address, state))
            _machine_code.add(name)

    def counted(*given: Any) -> Any:
        number = next(calls)
        if number == FEW and front.is_stored:
            load()
        elif number == MOST:
            START.replace(name, function)
            if front.is_cheap:
                _log.warning("compiling %s for this machine: once, about 5 seconds", name)
                load()
        return function(*given)

    if not FEW and front.is_stored:
        load()
    else:
        START.replace(name, counted)
