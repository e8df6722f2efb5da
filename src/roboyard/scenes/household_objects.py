"""Small household objects to grasp; the origin of each is at the middle of its bottom."""

from __future__ import annotations

import math

from roboyard.description.model import RGBA, RobotDescription
from roboyard.scenes.furniture_parts import (
    Part,
    box,
    capsule,
    collision_only,
    cylinder,
    object_of,
    skin,
    sphere,
)
from roboyard.scenes.revolve import revolve

WHITE: RGBA = (0.93, 0.92, 0.90, 1.0)
RED: RGBA = (0.78, 0.22, 0.18, 1.0)
TEAL: RGBA = (0.16, 0.52, 0.55, 1.0)
YELLOW: RGBA = (0.93, 0.72, 0.22, 1.0)
GREEN: RGBA = (0.38, 0.56, 0.26, 1.0)
BLUE: RGBA = (0.22, 0.38, 0.66, 1.0)
PAPER: RGBA = (0.95, 0.93, 0.87, 1.0)


def mug(name: str = "mug", rgba: RGBA = TEAL) -> RobotDescription:
    """A mug of 0.3 kg, 8 cm wide and 9 cm high, hollow, with a handle on its +x side."""
    outer, inner, height = 0.040, 0.036, 0.090
    profile = [(0, 0), (outer, 0), (outer, height), (inner, height), (inner, 0.006), (0, 0.006)]
    grip = [
        box((0.024, 0.010, 0.010), (outer + 0.010, 0, 0.068), rgba),
        box((0.024, 0.010, 0.010), (outer + 0.010, 0, 0.024), rgba),
        box((0.010, 0.010, 0.054), (outer + 0.024, 0, 0.046), rgba),
    ]
    walls = _ring(outer, inner, 0.0, height, rgba)
    foot = collision_only(cylinder(outer * 0.98, 0.008, (0, 0, 0.004), rgba))
    return object_of(name, [skin(revolve(profile), rgba), *grip, *walls, foot], 0.3)


def bowl(name: str = "bowl", rgba: RGBA = WHITE) -> RobotDescription:
    """A bowl of 0.35 kg, 16 cm wide and 6.5 cm high, hollow."""
    profile = [
        (0, 0), (0.040, 0), (0.060, 0.018), (0.074, 0.042), (0.080, 0.065),
        (0.076, 0.065), (0.069, 0.042), (0.055, 0.020), (0.036, 0.007), (0, 0.007),
    ]  # fmt: skip
    walls = [*_ring(0.060, 0.050, 0.0, 0.022, rgba), *_ring(0.080, 0.070, 0.022, 0.065, rgba)]
    foot = collision_only(cylinder(0.055, 0.008, (0, 0, 0.004), rgba))
    return object_of(name, [skin(revolve(profile), rgba), *walls, foot], 0.35)


def plate(name: str = "plate", rgba: RGBA = WHITE) -> RobotDescription:
    """A plate of 0.4 kg, 24 cm wide."""
    profile = [
        (0, 0), (0.075, 0), (0.120, 0.018), (0.120, 0.022), (0.074, 0.006), (0, 0.006),
    ]  # fmt: skip
    foot = collision_only(cylinder(0.076, 0.006, (0, 0, 0.003), rgba))
    return object_of(name, [skin(revolve(profile), rgba), foot, *_ring(0.118, 0.080, 0.004, 0.02, rgba)], 0.4)


def bottle(name: str = "bottle", rgba: RGBA = GREEN) -> RobotDescription:
    """A bottle of 0.6 kg, 7 cm wide and 26 cm high."""
    profile = [
        (0, 0), (0.035, 0), (0.035, 0.150), (0.030, 0.172), (0.014, 0.200), (0.014, 0.255), (0, 0.255),
    ]  # fmt: skip
    body = collision_only(cylinder(0.035, 0.165, (0, 0, 0.0825), rgba))
    neck = collision_only(cylinder(0.015, 0.09, (0, 0, 0.21), rgba))
    cap = cylinder(0.016, 0.016, (0, 0, 0.252), YELLOW)
    label = cylinder(0.0355, 0.06, (0, 0, 0.085), PAPER, solid=False)
    return object_of(name, [skin(revolve(profile), rgba), body, neck, cap, label], 0.6)


def can(name: str = "can", rgba: RGBA = RED) -> RobotDescription:
    """A can of 0.4 kg, 7 cm wide and 10 cm high."""
    tin: RGBA = (0.75, 0.76, 0.78, 1.0)
    return object_of(
        name,
        [
            cylinder(0.035, 0.10, (0, 0, 0.05), tin),
            cylinder(0.0354, 0.085, (0, 0, 0.05), rgba, solid=False),
            cylinder(0.0356, 0.02, (0, 0, 0.055), PAPER, solid=False),
        ],
        0.4,
    )


def fruit(name: str = "apple", rgba: RGBA = RED, radius: float = 0.037) -> RobotDescription:
    """An apple or orange of 0.15 kg with a stalk."""
    stalk = cylinder(0.002, 0.014, (0, 0, 2 * radius), (0.30, 0.22, 0.12, 1.0), solid=False)
    return object_of(name, [sphere(radius, (0, 0, radius), rgba), stalk], 0.15)


def book(name: str = "book", rgba: RGBA = BLUE) -> RobotDescription:
    """A closed book of 0.4 kg, 15 by 21 by 3 cm."""
    return object_of(
        name,
        [
            collision_only(box((0.15, 0.21, 0.03), (0, 0, 0.015), rgba)),
            box((0.15, 0.21, 0.003), (0, 0, 0.0015), rgba, solid=False),
            box((0.15, 0.21, 0.003), (0, 0, 0.0285), rgba, solid=False),
            box((0.003, 0.21, 0.03), (-0.0735, 0, 0.015), rgba, solid=False),
            box((0.142, 0.202, 0.024), (0, 0, 0.015), PAPER, solid=False),
        ],
        0.4,
    )


def cube(name: str = "cube", rgba: RGBA = YELLOW, side: float = 0.05) -> RobotDescription:
    """A wooden cube of 0.1 kg."""
    return object_of(name, [box((side, side, side), (0, 0, side / 2), rgba)], 0.1)


def banana(name: str = "banana") -> RobotDescription:
    """A banana of 0.12 kg."""
    parts, radius = [], 0.085
    for k in range(5):
        angle = math.radians(-50 + 25 * k)
        at = (radius * math.sin(angle), radius * (1 - math.cos(angle)) - 0.02, 0.016)
        parts.append(capsule(0.016, 0.03, at, YELLOW, rpy=(0, math.pi / 2, angle)))
    return object_of(name, parts, 0.12)


def _ring(outer: float, inner: float, low: float, high: float, rgba: RGBA, count: int = 10) -> list[Part]:
    """Return boxes around z as invisible collision shapes of a round wall (m)."""
    middle, thick = (outer + inner) / 2, max(outer - inner, 0.004)
    width = 2 * outer * math.tan(math.pi / count)
    staves = []
    for k in range(count):
        angle = 2 * math.pi * k / count
        at = (middle * math.cos(angle), middle * math.sin(angle), (low + high) / 2)
        staves.append(collision_only(box((thick, width, high - low), at, rgba, rpy=(0, 0, angle))))
    return staves
