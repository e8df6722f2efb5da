"""`dataclass` for modules that every program loads: the standard library's, with methods that are made fast.

The standard library writes and compiles the source of each method of each class, 0.3 ms a class. Here methods
but `__init__` are closures over the names of the fields, and `__init__` is compiled when it is first used.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

from roboyard._lazy import deferred

with deferred("inspect"):  # for classes without a docstring only, and as long to import as the rest
    import dataclasses
    from dataclasses import MISSING, Field, FrozenInstanceError
    from dataclasses import replace as replace


class _Factory:
    """Default of parameters whose value is made by a function."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()
_KNOWN = {"frozen", "kw_only", "slots", "eq"}


def _dataclass(cls: type | None = None, /, **options: bool) -> Any:
    """Return a class as a data class, or the decorator for these options; see `dataclasses.dataclass`."""
    if cls is None:
        return lambda given: _made(given, options)
    return _made(cls, options)


def _made(cls: type, options: dict[str, bool]) -> type:
    if not options.keys() <= _KNOWN or _is_special(cls):
        return dataclasses.dataclass(**options)(cls)
    is_frozen, has_eq = options.get("frozen", False), options.get("eq", True)
    plain = {name: value for name, value in options.items() if name in ("kw_only", "slots")}
    if cls.__doc__ is None:
        cls.__doc__ = f"{cls.__name__}()"  # as the library does, which inspects the class for it
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, **plain)(cls)
    parameters = made.__dataclass_params__
    parameters.init = parameters.repr = True
    parameters.eq, parameters.frozen = has_eq, is_frozen
    own = vars(made)
    fields = dataclasses.fields(made)
    new: dict[str, Any] = {"__repr__": _repr([f.name for f in fields if f.repr])}
    if has_eq:
        new["__eq__"] = _equality(_values([f.name for f in fields if f.compare]))
        if "__hash__" not in own or (own["__hash__"] is None and "__eq__" in own):
            hashed = [f.name for f in fields if (f.compare if f.hash is None else f.hash)]
            new["__hash__"] = _hash(_values(hashed)) if is_frozen else None
    if is_frozen:
        new |= _guards(made, {f.name for f in fields})
        if options.get("slots"):
            new |= _state([f.name for f in fields])
    for name, method in new.items():
        if name not in own or name == "__hash__":
            if method is not None:
                method.__qualname__ = f"{made.__qualname__}.{name}"
            setattr(made, name, method)
    if "__init__" not in own:
        made.__init__ = _Init(made)
    return made


def _is_special(cls: type) -> bool:
    """Return whether a class has a frozen base or values for `__init__` only: the library makes these."""
    bases = (getattr(base, "__dataclass_params__", None) for base in cls.__mro__[1:])
    return any(p is not None and p.frozen for p in bases) or any(
        "InitVar" in str(kind) for kind in vars(cls).get("__annotations__", {}).values()
    )


def _values(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that gives the values of fields."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda record: tuple(getattr(record, name) for name in names)


def _equality(values: Callable[[Any], tuple[Any, ...]]) -> Any:
    def __eq__(self: Any, other: Any) -> Any:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash(values: Callable[[Any], tuple[Any, ...]]) -> Any:
    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__


def _repr(names: list[str]) -> Any:
    @recursive_repr()
    def __repr__(self: Any) -> str:
        shown = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{self.__class__.__qualname__}({shown})"

    return __repr__


def _guards(cls: Any, names: set[str]) -> dict[str, Any]:
    """Return what keeps a frozen class's fields as they are."""

    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


def _state(names: list[str]) -> dict[str, Any]:
    """Return how a frozen class with slots is copied and pickled."""

    def __getstate__(self: Any) -> list[Any]:
        return [getattr(self, name) for name in names]

    def __setstate__(self: Any, state: list[Any]) -> None:
        for name, value in zip(names, state, strict=True):
            object.__setattr__(self, name, value)

    return {"__getstate__": __getstate__, "__setstate__": __setstate__}


class _Init:
    """The place of a class's `__init__` until it is first used."""

    def __init__(self, cls: Any) -> None:
        self._cls = cls

    def __get__(self, record: Any, owner: Any = None) -> Any:
        """Compile the method, put it in its place, and return it, bound to the record if there is one."""
        made = _compiled_init(self._cls)
        if vars(self._cls).get("__init__") is self:
            self._cls.__init__ = made
        return made if record is None else made.__get__(record, owner)


def _compiled_init(cls: Any) -> Any:
    fields = dataclasses.fields(cls)
    values: dict[str, Any] = {"_set": object.__setattr__, "_factory": _FACTORY}
    given = [f for f in fields if f.init and not f.kw_only]
    named = [f for f in fields if f.init and f.kw_only]
    heads = ["self", *(_parameter(f) for f in given), *(["*"] if named else [])]
    heads += [_parameter(f) for f in named]
    lines = [line for f in fields for line in _assignment(f, cls, values)]
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    body = "\n  ".join(lines or ["pass"])
    source = f"def make({', '.join(values)}):\n def __init__({', '.join(heads)}):\n  {body}\n return __init__"
    module = sys.modules.get(cls.__module__)
    local: dict[str, Any] = {}
    exec(source, vars(module) if module else {}, local)  # noqa: S102 - names of our own fields
    made = local["make"](*values.values())
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    made.__annotations__ = {f.name: f.type for f in (*given, *named)} | {"return": None}
    return made


def _parameter(field: Field[Any]) -> str:
    if field.default is not MISSING:
        return f"{field.name}=_default_{field.name}"
    return f"{field.name}=_factory" if field.default_factory is not MISSING else field.name


def _assignment(field: Field[Any], cls: Any, values: dict[str, Any]) -> Iterator[str]:
    """Yield the line that sets a field, and put what it names into `values`."""
    name, value = field.name, field.name
    if field.default_factory is not MISSING:
        values[f"_make_{name}"] = field.default_factory
        value = f"_make_{name}()" + (f" if {name} is _factory else {name}" if field.init else "")
    elif field.default is not MISSING:
        values[f"_default_{name}"] = field.default
        if not field.init:
            if "__slots__" not in vars(cls):
                return  # the class has it
            value = f"_default_{name}"
    elif not field.init:
        return
    is_frozen = cls.__dataclass_params__.frozen
    yield f"_set(self, {name!r}, {value})" if is_frozen else f"self.{name} = {value}"


if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    dataclass = _dataclass

__all__ = ["dataclass"]
