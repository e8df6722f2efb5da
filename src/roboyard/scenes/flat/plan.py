"""Plan of the flat: five rooms on 9 by 7.2 m with positions of furniture and objects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from roboyard.description.model import RobotDescription
from roboyard.scenes import household_objects
from roboyard.scenes.flat import fixtures, seats
from roboyard.scenes.flat.cabinets import Cell, Column, cabinet, column, drawers, shelves
from roboyard.scenes.flat.colors import (
    LINEN,
    MUSTARD,
    NAVY,
    OAK,
    PAINT,
    PARQUET,
    SAGE,
    STEEL,
    STONE,
    TERRACOTTA,
    TILES,
    WALNUT,
)
from roboyard.scenes.flat.doors import door
from roboyard.scenes.flat.walls import Opening, wall
from roboyard.scenes.furniture_parts import between, box, object_of
from roboyard.scenes.scene import Scene, let_sleep, world_or_new
from roboyard.scenes.tabletop_scene import table
from roboyard.transforms import quaternion_from_rpy

if TYPE_CHECKING:
    from roboyard.sim import Body, World

WEST, EAST, SOUTH, NORTH = -4.5, 4.5, -3.6, 3.6
"""Middles of the outer walls (m)."""
ACROSS = 0.6
"""y of the wall between the day rooms in the south and the rooms in the north (m)."""
KITCHEN, BATH, STUDY = 0.7, -0.9, 1.3
"""x of the western walls of these rooms (m)."""
LEFT, RIGHT, BACK = math.pi / 2, -math.pi / 2, math.pi
"""Yaw of furniture with its front to the east, west and north (rad)."""

ROOMS = {
    "living room": (-1.4, -1.2),
    "kitchen": (2.1, -1.3),
    "bedroom": (-1.5, 1.5),
    "bathroom": (0.1, 1.3),
    "study": (2.0, 1.4),
}
WORKTOP = 0.90
"""Height of the kitchen worktop (m)."""


class Flat:
    """Adds furniture and objects to a world."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.bodies: dict[str, Body] = {}

    def add_fixed(self, description: RobotDescription, x: float, y: float, yaw: float = 0.0) -> None:
        """Add furniture fixed to the floor at `x`, `y` (m) and `yaw` (rad)."""
        self._add(description, x, y, 0.0, yaw, fixed=True)

    def add_free(self, description: RobotDescription, x: float, y: float, z: float, yaw: float = 0.0) -> None:
        """Add a free body at `x`, `y`, `z` (m) and `yaw` (rad)."""
        self._add(description, x, y, z + 0.001, yaw, fixed=False)

    def _add(
        self, description: RobotDescription, x: float, y: float, z: float, yaw: float, *, fixed: bool
    ) -> None:
        turn = quaternion_from_rpy((0.0, 0.0, yaw))
        self.bodies[description.name] = self.world.add_description(
            description, (x, y, z), turn, fixed_base=fixed, self_collision=False, drives=False
        )


def home(world: World | None = None) -> Scene:
    """Add a furnished flat: living room, kitchen, bedroom, bathroom and study.

    Doors between the rooms, the front door, cupboards, the refrigerator and all drawers have joints
    (`Scene.joints`) without motors. Cups, plates, fruit, books and chairs are free bodies. Bodies at rest
    sleep. Lamps emit no light: cameras have their own.
    """
    flat = Flat(world_or_new(world))
    let_sleep(flat.world)
    flat.bodies["ground"] = flat.world.add_plane(rgba=(0.80, 0.82, 0.80, 1.0), name="ground")
    _shell(flat)
    _doors(flat)
    _living_room(flat)
    _kitchen(flat)
    _bedroom(flat)
    _bathroom(flat)
    _study(flat)
    return Scene(
        name="home",
        world=flat.world,
        bodies=flat.bodies,
        spawn=(*ROOMS["living room"], 0.0),
        eye=(0.5, -5.4, 11.9),
        target=(0.0, -0.05, 0.0),
        rooms=ROOMS,
    )


