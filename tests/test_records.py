"""`roboyard._records.dataclass` makes the classes that the standard library's makes."""

from __future__ import annotations

import abc
import copy
import dataclasses
import inspect
import itertools
import pickle
import sys
import typing
from dataclasses import FrozenInstanceError, field
from typing import Any, ClassVar

import pytest

from roboyard import _records

DECORATORS: dict[str, Any] = {"standard": dataclasses.dataclass, "ours": _records.dataclass}
OPTIONS = [
    dict(zip(("frozen", "kw_only", "slots", "eq"), values, strict=True))
    for values in itertools.product((False, True), repeat=4)
]


def sample(decorate: Any, options: dict[str, bool]) -> Any:
    class Sample:
        """A sample."""

        kind: ClassVar[str] = "sample"
        a: int
        b: list[int] = field(default_factory=list)
        c: float = field(default=2.5, compare=False, repr=False)
        d: tuple[int, ...] = field(init=False, default=(1,))
        e: dict[str, int] = field(init=False, default_factory=dict)
        f: str = field(default="f", kw_only=True, hash=False)

        def __post_init__(self) -> None:
            if self.a < 0:
                raise ValueError(self.a)

    Sample.__module__ = __name__
    Sample.__qualname__ = "Sample"
    return decorate(**options)(Sample)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_records_do_what_the_standard_librarys_do(options: dict[str, bool]) -> None:
    def observed(decorate: Any) -> list[Any]:
        cls = sample(decorate, options)
        seen: list[Any] = [
            str(inspect.signature(cls)),
            cls.__match_args__,
            cls.__doc__,
            hasattr(cls, "__dict__"),
        ]
        one, same, other = cls(a=1), cls(a=1, c=9.0), cls(a=2, b=[1], f="g")
        seen += [repr(one), repr(other), one == same, one == other, one != same, one == 1, one.d, other.e]
        seen += [dataclasses.asdict(other), repr(dataclasses.replace(one, a=7)), cls.__hash__ is None]
        for call in (
            lambda: cls(),
            lambda: cls(a=-1),
            lambda: cls(1, [2]),
            lambda: cls(a=1, nothing=2),
            lambda: cls(1, [], 1.0, "positional"),
            lambda: setattr(one, "a", 4),
            lambda: delattr(one, "a"),
            lambda: setattr(one, "unknown", 4) if not options["slots"] else None,
        ):
            try:
                seen.append(repr(call()))
            except Exception as problem:
                seen.append((type(problem), str(problem).replace(sample.__qualname__, "")))
        seen += [cls.__dataclass_params__.frozen, cls.__dataclass_params__.eq]
        return seen

    assert observed(_records.dataclass) == observed(dataclasses.dataclass)


@_records.dataclass(frozen=True, slots=True)
class Point:
    """Two numbers."""

    x: float
    y: float = 0.0


@_records.dataclass(frozen=True)
class Single:
    """One number."""

    x: float


def test_records_are_copied_pickled_and_hashed_as_tuples() -> None:
    point = Point(1.0, 2.0)
    assert pickle.loads(pickle.dumps(point)) == copy.copy(point) == copy.deepcopy(point) == point
    assert hash(point) == hash((1.0, 2.0)) and {point: 3}[Point(1.0, 2.0)] == 3
    assert hash(Single(1.5)) == hash((1.5,))
    assert pickle.loads(pickle.dumps(Single(2.0))) == Single(2.0)


def test_subclasses_of_records_keep_their_methods() -> None:
    @_records.dataclass(kw_only=True)
    class Base(abc.ABC):
        a: int

        @abc.abstractmethod
        def value(self) -> int: ...

        def __repr__(self) -> str:
            return "own text"

    class Plain(Base):
        def value(self) -> int:
            return self.a

    @_records.dataclass(kw_only=True)
    class More(Plain):
        b: int = 2

    @_records.dataclass(frozen=True)
    class Further(Single):
        z: int = 1

    assert Plain(a=3).value() == 3 and repr(Plain(a=3)) == "own text"
    assert (More(a=1).a, More(a=1).b) == (1, 2) and More(a=1) != Plain(a=1)
    assert Further(1.0).z == 1
    with pytest.raises(FrozenInstanceError):
        Further(1.0).z = 2  # type: ignore[misc]
    with pytest.raises(TypeError, match="abstract"):
        Base(a=1)  # type: ignore[abstract]


def test_no_method_is_compiled_before_it_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[Any] = []
    monkeypatch.setattr(_records, "_compiled_init", lambda cls: compiled.append(cls) or (lambda self: None))
    made = sample(_records.dataclass, {"frozen": True})
    assert not compiled
    made.__init__  # noqa: B018
    assert compiled == [made]
    assert "roboyard._records" in sys.modules


class Named(_records.NamedTuple):
    """A named tuple."""

    a: int
    b: float = 2.0

    def total(self) -> float:
        return self.a + self.b


class Plain(_records.NamedTuple):
    c: list[int]


def test_named_tuples_do_what_the_standard_librarys_do() -> None:
    def observed(base: Any) -> list[Any]:
        class Tuple(base):
            """Text."""

            a: int
            b: float = 2.0

            def total(self) -> float:
                return self.a + self.b

        class Bare(base):
            c: int

        one = Tuple(1)
        seen: list[Any] = [one, repr(one), one.total(), Tuple.__mro__[1:], Tuple.__bases__, one._asdict()]
        seen += [one._replace(b=5), Tuple._make([3, 4]), Tuple.__doc__, Bare.__doc__, Bare(7), Tuple._fields]
        seen += [
            Tuple._field_defaults,
            Tuple.__match_args__,
            sorted(vars(Tuple)),
            list(inspect.signature(Tuple).parameters),
        ]
        seen += [typing.get_type_hints(Tuple), hash(one) == hash((1, 2.0)), hasattr(one, "__dict__"), one.b]
        for call in (
            lambda: Tuple(),
            lambda: Tuple(1, 2, 3),
            lambda: one._replace(unknown=1),
            lambda: Tuple._make([1]),
            lambda: setattr(one, "a", 4),
        ):
            try:
                seen.append(call())
            except Exception as problem:
                seen.append((type(problem), str(problem)))
        return seen

    assert observed(_records.NamedTuple) == observed(typing.NamedTuple)


def test_named_tuples_are_copied_and_pickled() -> None:
    one = Named(3)
    for other in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
        assert (other, type(other), other.total()) == (one, Named, 5.0)
    with pytest.raises(TypeError, match="follow a"):

        class Wrong(_records.NamedTuple):
            a: int = 1
            b: int  # pyright: ignore[reportGeneralTypeIssues]
