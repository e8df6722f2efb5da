"""Walls along x or y with openings, and panes for the windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from roboyard.scenes.home.colors import GLASS, PAINT, PLASTER
from roboyard.scenes.parts import Part, between

HEIGHT = 2.4
"""m"""
THICK = 0.12
"""m"""
DOOR_HEIGHT = 2.05
"""m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Opening:
    """A hole in a wall, measured along it in world coordinates; m."""

    start: float
    end: float
    bottom: float = 0.0
    top: float = DOOR_HEIGHT

    @property
    def is_window(self) -> bool:
        return self.bottom > 0.0


def wall(along: str, at: float, start: float, end: float, openings: Sequence[Opening] = ()) -> list[Part]:
    """Parts of a wall that runs along "x" or "y" from `start` to `end`, its middle `at` on the other axis.

    Openings come in order along the wall.
    """

    def block(a: float, b: float, low: float, high: float, deep: float, rgba=PLASTER) -> Part:
        if along == "x":
            return between((a, at - deep / 2, low), (b, at + deep / 2, high), rgba)
        return between((at - deep / 2, a, low), (at + deep / 2, b, high), rgba)

    parts, here = [], start
    for hole in openings:
        parts.append(block(here, hole.start, 0.0, HEIGHT, THICK))
        if hole.bottom > 0:
            parts.append(block(hole.start, hole.end, 0.0, hole.bottom, THICK))
        if hole.top < HEIGHT:
            parts.append(block(hole.start, hole.end, hole.top, HEIGHT, THICK))
        if hole.is_window:
            parts.append(block(hole.start, hole.end, hole.bottom, hole.top, 0.012, GLASS))
            middle = (hole.start + hole.end) / 2
            parts.append(block(middle - 0.02, middle + 0.02, hole.bottom, hole.top, 0.04, PAINT))
            parts.append(block(hole.start, hole.end, hole.bottom - 0.02, hole.bottom, THICK + 0.08, PAINT))
        here = hole.end
    parts.append(block(here, end, 0.0, HEIGHT, THICK))
    return parts