def _shell(flat: Flat) -> None:
    floors = [
        between((WEST, SOUTH, -0.02), (KITCHEN, ACROSS, 0.002), PARQUET, solid=False),
        between((KITCHEN, SOUTH, -0.02), (EAST, ACROSS, 0.002), TILES, solid=False),
        between((WEST, ACROSS, -0.02), (BATH, NORTH, 0.002), PARQUET, solid=False),
        between((BATH, ACROSS, -0.02), (STUDY, NORTH, 0.002), (0.78, 0.83, 0.84, 1.0), solid=False),
        between((STUDY, ACROSS, -0.02), (EAST, NORTH, 0.002), PARQUET, solid=False),
    ]
    flat.add_fixed(object_of("floors", floors), 0, 0)
    window = {"bottom": 0.9, "top": 2.05}
    half = 0.06
    walls = [
        *wall("x", SOUTH, WEST - half, EAST + half,
              [Opening(start=-0.85, end=0.2), Opening(start=1.7, end=3.4, bottom=1.15, top=2.05)]),
        *wall("x", NORTH, WEST - half, EAST + half,
              [Opening(start=-3.6, end=-1.8, **window), Opening(start=-0.2, end=0.6, bottom=1.5, top=2.05),
               Opening(start=2.2, end=3.7, **window)]),
        *wall("y", WEST, SOUTH + half, NORTH - half, [Opening(start=-2.9, end=-0.6, **window)]),
        *wall("y", EAST, SOUTH + half, NORTH - half, [Opening(start=-1.6, end=-0.2, **window)]),
        *wall("x", ACROSS, WEST + half, EAST - half,
              [Opening(start=-2.25, end=-1.2), Opening(start=-0.4, end=0.6), Opening(start=1.6, end=2.65)]),
        *wall("y", KITCHEN, SOUTH + half, ACROSS - half, [Opening(start=-2.1, end=-0.5, top=2.2)]),
        *wall("y", BATH, ACROSS + half, NORTH - half),
        *wall("y", STUDY, ACROSS + half, NORTH - half),
    ]  # fmt: skip
    flat.add_fixed(object_of("walls", walls), 0, 0)


def _doors(flat: Flat) -> None:
    flat.add_fixed(door("front_door", 1.05, NAVY), -0.325, SOUTH)
    flat.add_fixed(door("bedroom_door", 1.05, opening=math.radians(92)), -1.725, ACROSS)
    flat.add_fixed(door("bathroom_door", 1.0, PAINT), 0.10, ACROSS)
    flat.add_fixed(door("study_door", 1.05), 2.125, ACROSS)


def _living_room(flat: Flat) -> None:
    flat.add_fixed(fixtures.rug("living_rug", (2.6, 1.9), (0.80, 0.74, 0.66, 1), TERRACOTTA), -2.9, -1.75)
    flat.add_fixed(seats.sofa("sofa", 2.3, SAGE, MUSTARD), -2.9, -3.0, BACK)
    flat.add_fixed(seats.sofa("armchair", 1.0, LINEN, TERRACOTTA), -3.95, -1.55, LEFT)
    flat.add_fixed(fixtures.low_table("coffee_table", (1.1, 0.6), 0.42), -2.9, -1.8)
    bench = cabinet(
        "tv_bench", (1.7, 0.42, 0.48), [column("left"), drawers(2, 1.2), column("right")],
        rgba=OAK, front=PAINT, top=OAK,
    )  # fmt: skip
    flat.add_fixed(bench, -3.1, 0.30)
    flat.add_fixed(fixtures.television("television", 1.15, 0.48), -3.1, 0.32)
    flat.add_fixed(fixtures.floor_lamp("floor_lamp"), -4.15, -3.2)
    flat.add_fixed(fixtures.plant("plant", 1.25), -4.1, 0.2)
    shelf = cabinet(
        "bookshelf", (1.1, 0.32, 1.9), [shelves(5)], rgba=WALNUT,
        extra=fixtures.books(
            [(-0.50, 0.1, 0.462), (-0.50, 0.44, 0.820), (-0.2, 0.48, 1.178), (-0.5, 0.0, 1.535)], 0.32
        ),
    )  # fmt: skip
    flat.add_fixed(shelf, 0.46, -2.9, RIGHT)
    flat.add_fixed(fixtures.picture("picture", (0.8, 0.6), 1.25, SAGE, TERRACOTTA), 0.64, 0.05, RIGHT)
    flat.add_free(household_objects.mug("coffee_mug", TERRACOTTA), -2.6, -1.7, 0.42, 0.4)
    flat.add_free(household_objects.book("novel"), -3.2, -1.85, 0.42, 0.3)
    flat.add_free(household_objects.fruit("orange", (0.90, 0.52, 0.13, 1.0)), -2.85, -1.9, 0.42)


