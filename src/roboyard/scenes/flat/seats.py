"""Furniture to sit and lie on; fronts face -y, origins on the floor."""

from __future__ import annotations

import math

from roboyard.description.model import RGBA, RobotDescription
from roboyard.scenes.flat.colors import LINEN, OAK, PAINT, WALNUT
from roboyard.scenes.furniture_parts import Part, box, capsule, cylinder, object_of


def sofa(name: str, width: float, rgba: RGBA, pillow: RGBA) -> RobotDescription:
    """Return a sofa of `width` (m) with a cushion per 0.75 m."""
    darker = _shade(rgba, 0.86)
    arm = 0.16
    seats = max(1, round((width - 2 * arm) / 0.75))
    each = (width - 2 * arm) / seats
    parts: list[Part] = [
        box((width, 0.88, 0.22), (0, 0, 0.21), darker),
        box((width, 0.18, 0.52), (0, 0.35, 0.50), darker),
        *(box((arm, 0.88, 0.34), (s * (width - arm) / 2, 0, 0.43), darker) for s in (-1, 1)),
        *(
            cylinder(0.022, 0.10, (i * (width / 2 - 0.08), k * 0.36, 0.05), WALNUT)
            for i in (-1, 1)
            for k in (-1, 1)
        ),
    ]
    for k in range(seats):
        x = -width / 2 + arm + each * (k + 0.5)
        parts += [
            box((each - 0.015, 0.66, 0.13), (x, -0.09, 0.385), rgba),
            box((each - 0.015, 0.15, 0.40), (x, 0.21, 0.61), rgba, rpy=(-0.16, 0, 0)),
        ]
    parts.append(
        box((0.40, 0.12, 0.36), (-width / 2 + arm + 0.24, 0.06, 0.62), pillow, rpy=(-0.3, 0.1, 0.15))
    )
    return object_of(name, parts)


def chair(name: str, rgba: RGBA = OAK, seat: RGBA = LINEN) -> RobotDescription:
    """A wooden chair of 5 kg."""
    legs = [cylinder(0.018, 0.44, (i * 0.18, -0.18, 0.22), rgba) for i in (-1, 1)]
    posts = [cylinder(0.018, 0.86, (i * 0.18, 0.19, 0.43), rgba) for i in (-1, 1)]
    back = [box((0.36, 0.018, 0.08), (0, 0.19, z), rgba) for z in (0.62, 0.79)]
    return object_of(name, [*legs, *posts, *back, box((0.42, 0.42, 0.035), (0, 0, 0.4575), seat)], 5.0)


def stool(name: str, rgba: RGBA, height: float = 0.62) -> RobotDescription:
    """A round stool of 4 kg."""
    legs = [
        cylinder(0.015, height - 0.02, (0.13 * math.cos(a), 0.13 * math.sin(a), (height - 0.02) / 2), OAK)
        for a in (0.8, 2.37, 3.94, 5.5)
    ]
    return object_of(name, [*legs, cylinder(0.17, 0.04, (0, 0, height - 0.02), rgba)], 4.0)


def bed(name: str, width: float, cover: RGBA) -> RobotDescription:
    """A bed of `width` by 2.05 m, its head at +y."""
    length = 2.05
    parts = [
        box((width, length, 0.14), (0, 0, 0.20), OAK),
        *(
            box((0.07, 0.07, 0.13), (i * (width / 2 - 0.05), k * (length / 2 - 0.05), 0.065), OAK)
            for i in (-1, 1)
            for k in (-1, 1)
        ),
        box((width, 0.05, 0.75), (0, length / 2 - 0.025, 0.575), OAK),
        box((width - 0.06, length - 0.10, 0.20), (0, -0.02, 0.37), PAINT),
        box((width - 0.02, length * 0.66, 0.06), (0, -length * 0.15, 0.47), cover),
        box((width - 0.02, 0.22, 0.075), (0, length * 0.10, 0.475), LINEN),
        *(
            box(
                (width * 0.40, 0.38, 0.12),
                (s * width * 0.23, length / 2 - 0.30, 0.53),
                PAINT,
                rpy=(0.25, 0, 0),
            )
            for s in (-1, 1)
        ),
    ]
    return object_of(name, parts)


def desk_chair(name: str, rgba: RGBA) -> RobotDescription:
    """A swivel chair of 9 kg on five feet."""
    dark: RGBA = (0.15, 0.15, 0.17, 1.0)
    feet = [
        capsule(
            0.02, 0.24,
            (0.15 * math.cos(a), 0.15 * math.sin(a), 0.045), dark,
            rpy=(0, math.pi / 2, a),
        )
        for a in (math.tau * k / 5 for k in range(5))
    ]  # fmt: skip
    soles = [
        cylinder(0.02, 0.03, (0.28 * math.cos(a), 0.28 * math.sin(a), 0.015), dark)
        for a in (math.tau * k / 5 for k in range(5))
    ]
    return object_of(
        name,
        [
            *feet,
            *soles,
            cylinder(0.03, 0.34, (0, 0, 0.25), dark),
            box((0.48, 0.48, 0.07), (0, 0, 0.455), rgba),
            box((0.44, 0.06, 0.48), (0, 0.23, 0.80), rgba, rpy=(-0.12, 0, 0)),
            box((0.06, 0.03, 0.25), (0, 0.235, 0.55), dark),
        ],
        9.0,
    )


def _shade(rgba: RGBA, factor: float) -> RGBA:
    return (rgba[0] * factor, rgba[1] * factor, rgba[2] * factor, rgba[3])
