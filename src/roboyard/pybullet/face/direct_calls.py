"""Data from which machine code calls commands directly, and when that begins; see `entries`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from ctypes import POINTER, c_int64, c_void_p, cast, sizeof
from functools import partial
from itertools import count
from types import MappingProxyType
from typing import Any

from roboyard._records import NamedTuple
from roboyard.errors import RoboyardError
from roboyard.pybullet.face.command_names import (
    KEPT_ANSWERS,
    KEPT_FAILURES,
    KINDS,
    changed_answers,
)
from roboyard.pybullet.face.errors import error, world_failure
from roboyard.pybullet.face.turns import TURNS

REFUSED = (RoboyardError, ValueError)
"""Errors of the layers below for values that they refuse; scripts get them as `error`."""
MANY, MOST = 150, 5000
"""After so many calls stored machine code is loaded (1 ms), or it is compiled once and for all."""
DIRECT: dict[int, Any] = {}
"""Clients in this process, by number, whose methods are the commands themselves."""
PREPARED: dict[str, dict[Any, dict[int, Any]]] = {
    kind: {}
    for kind in (
        *("push", "box", "motors", "efforts", "masses", "joints", "constraints", "dynamics", "pivots"),
        *("contacts", "torques", "bases", "rays", "overlaps", "closest", "velocities", "links", "read"),
        "states",
        *("detection", "step"),
    )
}
"""Kind to clients of `DIRECT` to bodies to what commands that are machine code need of them."""
MARKS: tuple[list[object], ...] = tuple([object(), None] for _ in range(KINDS))
"""By kind of answers: the mark of those that are valid, which is another one after a change, and the one that
was the mark when such an answer was found last."""
_MOST_FAILURES = 1000
_known: list[dict[Any, Any]] = []
"""Kept answers of all commands."""


class Call(NamedTuple):
    """A command as the machine code sees it; `entries.SOURCE` has the same order."""

    clients: dict[int, Any]
    """`DIRECT`, which is also the mark for nothing below."""
    command: Callable[..., Any]
    failure: Callable[[Exception], None]
    """Raises what scripts get for what the command raised."""
    client_name: str
    zero: int
    names: tuple[str, ...]
    """Names of its parameters."""
    defaults: tuple[Any, ...]
    """Defaults of the last of them."""
    known: dict[Any, tuple[object, Any]]
    """Its kept answers by the arguments, each after the mark that it was kept with."""
    marks: list[object]
    """The one of `MARKS` of its kind."""
    changed: tuple[list[object], ...]
    """Those of `MARKS` of the answers that the command may change."""
    free: Any = None
    """The function of Python where it is no command."""
    error: type[Exception] = error
    """Exceptions that scripts get as they were raised."""
    integers: Any = None
    short_integers: Any = None
    """NumPy's types of 64 and 32 bits."""
    failed: Any = DIRECT
    """A mark and the failures by the arguments that were kept with it, each texts and notes of an `error`."""
    failure_marks: Any = DIRECT
    """The one of `MARKS` that failures depend on."""
    keep_failure: Any = None
    notes: str = sys.intern("__notes__")
    old_names: tuple[str, ...] = ()
    """Old spellings of parameters, each before its current name."""
    turns: Any = None
    """`Turns.machine`."""
    other_thread: Any = None
    """Called when another thread calls than the one that enters machine code."""


def open_to_machine_code(number: int, client: Any) -> None:
    """Let machine code call the commands of a client."""
    DIRECT[number] = client
    for kind, clients in PREPARED.items():
        clients[client] = client.prepared[kind]


def close_to_machine_code(number: int) -> None:
    """Forget a client; an unknown number is ignored."""
    client = DIRECT.pop(number, None)
    for clients in PREPARED.values():
        clients.pop(client, None)
    forget()


def call_of(
    command: Callable[..., Any],
    names: tuple[str, ...],
    defaults: tuple[Any, ...],
    aliases: Mapping[str, str] = MappingProxyType({}),
) -> Call:
    """Return what the machine code needs to call a command.

    Args:
        command: of the client and the parameters.
        names: of the parameters.
        defaults: of the last of them.
        aliases: old spelling of a parameter to its current name.
    """
    import numpy as np  # loaded by now, in parts (`load_numpy`)

    name = command.__name__
    fails = name in KEPT_FAILURES
    return Call(
        clients=DIRECT,
        command=START.replaced.get(name, command),
        failure=partial(fail, name),
        client_name=sys.intern("physicsClientId"),
        zero=0,
        names=tuple(map(sys.intern, names)),
        defaults=defaults,
        known=kept_answers() if name in KEPT_ANSWERS else DIRECT,
        marks=MARKS[KEPT_ANSWERS.get(name, 0)],
        changed=tuple(MARKS[kind] for kind in changed_answers(name)),
        integers=np.int64,
        short_integers=np.int32,
        failed=[None, kept_answers()] if fails else DIRECT,
        failure_marks=MARKS[KEPT_FAILURES[name]] if fails else DIRECT,
        keep_failure=keep_failure,
        old_names=tuple(sys.intern(name) for pair in aliases.items() for name in pair),
        turns=TURNS.in_machine(),
        other_thread=START.change_thread,
    )