def _kitchen(flat: Flat) -> None:
    south = cabinet(
        "kitchen_south", (3.0, 0.6, WORKTOP),
        [column("blank", 1.25), drawers(3), column("left"), column("right"), drawers(3)],
        rgba=PAINT, front=SAGE, top=STONE, worktop=0.04, extra=fixtures.sink(WORKTOP, (0.36, -0.02)),
    )  # fmt: skip
    flat.add_fixed(south, 2.93, SOUTH + 0.37, BACK)
    east = cabinet(
        "kitchen_east", (1.2, 0.6, WORKTOP), [drawers(3), column("left")],
        rgba=PAINT, front=SAGE, top=STONE, worktop=0.04, extra=fixtures.hob(WORKTOP, -0.2),
    )  # fmt: skip
    flat.add_fixed(east, EAST - 0.37, -2.30, RIGHT)
    fridge = cabinet(
        "refrigerator", (0.62, 0.64, 1.85),
        [Column(cells=(Cell(kind="left", height=0.45), Cell(kind="left", height=0.9)))],
        rgba=PAINT, front=STEEL, plinth=0.04,
    )  # fmt: skip
    flat.add_fixed(fridge, 1.09, SOUTH + 0.39, BACK)
    high = cabinet(
        "wall_cupboard", (0.64, 0.33, 0.62), [column("left"), column("right")],
        rgba=PAINT, front=SAGE, base=1.45, plinth=0.0,
    )  # fmt: skip
    flat.add_fixed(high, EAST - 0.235, -2.95, RIGHT)
    flat.add_fixed(fixtures.hood("hood"), EAST - 0.06, -2.10, RIGHT)
    flat.add_fixed(table((0.85, 1.4), 0.74), 3.55, -0.45, LEFT)
    for name, x, y, yaw in (
        ("chair_1", 3.2, -1.1, BACK), ("chair_2", 3.9, -1.1, BACK),
        ("chair_3", 3.2, 0.2, 0.0), ("chair_4", 3.9, 0.2, 0.0),
    ):  # fmt: skip
        flat.add_free(seats.chair(name), x, y, 0.0, yaw)
    flat.add_free(household_objects.mug("mug", household_objects.TEAL), 3.15, -0.55, 0.74, 0.3)
    flat.add_free(household_objects.plate("plate", PAINT), 3.9, -0.62, 0.74)
    flat.add_free(household_objects.bowl("bowl", TERRACOTTA), 3.55, -0.38, 0.74)
    flat.add_free(household_objects.fruit("apple"), 3.55, -0.38, 0.753)
    flat.add_free(household_objects.banana("banana"), 3.2, -0.25, 0.74, 0.8)
    flat.add_free(household_objects.bottle("bottle"), 1.65, SOUTH + 0.30, WORKTOP)
    flat.add_free(household_objects.can("can"), 3.45, SOUTH + 0.30, WORKTOP)


