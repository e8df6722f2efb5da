"""Drag events: a body dragged with the mouse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Point = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Drag:
    """One event of a drag."""

    phase: Literal["start", "update", "end"]
    """Press, motion or release."""
    owner: tuple[int, int]
    """Body id and link index of the dragged shape."""
    grip: Point
    """Current position of the grabbed point of the shape on the page, in the world frame (m)."""
    target: Point
    """Position of the mouse at the depth of the grip, in the world frame (m)."""
    client: int
    """Number of the page's client."""


def drag_of(event: Any, owner: tuple[int, int]) -> Drag:
    """Return the drag of a viser event on the shape of `owner`."""
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