def kept_answers() -> dict[Any, Any]:
    """Return a new table of kept answers, which `forget` empties."""
    _known.append({})
    return _known[-1]


def keep_failure(failed: list[Any], marks: list[object], key: Any, problem: Exception) -> None:
    """Keep an error for calls with the same arguments, but for the first since what it depends on changed.

    Args:
        failed: see `Call.failed`.
        marks: the list of `MARKS` that it depends on.
        key: of the arguments.
        problem: an `error`, of no other class.
    """
    mark, failures = marks[0], failed[1]
    if failed[0] is not mark:
        failed[0] = marks[1] = mark  # so that a change renews it
        failures.clear()
        return
    if len(failures) > _MOST_FAILURES:
        failures.clear()
    failures[key] = problem.args, tuple(getattr(problem, "__notes__", ()))


def fail(name: str, problem: Exception) -> None:
    """Raise `error` for what the world refuses, and any other exception as it is."""
    if isinstance(problem, error) or not isinstance(problem, REFUSED):
        raise problem
    raise world_failure(name, problem) from problem


def forget() -> None:
    """Drop all kept answers."""
    for marks in MARKS:
        marks[:] = object(), None
    for known in _known:
        known.clear()


class Start:
    """Counts the calls of commands; after many of them built-ins enter the machine code."""

    def __init__(self) -> None:
        """Begin to count."""
        self.numbers = count(1)
        self._address = 0
        self._definitions: list[tuple[Any, int]] = []
        """Definitions of built-ins, and the function that each had first."""
        self.waiting: list[tuple[Callable[[], None], tuple[str, ...]]] = []
        self._waits = True
        self.functions: dict[str, Any] = {}
        """Public functions by name, as far as there are any."""
        self.replaced: dict[str, Any] = {}
        """Functions that are called for commands instead of theirs, by name."""

    def later(self, load: Callable[[], None], *commands: str) -> None:
        """Call a function once machine code is used, at once if it is.

        Args:
            load: replaces the commands.
            commands: names; it is called when one of them is first called then, at once without any.
        """
        self.waiting.append((load, commands))
        if self._address:
            self._prepare(load, commands)

    def _prepare(self, load: Callable[[], None], commands: tuple[str, ...]) -> None:
        if not (commands and self._waits):
            load()
            return
        for name in commands:
            self.replace(name, partial(self._first, load, name))

    def _first(self, load: Callable[[], None], name: str, *given: Any) -> Any:
        load()
        return self.replaced[name](*given)

    def replace(self, name: str, command: Any) -> None:
        """Call another function for a command."""
        self.replaced[name] = command
        if name in self.functions:
            (cell,) = self.functions[name].__closure__
            cell.cell_contents = cell.cell_contents._replace(command=command)

    def enter(self, *, waits: bool = True) -> None:
        """Load the machine code, where that costs little, and let all built-ins enter it.

        Args:
            waits: whether commands are replaced when they are first called, not at once.
        """
        from roboyard.pybullet.face.entries import FRONT

        if waits and TURNS.is_shared():
            return
        TURNS.own()
        self._waits = waits
        is_last = next(self.numbers) > MOST
        self._address = FRONT.address() if FRONT.is_stored or (is_last and FRONT.is_cheap) else 0
        for definition, _ in self._definitions if self._address else ():
            definition.function = self._address
        for load, commands in self.waiting if self._address else ():
            self._prepare(load, commands)

    def append(self, definition: Any) -> None:
        """Take the definition of a built-in, which enters the machine code now or later."""
        self._definitions.append((definition, definition.function))
        if self._address:
            definition.function = self._address

    def change_thread(self) -> None:
        """Call functions of Python from all built-ins again, where another thread than the owner calls.

        Where the owner has ended, the other one owns machine code from now on.
        """
        if not TURNS.has_owner():
            TURNS.own()
            return
        self._address = 0
        for definition, function in self._definitions:
            definition.function = function
        TURNS.wait_for_machine()


def _objects_are_as_known() -> bool:
    """Return whether types, tuples and cells are where the machine code reads them."""
    if sys.implementation.name != "cpython" or sizeof(c_void_p) != 8:
        return False

    def words(value: object) -> Any:
        return cast(id(value), POINTER(c_int64))

    cell = (lambda: words).__closure__
    assert cell is not None
    return (
        words(words)[1] == id(type(words))
        and words(cell)[2:4] == [1, id(cell[0])]
        and words(cell[0])[2] == id(words)
    )


START = Start()
CAN_START = _objects_are_as_known()
