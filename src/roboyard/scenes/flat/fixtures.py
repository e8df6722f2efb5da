"""Static furnishings: lamps, plants, taps, bathroom fixtures. Fronts face -y, origins are on the floor."""

from __future__ import annotations

import math

from roboyard.description.model import RGBA, RobotDescription, Vector3
from roboyard.scenes.flat.colors import (
    BLACK,
    GLASS,
    GLOW,
    LEAF,
    OAK,
    PAINT,
    PORCELAIN,
    STEEL,
    STONE,
    TERRACOTTA,
    WATER,
)
from roboyard.scenes.furniture_parts import (
    Part,
    between,
    box,
    capsule,
    collision_only,
    cylinder,
    object_of,
    skin,
)
from roboyard.scenes.revolve import revolve


def floor_lamp(name: str) -> RobotDescription:
    """A lamp 1.6 m high."""
    return object_of(
        name,
        [
            cylinder(0.15, 0.03, (0, 0, 0.015), BLACK),
            cylinder(0.012, 1.35, (0, 0, 0.70), BLACK),
            *_shade(1.30),
        ],
    )


def table_lamp(name: str, base: float) -> RobotDescription:
    """A lamp at height `base` (m)."""
    foot = [(0, 0), (0.06, 0), (0.075, 0.05), (0.05, 0.13), (0.015, 0.17), (0, 0.17)]
    return object_of(
        name,
        [
            skin(revolve(foot), TERRACOTTA, (0, 0, base)),
            collision_only(cylinder(0.07, 0.17, (0, 0, base + 0.085), TERRACOTTA)),
            *_shade(base + 0.19, 0.6),
        ],
    )


def _shade(base: float, size: float = 1.0) -> list[Part]:
    wide, narrow, high = 0.20 * size, 0.13 * size, 0.28 * size
    profile = [(wide, 0), (narrow, high), (narrow - 0.005, high), (wide - 0.005, 0), (wide, 0)]
    return [
        skin(revolve(profile), GLOW, (0, 0, base)),
        collision_only(cylinder((wide + narrow) / 2, high, (0, 0, base + high / 2), GLOW)),
    ]


def plant(name: str, height: float = 1.1) -> RobotDescription:
    """A pot plant."""
    pot = [(0, 0), (0.13, 0), (0.17, 0.32), (0.155, 0.32), (0.15, 0.28), (0, 0.28)]
    parts: list[Part] = [
        skin(revolve(pot), TERRACOTTA),
        collision_only(cylinder(0.16, 0.32, (0, 0, 0.16), TERRACOTTA)),
        cylinder(0.018, height - 0.45, (0, 0, 0.28 + (height - 0.45) / 2), (0.35, 0.26, 0.16, 1.0)),
    ]
    for k in range(11):
        angle, tilt = 2.4 * k, 0.35 + 0.10 * (k % 4)
        z = 0.55 + (height - 0.65) * k / 10
        reach = 0.17 - 0.007 * k
        at = (reach * math.cos(angle), reach * math.sin(angle), z + 0.08)
        green: RGBA = (LEAF[0] + 0.02 * (k % 3), LEAF[1] + 0.03 * (k % 3), LEAF[2], 1.0)
        parts.append(box((0.32, 0.12, 0.008), at, green, rpy=(0, -tilt, angle), solid=False))
    return object_of(name, parts)


def television(name: str, width: float, base: float) -> RobotDescription:
    """A screen at height `base` (m)."""
    high = width * 0.57
    return object_of(
        name,
        [
            box((width, 0.05, high), (0, 0, base + 0.06 + high / 2), BLACK),
            box(
                (width - 0.03, 0.002, high - 0.03),
                (0, -0.026, base + 0.06 + high / 2),
                (0.12, 0.16, 0.22, 1.0),
            ),
            box((width * 0.35, 0.18, 0.012), (0, 0, base + 0.006), BLACK),
            box((0.08, 0.04, 0.08), (0, 0, base + 0.04), BLACK),
        ],
    )


