"""`roboyard._records.dataclass` makes the classes that the standard library's makes."""

from __future__ import annotations

import abc
import copy
import dataclasses
import inspect
import itertools
import pickle
import sys
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
