"""Debug drawings and sliders. Drawings appear in camera images too; without a window, sliders do not move."""

from __future__ import annotations

from collections.abc import Sequence
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.face.arguments import number, quaternion, text, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.direct_calls import START
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.fast.fast_commands import replace_lines
from roboyard.pybullet.state.debug_items import MAX_POINTS, WHITE, Line, Parameter, Points, Text

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

Vector = Sequence[float]


@command()
def addUserDebugLine(
    client: Client,
    lineFromXYZ: Vector,
    lineToXYZ: Vector,
    lineColorRGB: Vector = WHITE,
    lineWidth: float = 1.0,
    lifeTime: float = 0.0,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
) -> int:
    """Draw a line and return its id.

    Args:
        lineFromXYZ: start (m), in the world or in the parent's inertial frame.
        lineToXYZ: end (m), in the same frame.
        lineColorRGB: red, green, blue (0 to 1); white for another length, as in PyBullet.
        lineWidth: width (pixels).
        lifeTime: life time (s, wall clock); 0 for no limit.
        parentObjectUniqueId: body that the line moves with; -1 for none.
        parentLinkIndex: link of that body; -1 for the base.
        replaceItemUniqueId: item that this line replaces.

    Raises:
        error: an end does not have three numbers.
    """
    line = Line(
        vector3(lineFromXYZ, "Error converting lineFrom[3]"),
        vector3(lineToXYZ, "Error converting lineTo[3]"),
        WHITE if lineColorRGB is WHITE else _line_color(lineColorRGB),
        lineWidth if type(lineWidth) is float else number(lineWidth),
        None if parentObjectUniqueId == -1 else _parent(parentObjectUniqueId, parentLinkIndex),
        None if lifeTime == 0.0 else _end_of(lifeTime),
    )
    return client.debug_items.add(line, whole(replaceItemUniqueId))


@command()
def addUserDebugText(
    client: Client,
    text: str,
    textPosition: Vector,
    textColorRGB: Vector = WHITE,
    textSize: float = 1.0,
    lifeTime: float = 0.0,
    textOrientation: Vector | None = None,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
) -> int:
    """Draw text at a position (m) and return its id; without an orientation it faces the camera.

    Raises:
        error: a vector has the wrong length.
    """
    item = Text(
        text=_text(text),
        position=vector3(textPosition, "Error converting textPositionObj[3]"),
        rgb=vector3(textColorRGB, "Error converting textColorRGBObj[3]"),
        size=number(textSize),
        orientation=None
        if textOrientation is None
        else quaternion(textOrientation, "Error converting textOrientation[4]"),
        parent=_parent(parentObjectUniqueId, parentLinkIndex),
        expires=_end_of(lifeTime),
    )
    return client.debug_items.add(item, whole(replaceItemUniqueId))


@command()
def addUserDebugPoints(
    client: Client,
    pointPositions: Sequence[Vector],
    pointColorsRGB: Sequence[Vector],
    pointSize: float = 1.0,
    lifeTime: float = 0.0,
    parentObjectUniqueId: int = -1,
    parentLinkIndex: int = -1,
    replaceItemUniqueId: int = -1,
) -> int:
    """Draw points at (k, 3) positions (m) with (k, 3) colours (0 to 1) and return their common id.

    Raises:
        error: there are too many points, or the numbers of points and colours differ.
    """
    try:
        positions = np.array(pointPositions, dtype=float).reshape(-1, 3)
        colors = np.array(pointColorsRGB, dtype=float).reshape(-1, 3)
    except ValueError as problem:
        raise failure("addUserDebugPoints failed.", f"expected rows of three numbers: {problem}") from None
    if len(positions) > MAX_POINTS:
        raise failure(
            "Number of vertices exceeds the maximum.", f"{len(positions)} points, at most {MAX_POINTS}"
        )
    if len(colors) != len(positions):
        raise failure("numColors must match numPositions.", f"{len(positions)} points, {len(colors)} colours")
    item = Points(
        positions=positions,
        rgb=colors,
        size=number(pointSize),
        parent=_parent(parentObjectUniqueId, parentLinkIndex),
        expires=_end_of(lifeTime),
    )
    return client.debug_items.add(item, whole(replaceItemUniqueId))


@command()
def addUserDebugParameter(
    client: Client, paramName: str, rangeMin: float = 0.0, rangeMax: float = 1.0, startValue: float = 0.0
) -> int:
    """Create a slider, or a button if rangeMin > rangeMax, and return its id."""
    parameter = Parameter(
        name=_text(paramName), lower=number(rangeMin), upper=number(rangeMax), value=number(startValue)
    )
    return client.debug_items.add_parameter(parameter)


@command()
def readUserDebugParameter(client: Client, itemUniqueId: int) -> float:
    """Return the value of a slider, or the number of clicks of a button.

    Raises:
        error: there is no such slider.
    """
    parameter = client.debug_items.parameters.get(whole(itemUniqueId))
    if parameter is None:
        raise failure("Failed to read parameter.", f"no slider has the id {itemUniqueId}")
    return parameter.value


@command()
def removeUserDebugItem(client: Client, itemUniqueId: int) -> None:
    """Remove a drawing or a slider; an unknown id is ignored."""
    client.debug_items.remove(whole(itemUniqueId))


@command()
def removeAllUserDebugItems(client: Client) -> None:
    """Remove all lines, texts and points."""
    client.debug_items.remove_drawings()


@command()
def removeAllUserParameters(client: Client) -> None:
    """Remove all sliders and buttons."""
    client.debug_items.remove_parameters()


def _parent(body: int, link: int) -> tuple[int, int] | None:
    return (whole(body), whole(link)) if whole(body) >= 0 else None


def _end_of(life_time: float) -> float | None:
    seconds = number(life_time)
    return monotonic() + seconds if seconds > 0 else None


_text = text


def _line_color(rgb: Vector) -> tuple[float, float, float]:
    """Return a colour; white, as in PyBullet, for another length than 3."""
    try:
        given = tuple(rgb)
    except TypeError:
        return WHITE
    return vector3(given, "") if len(given) == 3 else WHITE


START.later(
    replace_lines,
    "addUserDebugLine",
    "addUserDebugText",
    "addUserDebugPoints",
    "addUserDebugParameter",
    "removeUserDebugItem",
)
