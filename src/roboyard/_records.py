"""`dataclass` and `NamedTuple` for modules that every program loads: the library's, with methods made fast.

The standard library writes and compiles the source of each method of each class, 0.3 ms a class. Here methods
but `__init__` are closures over the names of the fields, and `__init__` is compiled when it is first used, or
comes from stored bytecode.
"""

from __future__ import annotations

import sys
from abc import update_abstractmethods
from collections import _tuplegetter  # pyright: ignore[reportAttributeAccessIssue]
from collections.abc import Callable, Iterator
from functools import cache
from operator import attrgetter
from reprlib import recursive_repr
from types import MemberDescriptorType
from typing import TYPE_CHECKING, Any, ClassVar

from roboyard._bytecode import code_of
from roboyard._lazy import deferred

with deferred("inspect"):  # for classes without a docstring only, and as long to import as the rest
    import dataclasses
    from dataclasses import MISSING, Field, FrozenInstanceError, field
    from dataclasses import replace as replace


@dataclasses.dataclass(init=False, repr=False, eq=False)
class _Sample:
    """A class with a field of each kind."""

    real: int
    of_class: ClassVar[int]


_KINDS: dict[str, Any] = vars(_Sample)["__dataclass_fields__"]
_REAL, _OF_CLASS = (_KINDS[name]._field_type for name in ("real", "of_class"))
_OURS = __name__.partition(".")[0] + "."


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
    kinds: dict[str, Any] = cls.__annotations__
    if not options.keys() <= _KNOWN or _is_special(cls, kinds):
        return dataclasses.dataclass(**options)(cls)
    is_frozen, has_eq = options.get("frozen", False), options.get("eq", True)
    by_name = _fields(cls, kinds, options.get("kw_only", False))
    fields = [f for f in by_name.values() if f._field_type is _REAL]
    names = [f.name for f in fields]
    own, init = vars(cls), _Init()
    methods: dict[str, Any] = {"__repr__": _repr([f.name for f in fields if f.repr])}
    if has_eq:
        methods["__eq__"] = _equality(_values([f.name for f in fields if f.compare]))
    if is_frozen:
        methods |= _guards(init, names)
        if options.get("slots"):
            methods |= _state(names)
    new: dict[str, Any] = {name: method for name, method in methods.items() if name not in own}
    if has_eq and ("__hash__" not in own or (own["__hash__"] is None and "__eq__" in own)):
        hashed = [f.name for f in fields if (f.compare if f.hash is None else f.hash)]
        new["__hash__"] = _hash(_values(hashed)) if is_frozen else None
    for name, method in new.items():
        if method is not None:
            method.__qualname__ = f"{cls.__qualname__}.{name}"
    if "__init__" not in own:
        new["__init__"] = init
    if "__match_args__" not in own:
        new["__match_args__"] = tuple(f.name for f in fields if f.init and not f.kw_only)
    if cls.__doc__ is None:
        new["__doc__"] = f"{cls.__name__}()"  # as the library does, which inspects the class for it
    new["__dataclass_fields__"] = by_name
    new["__dataclass_params__"] = _parameters(frozenset(options.items()))
    if options.get("slots"):
        cls = _with_slots(cls, names, new)
    else:
        for name, value in new.items():
            setattr(cls, name, value)
        update_abstractmethods(cls)
    init.cls = cls
    return cls


def _is_special(cls: type, kinds: dict[str, Any]) -> bool:
    """Return whether the library makes a class: one with a frozen base, or annotations that are no fields."""
    bases = (getattr(base, "__dataclass_params__", None) for base in cls.__mro__[1:-1])
    return any(p is not None and p.frozen for p in bases) or any(
        not isinstance(kind, str) or "InitVar" in kind or "KW_ONLY" in kind for kind in kinds.values()
    )


def _fields(cls: Any, kinds: dict[str, str], kw_only: bool) -> dict[str, Any]:
    """Return the fields of a class and its bases, and put defaults in their places as class attributes."""
    found: dict[str, Any] = {}
    for base in cls.__mro__[-2:0:-1]:
        found |= getattr(base, "__dataclass_fields__", {})
    for name, kind in kinds.items():
        given = getattr(cls, name, MISSING)
        if isinstance(given, Field):
            made: Any = given
            if made.default is MISSING:
                delattr(cls, name)
            else:
                setattr(cls, name, made.default)
        else:
            made = field(default=MISSING if isinstance(given, MemberDescriptorType) else given)
        made.name, made.type, made._field_type = name, kind, _REAL
        if kind.startswith(("ClassVar", "typing.ClassVar")):
            made._field_type = _OF_CLASS
        elif made.kw_only is MISSING:
            made.kw_only = kw_only
        if made._field_type is _REAL and type(made.default).__hash__ is None:
            raise ValueError(f"mutable default {type(made.default)} for field {name}: use default_factory")
        found[name] = made
    for name, value in vars(cls).items():
        if isinstance(value, Field):
            raise TypeError(f"{name!r} is a field but has no type annotation")
    return found


