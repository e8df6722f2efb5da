"""Functions that scripts can call like PyBullet's: real built-ins with keyword names and defaults.

`pybullet_utils.bullet_client` passes `physicsClientId` only to attributes for which `inspect.isbuiltin` is
true, so plain functions would all run on client 0. CPython's C API provides what is needed: a built-in
method of the FASTCALL kind calls a C function with (self, arguments, count, keyword names), which is the
signature of `PyObject_Vectorcall`. A method table entry that points to it, bound to a Python function, is a
built-in that costs about 20 ns more than the function. Other interpreters get a callable object that passes
the same test.
"""

from __future__ import annotations

import ctypes
import functools
import sys
import types
import typing
from _thread import get_ident
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

from roboyard._bytecode import code_of
from roboyard.pybullet.face.command_names import changed_answers
from roboyard.pybullet.face.direct_calls import (
    CAN_START,
    DIRECT,
    MANY,
    MARKS,
    MOST,
    REFUSED,
    START,
    Call,
    call_of,
    fail,
    kept_answers,
)
from roboyard.pybullet.face.errors import error, world_failure
from roboyard.pybullet.face.turns import TURNS

MANY_CALLS, MOST_CALLS = 100, 5000
"""After so many calls a stored front is loaded (0.3 ms), or one is compiled once and for all (0.7 s)."""
_FASTCALL_WITH_KEYWORDS = 0x0080 | 0x0002
_VARIABLE, _VARIABLE_KEYWORDS = 0x04, 0x08  # CO_VARARGS, CO_VARKEYWORDS
_NO_DEFAULT: Any = object()
_MODULE = __name__.removesuffix(".face.calling")


