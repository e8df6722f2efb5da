"""Cart-pole and small props from primitives."""

from __future__ import annotations

from assets.palette import pick
from assets.urdf import Inertial, Joint, Link, Shape, box, box_inertial, cylinder, document


def build() -> dict[str, bytes]:
    """Return every file of this group by its path under the assets folder."""
    return {
        "cartpole.urdf": _cartpole(),
        "block.urdf": _brick("block", (0.1, 0.04, 0.04), 0.1, "red", 1.0),
        "jenga/jenga.urdf": _brick("jenga", (0.075, 0.025, 0.015), 0.02, "wood", 0.5),
        "tray/traybox.urdf": _tray(),
    }


def _cartpole() -> bytes:
    rail, cart, pole = (6.0, 0.04, 0.04), (0.4, 0.24, 0.16), 1.0
    links = [
        Link(
            name="rail",
            inertial=Inertial(mass=0.0),
            visuals=[Shape(geometry=box(*rail), material="metal")],
        ),
        Link(
            name="cart",
            inertial=box_inertial(1.0, cart),
            visuals=[Shape(geometry=box(*cart), material="teal")],
            collisions=[Shape(geometry=box(*cart))],
        ),
        Link(
            name="pole",
            inertial=box_inertial(0.1, (0.04, 0.04, pole), xyz=(0, 0, pole / 2)),
            visuals=[
                Shape(geometry=box(0.04, 0.04, pole), xyz=(0, 0, pole / 2), material="amber"),
                Shape(geometry=cylinder(0.035, 0.3), rpy="1.5707963268 0 0", material="graphite"),
            ],
            collisions=[Shape(geometry=box(0.04, 0.04, pole), xyz=(0, 0, pole / 2))],
        ),
    ]
    joints = [
        Joint(
            name="slider_to_cart", kind="prismatic", parent="rail", child="cart", axis="1 0 0",
            limit={"lower": -2.8, "upper": 2.8, "effort": 100.0, "velocity": 20.0},
        ),
        Joint(
            name="cart_to_pole", kind="continuous", parent="cart", child="pole", axis="0 1 0",
            limit={"effort": 100.0, "velocity": 50.0},
        ),
    ]  # fmt: skip
    about = "Pole on a cart on a fixed rail along x; upright at zero."
    return document("cartpole", links, joints, pick("metal", "teal", "amber", "graphite"), about)


def _brick(name: str, size: tuple[float, float, float], mass: float, color: str, friction: float) -> bytes:
    link = Link(
        name="baseLink",
        contact={"lateral_friction": friction},
        inertial=box_inertial(mass, size),
        visuals=[Shape(geometry=box(*size), material=color)],
        collisions=[Shape(geometry=box(*size))],
    )
    return document(name, [link], [], pick(color), f"Brick of {mass:g} kg.")


def _tray() -> bytes:
    side, height, wall = 0.6, 0.1, 0.02
    parts = [Shape(geometry=box(side, side, wall), xyz=(0, 0, wall / 2), material="blue")]
    for sign in (-1, 1):
        at = sign * (side - wall) / 2
        parts.append(Shape(geometry=box(wall, side, height), xyz=(at, 0, height / 2), material="blue"))
        parts.append(Shape(geometry=box(side, wall, height), xyz=(0, at, height / 2), material="blue"))
    link = Link(
        name="baseLink",
        contact={"lateral_friction": 0.5},
        inertial=Inertial(mass=0.0),
        visuals=parts,
        collisions=parts,
    )
    return document("tray", [link], [], pick("blue"), "Static open box to sort objects into.")
