"""Cabinets: a body of columns, each a stack of drawers, doors and open shelves.

Fronts face -y, the back is at +y, the origin is on the floor in the middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from roboyard.description.model import RGBA, Joint, Link, RobotDescription
from roboyard.scenes.flat.colors import STEEL
from roboyard.scenes.furniture_parts import Part, between, handle, hinge, link, slider

BOARD = 0.018
"""Thickness of all boards (m)."""
GAP = 0.003
"""Gap around each front (m)."""
PLINTH = 0.08
"""Height of the plinth (m)."""

Kind = Literal["drawer", "left", "right", "open", "blank"]
"""Kind of a cell: a door by the side of its hinge, seen from the front; a blank is a fixed front."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Cell:
    """One compartment of a column."""

    kind: Kind
    """Kind of the compartment."""
    height: float = 1.0
    """Height relative to the other cells of the column."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Column:
    """A stack of cells."""

    cells: tuple[Cell, ...]
    """Cells from the bottom up."""
    width: float = 1.0
    """Width relative to the other columns of the cabinet."""


def drawers(count: int, width: float = 1.0) -> Column:
    """Return a column of equal drawers."""
    return Column(cells=(Cell(kind="drawer"),) * count, width=width)


def column(kind: Kind, width: float = 1.0) -> Column:
    """Return a column of one cell."""
    return Column(cells=(Cell(kind=kind),), width=width)


def shelves(count: int, width: float = 1.0) -> Column:
    """Return a column of equal open shelves."""
    return Column(cells=(Cell(kind="open"),) * count, width=width)


def cabinet(
    name: str,
    size: tuple[float, float, float],
    columns: Sequence[Column],
    *,
    rgba: RGBA,
    front: RGBA | None = None,
    top: RGBA | None = None,
    base: float = 0.0,
    worktop: float = BOARD,
    plinth: float = PLINTH,
    extra: Sequence[Part] = (),
) -> RobotDescription:
    """Return a cabinet.

    Joints are called "drawer_0", "door_0", ... from the left column, bottom up. Drawers open by two thirds of
    the depth, doors by 110 degrees.

    Args:
        name: name of the description.
        size: width, depth and height (m).
        columns: from left to right.
        rgba: colour of the body.
        front: colour of drawers and doors; the body's by default.
        top: colour of the upper board; the body's by default.
        base: height of the lower edge above the floor (m).
        worktop: thickness of the upper board (m).
        plinth: height of the recessed plinth (m).
        extra: more parts of the body, in the cabinet's frame.
    """
    wide, deep, high = size
    front = front or rgba
    low, roof = base + plinth, base + high
    y0, y1, x0 = -deep / 2, deep / 2, -wide / 2
    parts: list[Part] = [
        between((x0, y0, low), (x0 + BOARD, y1, roof - worktop), rgba),
        between((-x0 - BOARD, y0, low), (-x0, y1, roof - worktop), rgba),
        between((x0, y0, low), (-x0, y1, low + BOARD), rgba),
        between((x0, y1 - BOARD, low), (-x0, y1, roof - worktop), rgba),
        between((x0, y0 - 0.02, roof - worktop), (-x0, y1, roof), top or rgba),
        *extra,
    ]
    if plinth > 0:
        parts.append(between((x0 + 0.01, y0 + 0.05, base), (-x0 - 0.01, y1, low), (0.2, 0.2, 0.2, 1.0)))
    links: list[Link] = []
    joints: list[Joint] = []
    left, shares = x0, sum(c.width for c in columns)
    for index, stack in enumerate(columns):
        right = left + wide * stack.width / shares
        if index:
            parts.append(between((left - BOARD / 2, y0, low), (left + BOARD / 2, y1, roof - worktop), rgba))
        z, heights = low, sum(c.height for c in stack.cells)
        for k, cell in enumerate(stack.cells):
            z_top = z + (roof - worktop - low) * cell.height / heights
            neighbours = stack.cells[max(k - 1, 0) : k + 1]
            if k and any(c.kind != "drawer" for c in neighbours):
                parts.append(between((left, y0 + 0.005, z - BOARD / 2), (right, y1, z + BOARD / 2), rgba))
            space = (left + GAP, right - GAP, z + GAP, z_top - GAP)
            if cell.kind == "drawer":
                title = f"drawer_{sum(j.type == 'prismatic' for j in joints)}"
                links.append(_drawer(title, space, deep, front, rgba))
                joints.append(slider(title, "body", f"{title}_box", (0, y0, 0), length=deep * 0.66))
            elif cell.kind == "blank":
                parts.append(between((space[0], y0 - BOARD, space[2]), (space[1], y0, space[3]), front))
            elif cell.kind in ("left", "right"):
                title = f"door_{sum(j.type == 'revolute' for j in joints)}"
                links.append(_leaf(title, space, cell.kind, front))
                at = (space[0] if cell.kind == "left" else space[1], y0, 0.0)
                axis = (0.0, 0.0, -1.0 if cell.kind == "left" else 1.0)
                joints.append(
                    hinge(
                        title, "body", f"{title}_leaf", at, axis=axis, upper=1.92, damping=0.2, friction=0.1
                    )
                )
            z = z_top
        left = right
    return RobotDescription(name=name, links=(link("body", parts), *links), joints=tuple(joints))


def _drawer(
    title: str, space: tuple[float, float, float, float], deep: float, front: RGBA, rgba: RGBA
) -> Link:
    """Return a drawer: a box, open at the top, behind a front at y = 0."""
    x0, x1, z0, z1 = space
    inner0, inner1 = x0 + BOARD, x1 - BOARD
    back, rim = deep - 0.04, z0 + 0.75 * (z1 - z0)
    wall = 0.010
    parts = [
        between((x0, -BOARD, z0), (x1, 0, z1), front),
        between((inner0, 0, z0 + 0.012), (inner1, back, z0 + 0.022), rgba),
        between((inner0, 0, z0 + 0.022), (inner0 + wall, back, rim), rgba),
        between((inner1 - wall, 0, z0 + 0.022), (inner1, back, rim), rgba),
        between((inner0, back - wall, z0 + 0.022), (inner1, back, rim), rgba),
        *handle(((x0 + x1) / 2, -BOARD, z0 + 0.62 * (z1 - z0)), min(0.16, 0.5 * (x1 - x0)), STEEL),
    ]
    return link(f"{title}_box", parts, 2.5)


def _leaf(title: str, space: tuple[float, float, float, float], side: Kind, front: RGBA) -> Link:
    """Return a door whose hinge is at x = y = 0."""
    x0, x1, z0, z1 = space
    wide = x1 - x0
    a, b = (0.0, wide) if side == "left" else (-wide, 0.0)
    at = wide - 0.04 if side == "left" else 0.04 - wide
    length = min(0.24, 0.5 * (z1 - z0))
    low, high = z0 + 0.08 + length / 2, z1 - 0.06 - length / 2
    grip_z = high if z1 < 1.2 else min(max(1.05, low), high)
    parts = [
        between((a, -BOARD, z0), (b, 0, z1), front),
        *handle((at, -BOARD, grip_z), length, STEEL, vertical=True),
    ]
    return link(f"{title}_leaf", parts, 4.0 * max(wide * (z1 - z0), 0.1) / 0.3)