def books(rows: list[tuple[float, float, float]], depth: float) -> list[Part]:
    """Books on shelves, as parts of the shelf; rows of (from x, to x, height of the board) (m)."""
    colors: list[RGBA] = [
        (0.62, 0.26, 0.22, 1), (0.24, 0.36, 0.50, 1), (0.85, 0.78, 0.62, 1), (0.33, 0.45, 0.34, 1),
        (0.80, 0.58, 0.24, 1), (0.45, 0.33, 0.45, 1),
    ]  # fmt: skip
    parts = []
    for start, end, z in rows:
        x, k = start, int(100 * (z + start + 9))
        while True:
            wide, high = 0.022 + 0.007 * (k % 4), 0.19 + 0.017 * (k * 7 % 5)
            if x + wide > end:
                break
            at = (x + wide / 2, 0.03, z + high / 2)
            parts.append(box((wide - 0.002, depth * 0.65, high), at, colors[k * 5 % 6], solid=False))
            x, k = x + wide, k + 1
    return parts


def picture(name: str, size: tuple[float, float], base: float, rgba: RGBA, accent: RGBA) -> RobotDescription:
    """A framed picture with its lower edge at height `base` (m) and its back at y = 0."""
    wide, high = size
    z = base + high / 2
    return object_of(
        name,
        [
            box((wide, 0.03, high), (0, -0.015, z), OAK),
            box((wide - 0.05, 0.004, high - 0.05), (0, -0.032, z), PAINT, solid=False),
            box((wide * 0.5, 0.004, high * 0.5), (-wide * 0.08, -0.0345, z - high * 0.05), rgba, solid=False),
            cylinder(
                min(size) * 0.16, 0.004, (wide * 0.18, -0.036, z + high * 0.16), accent,
                rpy=(math.pi / 2, 0, 0), solid=False,
            ),
        ],
    )  # fmt: skip


def rug(name: str, size: tuple[float, float], rgba: RGBA, edge: RGBA) -> RobotDescription:
    """A rug without collision shapes, so that wheels pass over it."""
    x, y = size
    return object_of(
        name,
        [
            box((x, y, 0.008), (0, 0, 0.004), edge, solid=False),
            box((x - 0.16, y - 0.16, 0.008), (0, 0, 0.0052), rgba, solid=False),
        ],
    )


def sink(top: float, at: tuple[float, float] = (0.0, 0.0)) -> list[Part]:
    """A steel basin in a worktop at height `top` (m), with its tap; parts of a cabinet."""
    x, y = at
    return [
        box((0.50, 0.38, 0.004), (x, y, top + 0.001), STEEL, solid=False),
        box((0.42, 0.30, 0.004), (x, y, top + 0.0025), (0.40, 0.42, 0.45, 1.0), solid=False),
        cylinder(0.014, 0.26, (x, y + 0.20, top + 0.13), STEEL),
        capsule(0.012, 0.16, (x, y + 0.12, top + 0.255), STEEL, rpy=(math.pi / 2, 0, 0)),
    ]


def hob(top: float, x: float) -> list[Part]:
    """A glass hob on a worktop at height `top` (m); parts of a cabinet."""
    rings = [
        cylinder(r, 0.002, (x + dx, dy, top + 0.0085), (0.28, 0.28, 0.30, 1.0), solid=False)
        for dx, dy, r in ((-0.14, -0.11, 0.08), (0.14, -0.11, 0.10), (-0.14, 0.12, 0.10), (0.14, 0.12, 0.07))
    ]
    return [box((0.58, 0.50, 0.008), (x, 0, top + 0.004), BLACK), *rings]


