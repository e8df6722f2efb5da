"""Stand-ins for PyBullet's small objects: duck, toy brick, domino, tray and table."""

from __future__ import annotations

from assets.files import obj
from assets.mesh import merge
from assets.palette import pick
from assets.solids import ball
from assets.standin import fixed, slab
from assets.urdf import HEADER, Inertial, Link, Shape, box, box_inertial, cylinder, document, mesh


def build() -> dict[str, bytes]:
    """Return every file of this group by its path under the assets folder."""
    return {
        **_duck(),
        "lego/lego.urdf": _brick(),
        "domino/domino.urdf": _domino(),
        "tray/tray.urdf": _tray(),
        "table_square/table_square.urdf": _table(),
    }


def _duck() -> dict[str, bytes]:
    """Return the duck: y up, 20 times the size of its URDF, as PyBullet's mesh."""
    body = ball(0.75, 20, 10).scaled(1.15, 0.75, 0.85).moved((-0.15, 0.6, 0.0))
    head = ball(0.42, 16, 8).moved((0.3, 1.28, 0.0))
    beak = ball(0.2, 12, 6).scaled(1.2, 0.45, 0.9).moved((0.55, 1.2, 0.0))
    tail = ball(0.25, 12, 6).scaled(1.0, 0.8, 0.8).moved((-0.8, 0.85, 0.0))
    whole = obj(merge(body, head, beak, tail), header=f"{HEADER}. Bath duck, y up.")
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 1.0},
        inertial=Inertial(mass=0.1, xyz=(0, 0.02, 0), tensor=(1e-4, 0, 0, 1e-4, 0, 1.3e-4)),
        visuals=[Shape(geometry=mesh("duck.obj", (0.05, 0.05, 0.05)), material="amber")],
        collisions=[Shape(geometry=mesh("duck_vhacd.obj", (0.05, 0.05, 0.05)))],
    )
    return {
        "duck.obj": whole,
        "duck_vhacd.obj": obj(
            merge(body, head, beak, tail), header=f"{HEADER}. Parts of the bath duck, y up."
        ),
        "duck_vhacd.urdf": document("cube.urdf", [link], [], pick("amber"), "Bath duck of 0.1 kg, y up."),
    }


def _brick() -> bytes:
    size, studs = (0.032, 0.032, 0.023), cylinder(0.005, 0.004)
    looks = [Shape(geometry=box(*size), material="amber")]
    looks += [
        Shape(geometry=studs, xyz=(x, y, 0.0135), material="amber")
        for x in (-0.008, 0.008)
        for y in (-0.008, 0.008)
    ]
    link = Link(
        name="legobrick",
        contact={"lateral_friction": 1.0},
        inertial=box_inertial(0.1, size),
        visuals=looks,
        collisions=[Shape(geometry=box(*size))],
    )
    return document("cube.urdf", [link], [], pick("amber"), "Toy brick of 0.1 kg.")


def _domino() -> bytes:
    size = (0.00635, 0.0254, 0.0508)
    looks = [
        Shape(geometry=box(*size), material="shell"),
        slab((-0.0034, -0.011, -0.0005), (0.0034, 0.011, 0.0005), "graphite"),
    ]
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 0.5},
        inertial=box_inertial(0.025, size),
        visuals=looks,
        collisions=[Shape(geometry=box(*size))],
    )
    return document("cube", [link], [], pick("shell", "graphite"), "Domino of 25 g.")


def _tray() -> bytes:
    side, height, wall = 0.6, 0.13, 0.01
    parts = [slab((-side / 2, -side / 2, -0.005), (side / 2, side / 2, 0.005), "metal")]
    for sign in (-1, 1):
        low, high = sorted((sign * side / 2, sign * (side / 2 - wall)))
        parts.append(slab((low, -side / 2, 0.005), (high, side / 2, height), "metal"))
        parts.append(slab((-side / 2, low, 0.005), (side / 2, high, height), "metal"))
    link = Link(
        name="tray_base_link",
        contact={"lateral_friction": 0.5},
        inertial=Inertial(mass=0.0),
        visuals=parts,
        collisions=[Shape(geometry=part.geometry, xyz=part.xyz) for part in parts],
    )
    return document("tray", [link], [], pick("metal"), "Static open tray.")


def _table() -> bytes:
    top = slab((-0.3, -0.3, 0.56), (0.3, 0.3, 0.64), "wood")
    legs = [
        Shape(geometry=box(0.05, 0.05, 0.56), xyz=(x, y, 0.28), material="graphite")
        for x in (-0.25, 0.25)
        for y in (-0.25, 0.25)
    ]
    links = [
        Link(name="world"),
        Link(
            name="baseLink",
            inertial=Inertial(mass=0.0, xyz=(0, 0, 0.6)),
            visuals=[top, *legs],
            collisions=[Shape(geometry=top.geometry, xyz=top.xyz)],
        ),
    ]
    joints = [fixed("fixed", "world", "baseLink")]
    return document("urdf_table", links, joints, pick("wood", "graphite"), "Square table, 0.64 m high.")
