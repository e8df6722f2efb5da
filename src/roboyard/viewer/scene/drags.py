"""Dragging a body with the mouse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Point = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Drag:
    """One moment of a drag."""

    phase: Literal["start", "update", "end"]
    owner: tuple[int, int]
    """Body id and link index of the shape that was taken hold of."""
    grip: Point
    """The point of the shape that was taken hold of, where it is now in the page; m, world."""
    target: Point
    """Where the mouse is, as far from the camera's plane as the grip; m, world."""
    client: int
    """Number of the page's client."""


def drag_of(event: Any, owner: tuple[int, int]) -> Drag:
    """A drag from viser's event."""
    return Drag(
        phase=event.phase,
        owner=owner,
        grip=_point(event.start_position),
        target=_point(event.end_position),
        client=event.client_id,
    )


def _point(values: Any) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z
