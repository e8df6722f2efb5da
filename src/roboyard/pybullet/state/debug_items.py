"""Debug drawings and sliders of a client: lines, texts, points, parameters, by id."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from roboyard.pybullet.state.ids import Counter

Triple = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Item:
    parent: tuple[int, int] | None = None
    """Body and link whose inertial frame the coordinates are in; None: the world."""
    expires: float | None = None
    """On the monotonic clock; None: never."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Line(Item):
    start: Triple
    """m"""
    end: Triple
    """m"""
    rgb: Triple
    width: float
    """pixels"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Text(Item):
    text: str
    position: Triple
    """m"""
    rgb: Triple
    size: float
    orientation: tuple[float, float, float, float] | None
    """x, y, z, w; None: it faces the camera."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Points(Item):
    positions: NDArray[np.float64]
    """(k, 3) m"""
    rgb: NDArray[np.float64]
    """(k, 3) 0 to 1"""
    size: float
    """pixels"""


@dataclass(kw_only=True, slots=True)
class Parameter:
    name: str
    lower: float
    upper: float
    value: float

    @property
    def is_button(self) -> bool:
        """An upward range is a slider, any other a button whose value counts the clicks."""
        return self.lower > self.upper


class DebugItems:
    """All items, numbered by one counter from 0. `revision` changes whenever an item comes or goes."""

    def __init__(self) -> None:
        self._ids = Counter()
        self._items: dict[int, Item] = {}
        self.parameters: dict[int, Parameter] = {}
        self.revision = 0

    def add(self, item: Item, replaces: int = -1) -> int:
        """Id of the new item: `replaces` itself where that item is there."""
        number = replaces if replaces in self._items else self._ids.take()
        self._items[number] = item
        self.revision += 1
        return number

    def add_parameter(self, parameter: Parameter) -> int:
        number = self._ids.take()
        self.parameters[number] = parameter
        self.revision += 1
        return number

    def remove(self, number: int) -> None:
        """Remove an item or a parameter; an unknown id is no error."""
        self._items.pop(number, None)
        self.parameters.pop(number, None)
        self.revision += 1

    def remove_drawings(self) -> None:
        self._items.clear()
        self.revision += 1

    def remove_parameters(self) -> None:
        self.parameters.clear()
        self.revision += 1

    @property
    def has_ends(self) -> bool:
        """Whether the life of any item will end."""
        return any(item.expires is not None for item in self._items.values())

    def drawings(self) -> Iterator[tuple[int, Item]]:
        """Items whose life has not ended; ended ones are forgotten."""
        if not self._items:
            return
        now = monotonic()
        ended = [n for n, item in self._items.items() if item.expires is not None and item.expires <= now]
        for number in ended:
            del self._items[number]
        self.revision += bool(ended)
        yield from self._items.items()