@cache
def _parameters(options: frozenset[tuple[str, bool]]) -> Any:
    """Return what the library keeps of the options of classes."""
    given = dict(options)
    plain = {name: value for name, value in given.items() if name in ("kw_only", "slots")}
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, **plain)(
        type("Empty", (), {"__doc__": "Empty."})
    )
    parameters = made.__dataclass_params__
    parameters.init = parameters.repr = True
    parameters.eq, parameters.frozen = given.get("eq", True), given.get("frozen", False)
    return parameters


def _with_slots(cls: Any, names: list[str], new: dict[str, Any]) -> Any:
    """Return a new class like another, with slots for its fields and these names."""
    own = vars(cls)
    if "__slots__" in own:
        raise TypeError(f"{cls.__name__} already specifies __slots__")
    inherited = {name for base in cls.__mro__[1:-1] for name in vars(base).get("__slots__", ())}
    left_out = {*names, "__dict__", "__weakref__"}
    kept = {name: value for name, value in own.items() if name not in left_out}
    slots = tuple(name for name in names if name not in inherited)
    made = type(cls)(cls.__name__, cls.__bases__, kept | new | {"__slots__": slots})
    made.__qualname__ = cls.__qualname__
    return made


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


def _guards(place: _Init, names: list[str]) -> dict[str, Any]:
    """Return what keeps a frozen class's fields as they are."""

    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is place.cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(place.cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is place.cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(place.cls, self).__delattr__(name)

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

    cls: Any = None
    """The class, set once it is made."""

    def __get__(self, record: Any, owner: Any = None) -> Any:
        """Compile the method, put it in its place, and return it, bound to the record if there is one."""
        made = _compiled_init(self.cls)
        if vars(self.cls).get("__init__") is self:
            self.cls.__init__ = made
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
    code: Any = code_of(source) if cls.__module__.startswith(_OURS) else source
    exec(code, vars(module) if module else {}, local)  # noqa: S102 - names of our own fields
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


class _TupleClass(type):
    """Makes classes of named tuples; a direct base of theirs is only `tuple`, as of the library's."""

    def __new__(metacls, name: str, bases: tuple[type, ...], body: dict[str, Any]) -> Any:
        fields = tuple(map(sys.intern, body["__annotations__"]))
        defaults = {field: body[field] for field in fields if field in body}
        if tuple(defaults) != fields[len(fields) - len(defaults) :]:
            raise TypeError(f"{name}: fields without a default follow {', '.join(defaults)}, which have one")
        listed = ", ".join(fields) + ("," if len(fields) == 1 else "")  # as the library has it
        text = f"def __new__(_cls, {listed}):\n return _tuple_new(_cls, ({listed}))"
        values: dict[str, Any] = {
            "_tuple_new": tuple.__new__,
            "__builtins__": {},
            "__name__": f"namedtuple_{name}",
        }
        exec(code_of(text), values)  # noqa: S102 - names of our own fields
        new = values["__new__"]
        new.__defaults__ = tuple(defaults.values()) or None
        new.__qualname__ = f"{name}.__new__"
        new.__annotations__ = body["__annotations__"]
        made: dict[str, Any] = {
            "__doc__": f"{name}({listed})",
            "__slots__": (),
            "_fields": fields,
            "_field_defaults": defaults,
            "__match_args__": fields,
            **_TUPLE_METHODS,
            **body,
            **{field: _tuplegetter(k, f"Alias for field number {k}") for k, field in enumerate(fields)},
            "__new__": new,
        }
        return type(name, (tuple,), made)


def _make(cls: Any, iterable: Any) -> Any:
    """Return a tuple of this class with the values of an iterable."""
    result = tuple.__new__(cls, iterable)
    if len(result) != len(cls._fields):
        raise TypeError(f"Expected {len(cls._fields)} arguments, got {len(result)}")
    return result


def _replace(self: Any, /, **values: Any) -> Any:
    """Return a tuple like this one with other values for some fields."""
    result = self._make(map(values.pop, self._fields, self))
    if values:
        kind = TypeError if sys.version_info >= (3, 13) else ValueError
        raise kind(f"Got unexpected field names: {list(values)!r}")
    return result


def _shown(self: Any) -> str:
    """Return the class's name with all fields."""
    pairs = (f"{name}={value!r}" for name, value in zip(self._fields, self, strict=True))
    return f"{self.__class__.__name__}({', '.join(pairs)})"


def _as_dict(self: Any) -> dict[str, Any]:
    """Return field to value."""
    return dict(zip(self._fields, self, strict=True))


_TUPLE_METHODS: dict[str, Any] = {
    "_make": classmethod(_make),
    "_replace": _replace,
    "__repr__": _shown,
    "_asdict": _as_dict,
    "__getnewargs__": lambda self: tuple(self),
}
if sys.version_info >= (3, 13):
    _TUPLE_METHODS["__replace__"] = _replace


class _TupleBase:
    """`NamedTuple` as a base: `class Point(NamedTuple):`."""

    def __mro_entries__(self, bases: tuple[Any, ...]) -> tuple[type, ...]:
        return (_tuple_base,)


_tuple_base = type.__new__(_TupleClass, "NamedTuple", (), {})

if TYPE_CHECKING:
    from dataclasses import dataclass
    from typing import NamedTuple
else:
    dataclass, NamedTuple = _dataclass, _TupleBase()

__all__ = ["NamedTuple", "dataclass"]
