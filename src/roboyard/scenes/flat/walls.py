"""Walls along x or y with openings, and panes for the windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from roboyard.scenes.flat.colors import GLASS, PAINT, PLASTER
from roboyard.scenes.furniture_parts import Part, between

HEIGHT = 2.4
"""Height of the walls (m)."""
THICK = 0.12
"""Thickness of the walls (m)."""
DOOR_HEIGHT = 2.05
"""Height of door openings (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Opening:
    """An opening in a wall, along it in world coordinates (m)."""

    start: float
    end: float
    bottom: float = 0.0
    top: float = DOOR_HEIGHT

    @property
    def is_window(self) -> bool:
        """Whether the opening has a sill and is glazed."""
        return self.bottom > 0.0


def wall(along: str, at: float, start: float, end: float, openings: Sequence[Opening] = ()) -> list[Part]:
    """Return a wall along "x" or "y" from `start` to `end`, with its middle `at` on the other axis (m).

    Openings are in order along the wall.
    """

    def block(a: float, b: float, low: float, high: float, deep: float, rgba=PLASTER) -> Part:
        if along == "x":
            return between((a, at - deep / 2, low), (b, at + deep / 2, high), rgba)
        return between((at - deep / 2, a, low), (at + deep / 2, b, high), rgba)

    parts, here = [], start
    for opening in openings:
        parts.append(block(here, opening.start, 0.0, HEIGHT, THICK))
        if opening.bottom > 0:
            parts.append(block(opening.start, opening.end, 0.0, opening.bottom, THICK))
        if opening.top < HEIGHT:
            parts.append(block(opening.start, opening.end, opening.top, HEIGHT, THICK))
        if opening.is_window:
            parts.append(block(opening.start, opening.end, opening.bottom, opening.top, 0.012, GLASS))
            middle = (opening.start + opening.end) / 2
            parts.append(block(middle - 0.02, middle + 0.02, opening.bottom, opening.top, 0.04, PAINT))
            parts.append(
                block(opening.start, opening.end, opening.bottom - 0.02, opening.bottom, THICK + 0.08, PAINT)
            )
        here = opening.end
    parts.append(block(here, end, 0.0, HEIGHT, THICK))
    return parts