class _MethodDefinition(ctypes.Structure):
    """PyMethodDef of CPython's C API."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


_definitions: list[_MethodDefinition] = []
"""Built-ins keep pointers to these, which Python reads once more when it frees a built-in at its very end."""


def builtin(function: types.FunctionType) -> Callable[..., Any]:
    """Return `function` as an object for which `inspect.isbuiltin` is true, with its signature."""
    if sys.implementation.name != "cpython" or not hasattr(ctypes.pythonapi, "PyObject_Vectorcall"):
        return _BuiltinProxy(function)
    text = f"{function.__name__}{_text_signature(function)}\n--\n\n{_documentation(function)}"
    definition = _MethodDefinition(
        function.__name__.encode(),
        ctypes.cast(ctypes.pythonapi.PyObject_Vectorcall, ctypes.c_void_p).value,
        _FASTCALL_WITH_KEYWORDS,
        text.encode(),
    )
    if not _definitions:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(_definitions))  # they outlive all modules
    _definitions.append(definition)
    entered = getattr(function, "entered", None)
    if entered is not None:
        entered.append(definition)
    new = ctypes.pythonapi.PyCFunction_NewEx
    new.restype = ctypes.py_object
    new.argtypes = (ctypes.POINTER(_MethodDefinition), ctypes.py_object, ctypes.py_object)
    made = new(ctypes.byref(definition), function, _MODULE)
    # A built-in pickles as getattr(self, name); its self is the function, which pickles by its module.
    setattr(function, function.__name__, made)
    return made


def _text_signature(function: types.FunctionType) -> str:
    """Return the signature, with defaults that `inspect` can parse from a docstring."""
    wrapped = getattr(function, "__wrapped__", function)
    plain, keywords = _parameters(wrapped)
    shown = [_with_default(name, default) for name, default in plain]
    flags, names = wrapped.__code__.co_flags, wrapped.__code__.co_varnames[len(plain) + len(keywords) :]
    if flags & _VARIABLE:
        shown.append(f"*{names[0]}")
        names = names[1:]
    elif keywords:
        shown.append("*")
    shown += [_with_default(name, default) for name, default in keywords]
    if flags & _VARIABLE_KEYWORDS:
        shown.append(f"**{names[0]}")
    return f"({', '.join(shown)})"


def _with_default(name: str, default: Any) -> str:
    if default is _NO_DEFAULT:
        return name
    return f"{name}={default if isinstance(default, int | float | str | tuple) else None!r}"


def _parameters(function: types.FunctionType) -> tuple[list[tuple[str, Any]], list[tuple[str, Any]]]:
    """Return the parameters of a function and those that are keywords only: their names and defaults.

    Loading `inspect` takes longer than all calls of this in a program.
    """
    code, defaults = function.__code__, function.__defaults__ or ()
    plain = code.co_varnames[: code.co_argcount]
    keywords = code.co_varnames[code.co_argcount : code.co_argcount + code.co_kwonlyargcount]
    without = (_NO_DEFAULT,) * (len(plain) - len(defaults))
    given = function.__kwdefaults__ or {}
    return (
        list(zip(plain, without + defaults, strict=True)),
        [(name, given.get(name, _NO_DEFAULT)) for name in keywords],
    )


def _documentation(function: types.FunctionType) -> str:
    """Return the docstring without the spaces before its lines, as `inspect.getdoc` does."""
    text = function.__doc__
    if not text or "\n" not in text:
        return text or ""
    first, *lines = text.split("\n")
    margin = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
    rest = "\n".join(line[margin:] if line.strip() else "" for line in lines)
    return f"{first.lstrip()}\n{rest.rstrip()}"


class _BuiltinProxy:
    """Calls a function and reports the class of built-ins, which `isinstance` accepts."""

    def __init__(self, function: types.FunctionType) -> None:
        self._function = function
        self.__name__ = function.__name__
        self.__doc__ = function.__doc__
        import inspect

        self.__signature__ = inspect.signature(function)

    @property
    def __class__(self) -> type:  # type: ignore[override]
        return types.BuiltinFunctionType

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._function(*args, **kwargs)

    def __repr__(self) -> str:
        return f"<built-in function {self.__name__}>"


MISSING: Any = type("Missing", (), {"__repr__": lambda self: "<required>", "__slots__": ()})()


def public(
    command: Callable[..., Any], clients: Mapping[int, Any], aliases: Mapping[str, str], module: str
) -> types.FunctionType:
    """Return the function that scripts call for a command.

    Args:
        command: `name(client, a, b=..., ...)`.
        clients: open clients by number; each has the commands as methods.
        aliases: old spelling of a parameter to its current name.
        module: name of the module where the caller stores the function, for pickling.

    Returns:
        `name(a, b=..., ..., physicsClientId=0)`, which calls `clients[physicsClientId].name(a, b, ...)`.
        It also accepts the aliases as keywords. Wrong or missing arguments raise TypeError; what the world
        refuses raises `error`.
    """
    name = command.__name__
    parameters = _parameters(typing.cast(types.FunctionType, command))[0][1:]
    values: dict[str, Any] = {"_clients": clients, "_missing": MISSING, "_required": _required}
    shown, passed, required = [], [], []
    for parameter, default in parameters:
        passed.append(parameter)
        if default is not _NO_DEFAULT:
            values[f"_{parameter}"] = default
            shown.append(f"{parameter}=_{parameter}")
        elif aliases:
            required.append(parameter)
            shown.append(f"{parameter}=_missing")
        else:
            shown.append(parameter)
    shown.append("physicsClientId=0")
    lines = []
    if aliases:
        shown += ["*", *(f"{alias}=_missing" for alias in aliases)]
        for alias, current in aliases.items():
            lines.append(f"if {alias} is not _missing: {current} = {alias}")
    if required:
        missing = " or ".join(f"{p} is _missing" for p in required)
        lines.append(f"if {missing}: _required({name!r}, {', '.join(f'{p}={p}' for p in required)})")
    values |= {"_error": error, "_refused": REFUSED}
    lines += [
        "try:",
        f"    return _clients[physicsClientId].{name}({', '.join(passed)})",
        "except _error:",
        "    raise",
        "except _refused as problem:",
        "    _call.failure(problem)",
    ]
    if CAN_START:
        values |= {"_next": next, "_numbers": START.numbers, "_when": (MANY, MOST), "_enter": START.enter}
        lines.insert(0, "if _next(_numbers) in _when: _enter()")
    values |= {"_turn": TURNS.lock, "_callers": TURNS.callers, "_thread": get_ident}
    lines = ["_callers.add(_thread())", "with _turn:", *(f"    {line}" for line in lines)]
    source = "\n    ".join((f"def public(_call):\n  def {name}({', '.join(shown)}):", *lines))
    exec(code_of(f"{source}\n  return {name}", f"<{_MODULE}.{name}>"), values)  # noqa: S102 - our own source
    made: Any = values["public"](
        call_of(command, tuple(passed), getattr(command, "__defaults__", None) or (), aliases)
    )
    made.__doc__ = command.__doc__
    made.__module__, made.__qualname__ = module, name
    if CAN_START:
        made.entered = START
        START.functions[name] = made
    return made


def refusing(function: types.FunctionType) -> types.FunctionType:
    """Return a free function that raises `error` for what the world refuses, as those of commands do."""
    waits = function.__name__ == "connect"  # for a server, maybe one of this process

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs) if waits else TURNS.call(function, *args, **kwargs)
        except error:
            raise
        except REFUSED as problem:
            raise world_failure(function.__name__, problem) from problem

    return typing.cast(types.FunctionType, call)


def counted(function: Any) -> types.FunctionType:
    """Return a function that counts its calls; its built-in enters the compiled front after many.

    Args:
        function: a function with a `front`; see `roboyard.native.fronts`.
    """
    calls, front = count(1), function.front
    definitions: list[_MethodDefinition] = []

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        number = next(calls)
        if (number == MANY_CALLS and front.is_stored) or (number == MOST_CALLS and front.is_cheap):
            address = front.address()
            for definition in definitions if address else ():
                definition.function = address
        return function(*args, **kwargs)

    made = typing.cast(Any, call)
    made.entered = definitions
    return made


def kept(function: Any, answer: int) -> types.FunctionType:
    """Return a free function without arguments whose answer is the same for all clients in this process.

    Args:
        function: a function of `physicsClientId` alone.
        answer: what it returns for such clients; the machine code of commands returns it.
    """
    if not CAN_START:
        return typing.cast(types.FunctionType, function)

    def command(_client: Any) -> int:
        return answer

    call = call_of(command, (), ())._replace(known=kept_answers(), changed=(), free=function)
    made: Any = _with_call(call)
    made.entered = START
    return made


class _First(int):
    """The number of client 0, which a script cannot give."""


def of_first_client(
    function: Any, command: Callable[..., Any], most: int, similar: str
) -> types.FunctionType:
    """Return a free function that takes no keywords and uses client 0; the machine code calls the command.

    Args:
        function: of the arguments.
        command: of the client and the arguments.
        most: the largest number of arguments.
        similar: a command that changes the same answers.
    """
    if not CAN_START:
        return typing.cast(types.FunctionType, function)
    name, places = function.__name__, tuple(range(most))  # which no keyword is
    call = Call(
        clients=DIRECT,
        command=START.replaced.get(name, command),
        failure=functools.partial(fail, name),
        client_name=typing.cast(Any, places),
        zero=_First(0),
        names=typing.cast(Any, places),
        defaults=(None,) * most,
        known=DIRECT,
        marks=MARKS[0],
        changed=tuple(MARKS[kind] for kind in changed_answers(similar)),
        free=function,
        turns=TURNS.in_machine(),
        other_thread=START.change_thread,
    )
    made = _with_call(call)
    made.entered = START
    START.functions[name] = made
    return made


def _with_call(call: Call) -> Any:
    """Return a function whose only closure is a call, where the machine code finds it."""

    @functools.wraps(call.free)
    def free(*args: Any, **kwargs: Any) -> int:
        return TURNS.call(_count_and_call, call.free, *args, **kwargs)

    return free


def _count_and_call(function: Callable[..., int], *args: Any, **kwargs: Any) -> int:
    if next(START.numbers) in (MANY, MOST):
        START.enter()
    return function(*args, **kwargs)


def _required(name: str, **given: object) -> None:
    absent = [repr(parameter) for parameter, value in given.items() if value is MISSING]
    s = "s" if len(absent) > 1 else ""
    raise TypeError(f"{name}() missing {len(absent)} required argument{s}: {', '.join(absent)}")
