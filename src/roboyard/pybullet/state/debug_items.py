"""Debug drawings and sliders of a client, by id: lines, texts, points, parameters."""

from __future__ import annotations

from collections.abc import Iterator
from time import monotonic
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import NamedTuple, dataclass
from roboyard.pybullet.state.ids import Counter

Triple = tuple[float, float, float]
WHITE = (1.0, 1.0, 1.0)
MAX_POINTS = 131072
"""Points that a cloud has at most."""


class Line(NamedTuple):
    """A line segment."""

    start: Triple
    """Start (m)."""
    end: Triple
    """End (m)."""
    rgb: Triple
    """Colour (0 to 1)."""
    width: float
    """Width (pixels)."""
    parent: tuple[int, int] | None = None
    """Body and link in whose inertial frame the coordinates are; None: the world."""
    expires: float | None = None
    """Time of removal on the monotonic clock (s); None: never."""


class Text(NamedTuple):
    """A text."""

    text: str
    """Characters."""
    position: Triple
    """Position (m)."""
    rgb: Triple
    """Colour (0 to 1)."""
    size: float
    """Height of the characters, in PyBullet's units."""
    orientation: tuple[float, float, float, float] | None
    """Orientation (x, y, z, w); None: it faces the camera."""
    parent: tuple[int, int] | None = None
    """Body and link in whose inertial frame the coordinates are; None: the world."""
    expires: float | None = None
    """Time of removal on the monotonic clock (s); None: never."""


class Points(NamedTuple):
    """A point cloud."""

    positions: NDArray[np.float64]
    """(k, 3) positions (m)."""
    rgb: NDArray[np.float64]
    """(k, 3) colours (0 to 1)."""
    size: float
    """Size (pixels)."""
    parent: tuple[int, int] | None = None
    """Body and link in whose inertial frame the coordinates are; None: the world."""
    expires: float | None = None
    """Time of removal on the monotonic clock (s); None: never."""


Item = Line | Text | Points
Stored = Item | tuple[Any, ...]
"""Machine code stores items as plain tuples."""


@dataclass(kw_only=True, slots=True)
class Parameter:
    """A slider or button."""

    name: str
    """Label."""
    lower: float
    """Smallest value."""
    upper: float
    """Largest value."""
    value: float
    """Current value, or number of clicks."""

    @property
    def is_button(self) -> bool:
        """Whether it is a button (lower > upper), whose value counts the clicks."""
        return self.lower > self.upper


class DebugItems:
    """All items, with ids from one counter. `revision` changes when an item is added or removed."""

    def __init__(self) -> None:
        """Start without items."""
        self._ids = Counter()
        self._items: dict[int, Stored] = {}
        """By id."""
        self._parameters: dict[int, Parameter | tuple[str, float, float, float]] = {}
        """By id; machine code stores them as plain tuples."""
        self.revision = 0

    def add(self, item: Item, replaces: int = -1) -> int:
        """Add an item and return its id: that of the replaced item, if it exists."""
        items = self._items
        number = replaces if replaces in items else self._ids.take()
        items[number] = item
        self.revision += 1
        return number

    @property
    def parameters(self) -> dict[int, Parameter]:
        """Sliders and buttons by id."""
        stored: Any = self._parameters
        for number, one in stored.items():
            if type(one) is tuple:
                name, lower, upper, value = one
                stored[number] = Parameter(name=name, lower=lower, upper=upper, value=value)
        return stored

    def add_parameter(self, parameter: Parameter) -> int:
        """Add a slider or button and return its id."""
        number = self._ids.take()
        self._parameters[number] = parameter
        self.revision += 1
        return number

    def remove(self, number: int) -> None:
        """Remove a drawing or a parameter; an unknown id is ignored."""
        self._items.pop(number, None)
        self._parameters.pop(number, None)
        self.revision += 1

    def remove_drawings(self) -> None:
        """Remove all drawings."""
        self._items.clear()
        self.revision += 1

    def remove_parameters(self) -> None:
        """Remove all sliders and buttons."""
        self._parameters.clear()
        self.revision += 1

    @property
    def has_expiring(self) -> bool:
        """Whether any item has a limited life time."""
        return any(_expires(item) is not None for item in self._items.values())

    def drawings(self) -> Iterator[tuple[int, Item]]:
        """Yield the ids and drawings that have not expired; expired ones are removed."""
        if not self._items:
            return
        now = monotonic()
        ends = [(n, _expires(item)) for n, item in self._items.items()]
        ended = [n for n, end in ends if end is not None and end <= now]
        for number in ended:
            del self._items[number]
        self.revision += bool(ended)
        for number, item in self._items.items():
            yield number, _complete(item)


def clock() -> float:
    """Return the time on which items expire (s)."""
    return monotonic()


def _expires(item: Stored) -> float | None:
    if isinstance(item, Item):
        return item.expires
    found: float | None = item[-1]
    return found


def _complete(item: Stored) -> Item:
    """Return an item with all fields."""
    if isinstance(item, Item):
        return item
    if isinstance(item[0], np.ndarray):
        return Points(*item)
    return Text(*item) if isinstance(item[0], str) else Line(*item)
