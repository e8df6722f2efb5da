"""Planes, cubes, spheres and a table."""

from __future__ import annotations

import numpy as np

from assets.files import mtl, obj, png
from assets.mesh import Mesh
from assets.palette import pick
from assets.urdf import (
    HEADER,
    Inertial,
    Link,
    Shape,
    box,
    box_inertial,
    cylinder,
    document,
    mesh,
    sphere,
    sphere_inertial,
)

TILE = 1.0
"""Side of one checker square; m"""


def build() -> dict[str, bytes]:
    """Return every file of this group by its path under the assets folder."""
    files = {"ground/checker.png": _checker()}
    for name, half in (("plane", 15.0), ("plane100", 100.0)):
        header = f"{HEADER}. Checkered ground, {2 * half:g} m square."
        files[f"ground/{name}.obj"] = obj(_ground(half), header=header, mtl="ground.mtl")
        files[f"{name}.urdf"] = _plane(f"ground/{name}.obj", half)
    files["ground/ground.mtl"] = mtl(
        {"checker": (1, 1, 1)}, header=HEADER, textures={"checker": "checker.png"}
    )
    files["cube.urdf"] = _cube("cube", 1.0, 1.0, "blue")
    files["cube_small.urdf"] = _cube("cube_small", 0.05, 0.1, "amber")
    files["sphere2.urdf"] = _ball("sphere2", 0.5, 10.0, "teal")
    files["sphere_small.urdf"] = _ball("sphere_small", 0.03, 0.1, "red")
    files["table/table.urdf"] = _table()
    return files


def _checker() -> bytes:
    """Return two by two squares with a fine joint line, 128 by 128 pixels."""
    size, half = 128, 64
    row = np.arange(size)
    pixels = ((row[:, None] // half + row[None, :] // half) % 2).astype(np.uint8)
    line = (row % half == 0) | (row % half == half - 1)
    pixels[line[:, None] | line[None, :]] = 2
    return png(pixels, [(212, 217, 222), (112, 137, 162), (184, 191, 199)])


def _ground(half: float) -> Mesh:
    corners = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], dtype=float)
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    return Mesh(vertices=corners, faces=faces, parts=("checker",), uv=corners[faces][:, :, :2] / (2 * TILE))


def _plane(file: str, half: float) -> bytes:
    link = Link(
        name="planeLink",
        contact={"lateral_friction": 1.0},
        inertial=Inertial(mass=0.0),
        visuals=[Shape(geometry=mesh(file))],
        collisions=[Shape(geometry=box(max(200.0, 2 * half), max(200.0, 2 * half), 10), xyz="0 0 -5")],
    )
    return document("plane", [link], [], {}, "Static ground with its surface at z = 0.")


def _cube(name: str, side: float, mass: float, color: str) -> bytes:
    shape = box(side, side, side)
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 1.0},
        inertial=box_inertial(mass, (side, side, side)),
        visuals=[Shape(geometry=shape, material=color)],
        collisions=[Shape(geometry=shape)],
    )
    return document(name, [link], [], pick(color), f"Cube, {side:g} m, {mass:g} kg.")


def _ball(name: str, radius: float, mass: float, color: str) -> bytes:
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 0.5, "rolling_friction": 0.001, "spinning_friction": 0.001},
        inertial=sphere_inertial(mass, radius),
        visuals=[Shape(geometry=sphere(radius), material=color)],
        collisions=[Shape(geometry=sphere(radius))],
    )
    return document(name, [link], [], pick(color), f"Ball of radius {radius:g} m, {mass:g} kg.")


def _table() -> bytes:
    width, depth, height, top = 1.5, 1.0, 0.625, 0.05
    board = Shape(geometry=box(width, depth, top), xyz=(0, 0, height - top / 2), material="wood")
    leg_height = height - top
    legs = [
        Shape(geometry=cylinder(0.035, leg_height), xyz=(x, y, leg_height / 2), material="graphite")
        for x in (-0.65, 0.65)
        for y in (-0.4, 0.4)
    ]
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 1.0},
        inertial=Inertial(mass=0.0),
        visuals=[board, *legs],
        collisions=[board, *legs],
    )
    return document("table", [link], [], pick("wood", "graphite"), "Static table, top at z = 0.625.")
