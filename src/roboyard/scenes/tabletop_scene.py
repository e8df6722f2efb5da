"""A scene of a table with objects to grasp."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.description.model import RGBA, RobotDescription
from roboyard.scenes import household_objects
from roboyard.scenes.furniture_parts import Part, box, link
from roboyard.scenes.scene import Scene, let_sleep, world_or_new

if TYPE_CHECKING:
    from roboyard.sim import Body, World

OAK: RGBA = (0.72, 0.55, 0.37, 1.0)
DARK_OAK: RGBA = (0.52, 0.38, 0.25, 1.0)
HEIGHT = 0.74
"""Height of the table's top (m)."""


def tabletop(world: World | None = None) -> Scene:
    """Add a table, 1.4 by 0.8 m and 0.74 m high, in front of the spawn pose, with nine objects to grasp."""
    place = world_or_new(world)
    let_sleep(place)
    bodies: dict[str, Body] = {"floor": place.add_plane(name="floor")}

    def put(description: RobotDescription, x: float, y: float, z: float = HEIGHT, yaw: float = 0.0) -> None:
        from roboyard.transforms import quaternion_from_rpy

        turn = quaternion_from_rpy((0.0, 0.0, yaw))
        bodies[description.name] = place.add_description(description, (x, y, z + 0.001), turn, drives=False)

    bodies["table"] = place.add_description(table(), (0.85, 0, 0), fixed_base=True, drives=False)
    put(household_objects.mug("mug", household_objects.TEAL), 0.62, -0.18, yaw=-0.9)
    put(household_objects.bowl("bowl"), 0.72, 0.12)
    put(household_objects.fruit("apple"), 0.72, 0.12, HEIGHT + 0.012)
    put(household_objects.bottle("bottle"), 0.98, -0.36)
    put(household_objects.can("can"), 0.92, -0.08)
    put(household_objects.plate("plate", (0.80, 0.86, 0.90, 1.0)), 0.95, 0.42)
    put(household_objects.banana("banana"), 0.68, 0.40, yaw=0.6)
    put(household_objects.book("book"), 0.72, -0.48, yaw=0.35)
    put(household_objects.cube("cube"), 0.56, 0.02, yaw=0.4)
    return Scene(
        name="tabletop", world=place, bodies=bodies, eye=(-0.35, -1.25, 1.65), target=(0.8, 0.0, 0.68)
    )


def table(
    size: tuple[float, float] = (0.8, 1.4), height: float = HEIGHT, wood: RGBA = OAK
) -> RobotDescription:
    """Return a four-legged table; size along x and y and height in m."""
    x, y = size
    legs: list[Part] = [
        box((0.06, 0.06, height - 0.03), (i * (x / 2 - 0.06), k * (y / 2 - 0.06), (height - 0.03) / 2), wood)
        for i in (-1, 1)
        for k in (-1, 1)
    ]
    rails = [
        box((x - 0.18, 0.02, 0.07), (0, k * (y / 2 - 0.06), height - 0.065), DARK_OAK) for k in (-1, 1)
    ] + [box((0.02, y - 0.18, 0.07), (i * (x / 2 - 0.06), 0, height - 0.065), DARK_OAK) for i in (-1, 1)]
    top = box((x, y, 0.03), (0, 0, height - 0.015), wood)
    return RobotDescription(name="table", links=(link("base", [top, *legs, *rails]),))
