"""A room door: a frame, a leaf on a hinge, a handle on both sides."""

from __future__ import annotations

import math

from roboyard.description.model import RGBA, RobotDescription
from roboyard.scenes.flat.colors import OAK, PAINT, STEEL
from roboyard.scenes.flat.walls import DOOR_HEIGHT, THICK
from roboyard.scenes.furniture_parts import Part, between, capsule, cylinder, hinge, link

JAMB = 0.03
"""Width of the frame (m)."""
LEAF = 0.04
"""Thickness of the leaf (m)."""


def door(
    name: str, width: float, rgba: RGBA = OAK, *, opening: float = math.radians(100)
) -> RobotDescription:
    """Return a door for an opening of `width` (m), with its frame around the origin, which opens towards +y.

    The hinge is at -x; joint "hinge" goes from 0 (closed) to `opening` (rad).
    """
    half, top = width / 2, DOOR_HEIGHT
    deep = THICK / 2 + 0.01
    frame = [
        between((-half, -deep, 0), (-half + JAMB, deep, top), PAINT),
        between((half - JAMB, -deep, 0), (half, deep, top), PAINT),
        between((-half, -deep, top - JAMB), (half, deep, top), PAINT),
    ]
    wide = width - 2 * JAMB - 0.01
    at = wide - 0.07
    leaf: list[Part] = [
        between((0.0, -LEAF / 2, 0.012), (wide, LEAF / 2, top - JAMB - 0.006), rgba),
        *_panels(wide, rgba),
    ]
    for side in (-1, 1):
        y = side * (LEAF / 2 + 0.025)
        leaf += [
            cylinder(0.009, 0.05, (at, y, 1.02), STEEL, rpy=(math.pi / 2, 0, 0)),
            capsule(0.009, 0.11, (at - 0.055, y + side * 0.022, 1.02), STEEL, rpy=(0, math.pi / 2, 0)),
        ]
    return RobotDescription(
        name=name,
        links=(link("frame", frame), link("leaf", leaf, 18.0)),
        joints=(
            hinge("hinge", "frame", "leaf", (-half + JAMB + 0.005, 0.0, 0.0), upper=opening, damping=1.0),
        ),
    )


def _panels(wide: float, rgba: RGBA) -> list[Part]:
    """Return two flat panels on either side, visible only."""
    lighter: RGBA = (min(rgba[0] * 1.1, 1), min(rgba[1] * 1.1, 1), min(rgba[2] * 1.1, 1), 1.0)
    deep = LEAF / 2 + 0.003
    return [
        between((0.12, -deep, low), (wide - 0.14, deep, high), lighter, solid=False)
        for low, high in ((0.16, 0.88), (1.16, 1.88))
    ]