def _bedroom(flat: Flat) -> None:
    flat.add_fixed(fixtures.rug("bedroom_rug", (2.2, 1.4), (0.62, 0.67, 0.72, 1), NAVY), -3.1, 1.75)
    flat.add_fixed(seats.bed("bed", 1.6, NAVY), -3.1, NORTH - 1.13)
    flat.add_fixed(cabinet("nightstand", (0.44, 0.4, 0.5), [drawers(2)], rgba=OAK), -4.15, NORTH - 0.28)
    flat.add_fixed(fixtures.table_lamp("bedside_lamp", 0.5), -4.15, NORTH - 0.26)
    wardrobe = cabinet(
        "wardrobe", (1.3, 0.6, 2.1),
        [column("left"), column("right")], rgba=OAK, front=PAINT,
    )  # fmt: skip
    flat.add_fixed(wardrobe, BATH - 0.37, 2.60, RIGHT)
    flat.add_fixed(cabinet("dresser", (0.9, 0.36, 0.85), [drawers(4)], rgba=WALNUT), -3.95, 0.85, BACK)
    flat.add_free(household_objects.book("diary", TERRACOTTA), -3.85, 0.85, 0.85, 0.2)


def _bathroom(flat: Flat) -> None:
    flat.add_fixed(fixtures.bathtub("bathtub"), 0.25, NORTH - 0.445)
    flat.add_fixed(fixtures.shower_screen("shower_screen", 0.8), -0.2, NORTH - 0.80)
    flat.add_fixed(fixtures.toilet("toilet"), BATH + 0.37, 2.1, LEFT)
    vanity = cabinet(
        "vanity", (0.8, 0.46, 0.8), [drawers(2), column("right")], rgba=OAK, front=PAINT, top=STONE
    )
    flat.add_fixed(vanity, STUDY - 0.30, 1.7, RIGHT)
    flat.add_fixed(fixtures.basin("basin", 0.8), STUDY - 0.30, 1.7, RIGHT)
    flat.add_fixed(fixtures.mirror("mirror", (0.6, 0.8), 1.15), STUDY - 0.06, 1.7, RIGHT)


def _study(flat: Flat) -> None:
    flat.add_fixed(fixtures.rug("study_rug", (1.5, 1.2), TERRACOTTA, (0.85, 0.78, 0.66, 1)), 2.95, 2.35)
    desk_top = box((1.5, 0.7, 0.03), (0, 0, 0.735), OAK)
    legs = [box((0.05, 0.6, 0.72), (-0.70, 0, 0.36), OAK), box((1.3, 0.02, 0.3), (0.0, 0.3, 0.55), OAK)]
    flat.add_fixed(object_of("desk", [desk_top, *legs]), 2.95, NORTH - 0.43)
    flat.add_fixed(
        cabinet("desk_drawers", (0.42, 0.6, 0.72), [drawers(3)], rgba=OAK, front=NAVY), 3.47, NORTH - 0.43
    )
    flat.add_fixed(fixtures.television("monitor", 0.6, 0.75), 2.85, NORTH - 0.25)
    flat.add_fixed(fixtures.table_lamp("desk_lamp", 0.75), 3.5, NORTH - 0.25)
    flat.add_free(seats.desk_chair("desk_chair", NAVY), 2.85, 2.45, 0.0, BACK)
    shelf = cabinet(
        "study_shelf", (1.4, 0.32, 1.6), [shelves(4), shelves(4)], rgba=OAK,
        extra=fixtures.books(
            [(-0.65, -0.1, 0.475), (0.05, 0.6, 0.475), (-0.65, -0.2, 0.85), (0.1, 0.4, 1.22)], 0.32
        ),
    )  # fmt: skip
    flat.add_fixed(shelf, EAST - 0.23, 1.75, RIGHT)
    flat.add_fixed(fixtures.plant("study_plant", 1.0), STUDY + 0.35, NORTH - 0.4)
    flat.add_free(household_objects.book("manual", SAGE), 2.55, NORTH - 0.52, 0.75, -0.2)
    flat.add_free(household_objects.mug("pencil_mug", MUSTARD), 3.2, NORTH - 0.4, 0.75)