def toilet(name: str) -> RobotDescription:
    """A toilet, its cistern at +y."""
    bowl = [(0, 0), (0.13, 0), (0.12, 0.20), (0.19, 0.38), (0.19, 0.41), (0, 0.41)]
    return object_of(
        name,
        [
            skin(revolve(bowl), PORCELAIN, (0, -0.08, 0)),
            collision_only(cylinder(0.18, 0.41, (0, -0.08, 0.205), PORCELAIN)),
            cylinder(0.195, 0.025, (0, -0.08, 0.425), PAINT),
            box((0.38, 0.18, 0.42), (0, 0.20, 0.60), PORCELAIN),
            cylinder(0.02, 0.012, (0, 0.20, 0.816), STEEL),
        ],
    )


def bathtub(name: str, length: float = 1.7) -> RobotDescription:
    """A tub along x, filled."""
    wide, high, rim = 0.75, 0.55, 0.07
    x, y = length / 2, wide / 2
    return object_of(
        name,
        [
            between((-x, -y, 0), (x, -y + rim, high), PORCELAIN),
            between((-x, y - rim, 0), (x, y, high), PORCELAIN),
            between((-x, -y, 0), (-x + rim, y, high), PORCELAIN),
            between((x - rim, -y, 0), (x, y, high), PORCELAIN),
            between((-x + rim, -y + rim, 0.02), (x - rim, y - rim, 0.36), WATER),
            cylinder(0.015, 0.18, (-x + 0.035, 0, high + 0.09), STEEL),
            capsule(0.012, 0.12, (-x + 0.10, 0, high + 0.18), STEEL, rpy=(0, math.pi / 2, 0)),
        ],
    )


def mirror(name: str, size: tuple[float, float], base: float) -> RobotDescription:
    """A mirror (without reflections) with its back at y = 0."""
    wide, high = size
    glass: RGBA = (0.78, 0.86, 0.90, 1.0)
    return object_of(
        name,
        [
            box((wide, 0.02, high), (0, -0.01, base + high / 2), STEEL),
            box((wide - 0.03, 0.002, high - 0.03), (0, -0.0212, base + high / 2), glass, solid=False),
        ],
    )


def hood(name: str) -> RobotDescription:
    """A cooker hood whose back is at y = 0."""
    return object_of(
        name,
        [box((0.60, 0.45, 0.08), (0, -0.225, 1.60), STEEL), box((0.24, 0.24, 0.76), (0, -0.13, 2.02), STEEL)],
    )


def basin(name: str, base: float) -> RobotDescription:
    """A wash basin on a cabinet of height `base` (m), with its tap."""
    profile = [(0, 0), (0.10, 0), (0.19, 0.12), (0.175, 0.12), (0.09, 0.02), (0, 0.02)]
    at: Vector3 = (0, -0.04, base)
    return object_of(
        name,
        [
            skin(revolve(profile), PORCELAIN, at),
            collision_only(cylinder(0.18, 0.02, (0, -0.04, base + 0.01), PORCELAIN)),
            cylinder(0.014, 0.22, (0, 0.17, base + 0.11), STEEL),
            capsule(0.012, 0.10, (0, 0.12, base + 0.215), STEEL, rpy=(math.pi / 2, 0, 0)),
        ],
    )


def shower_screen(name: str, length: float, height: float = 1.4) -> RobotDescription:
    """A pane of glass along x on the rim of a tub."""
    return object_of(name, [box((length, 0.012, height), (0, 0, 0.55 + height / 2), GLASS)])


def low_table(name: str, size: tuple[float, float], height: float, rgba: RGBA = OAK) -> RobotDescription:
    """A coffee table with a stone top."""
    x, y = size
    legs = [
        cylinder(0.022, height - 0.03, (i * (x / 2 - 0.07), k * (y / 2 - 0.07), (height - 0.03) / 2), rgba)
        for i in (-1, 1)
        for k in (-1, 1)
    ]
    shelf = box((x - 0.12, y - 0.12, 0.016), (0, 0, 0.14), rgba)
    return object_of(name, [*legs, shelf, box((x, y, 0.03), (0, 0, height - 0.015), STONE)])
