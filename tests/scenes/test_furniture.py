"""Parts, household objects, cabinets, doors and walls: masses, shapes and motion."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from roboyard.description.model import Mesh, RobotDescription
from roboyard.scenes import furniture_parts as parts
from roboyard.scenes import household_objects
from roboyard.scenes.flat.cabinets import Cell, Column, cabinet, column, drawers, shelves
from roboyard.scenes.flat.doors import door
from roboyard.scenes.flat.seats import bed, chair, desk_chair, sofa, stool
from roboyard.scenes.flat.walls import DOOR_HEIGHT, HEIGHT, THICK, Opening, wall
from roboyard.scenes.revolve import revolve
from roboyard.scenes.terrain_scene import FLAT_RADIUS, smooth_hills
from roboyard.sim import World

GREY = (0.5, 0.5, 0.5, 1.0)


def solid_mass(pieces: list[parts.Part], mass: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and principal moments of a link by the simulator's own reading."""
    world = World(gravity=(0, 0, 0))
    body = world.add_description(parts.object_of("piece", pieces, mass))
    model = world.model
    row = body.links[0].mujoco_id
    return float(model.body_mass[row]), body.center_of_mass, np.sort(model.body_inertia[row])


# ----------------------------------------------------------------------------------------------- parts


def test_a_box_between_corners_is_centred_between_them() -> None:
    part = parts.between((0.1, 0.2, 0.3), (0.5, -0.2, 0.9), GREY)
    assert part.geometry.size == pytest.approx((0.4, 0.4, 0.6))
    assert part.pose.position == pytest.approx((0.3, 0.0, 0.6))


def test_mass_is_spread_over_the_solid_parts_by_volume() -> None:
    pieces = [
        parts.box((0.2, 0.2, 0.2), (0, 0, 0), GREY),
        parts.box((0.2, 0.2, 0.6), (1.0, 0, 0), GREY),
        parts.box((1.0, 1.0, 1.0), (5.0, 0, 0), GREY, solid=False),  # only seen
    ]
    mass, center, _ = solid_mass(pieces, 4.0)
    assert mass == pytest.approx(4.0)
    np.testing.assert_allclose(center, [0.75, 0, 0], atol=1e-9)


def test_inertia_follows_the_parallel_axis_theorem() -> None:
    pieces = [parts.sphere(0.1, (x, 0, 0), GREY) for x in (-0.5, 0.5)]
    _, _, moments = solid_mass(pieces, 2.0)
    ball = 0.4 * 1.0 * 0.1**2
    np.testing.assert_allclose(moments, [2 * ball, 2 * (ball + 0.25), 2 * (ball + 0.25)], rtol=1e-6)


def test_a_collision_only_part_is_touched_but_not_rendered() -> None:
    link = parts.link("base", [parts.collision_only(parts.sphere(0.1, (0, 0, 0), GREY))], 1.0)
    assert len(link.collisions) == 1 and link.visuals == ()


def test_a_skin_is_rendered_but_not_touched() -> None:
    mesh = revolve([(0, 0), (0.1, 0), (0.1, 0.2), (0, 0.2)])
    link = parts.link("base", [parts.skin(mesh, GREY)])
    assert len(link.visuals) == 1 and link.collisions == () and link.inertial is None


@pytest.mark.parametrize("segments", [12, 60, 240])
def test_a_revolved_rectangle_is_a_cylinder(segments: int) -> None:
    mesh = revolve([(0, 0), (0.3, 0), (0.3, 0.5), (0, 0.5)], segments)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    solid.merge_vertices()
    polygon = 0.5 * segments * math.sin(2 * math.pi / segments)  # of a circle of radius 1
    assert solid.is_watertight
    assert solid.volume == pytest.approx(polygon * 0.3**2 * 0.5, rel=1e-9)


def test_a_revolved_ring_has_the_volume_of_pappus() -> None:
    square = [(0.4, 0), (0.5, 0), (0.5, 0.1), (0.4, 0.1), (0.4, 0)]
    mesh = revolve(square, 360)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    solid.merge_vertices()
    assert solid.volume == pytest.approx(2 * math.pi * 0.45 * 0.1 * 0.1, rel=1e-3)


def test_normals_of_a_revolved_cone_are_square_to_its_side() -> None:
    mesh = revolve([(0, 0), (0.3, 0), (0, 0.4)], 64)
    side = mesh.normals[np.abs(mesh.normals[:, 2]) < 0.99]
    np.testing.assert_allclose(side[:, 2], 0.3 / 0.5, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(side, axis=1), 1.0, atol=1e-12)


# ----------------------------------------------------------------------------------- household objects

OBJECTS: dict[str, tuple[Callable[[], RobotDescription], float, tuple[float, float]]] = {
    "mug": (household_objects.mug, 0.3, (0.08, 0.09)),
    "bowl": (household_objects.bowl, 0.35, (0.16, 0.065)),
    "plate": (household_objects.plate, 0.4, (0.24, 0.022)),
    "bottle": (household_objects.bottle, 0.6, (0.07, 0.26)),
    "can": (household_objects.can, 0.4, (0.07, 0.10)),
    "apple": (household_objects.fruit, 0.15, (0.074, 0.081)),
    "book": (household_objects.book, 0.4, (0.21, 0.03)),
    "cube": (household_objects.cube, 0.1, (0.05, 0.05)),
}
"""Constructor, mass (kg), and width along y and height (m) as documented."""


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_have_their_documented_mass_and_size(name: str) -> None:
    make, mass, (width, height) = OBJECTS[name]
    world = World(gravity=(0, 0, 0))
    body = world.add_description(make())
    low, high = body.bounds
    assert body.mass == pytest.approx(mass)
    assert high[1] - low[1] == pytest.approx(width, abs=0.01)  # staves of round walls have corners
    assert high[2] == pytest.approx(height, abs=0.006) and low[2] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", [*OBJECTS, "banana"])
def test_objects_stand_where_they_are_put(name: str) -> None:
    make = household_objects.banana if name == "banana" else OBJECTS[name][0]
    world = World()
    world.add_plane()
    body = world.add_description(make(), position=(0.3, -0.2, 0.002))
    world.step(480)
    assert np.linalg.norm(body.position[:2] - [0.3, -0.2]) < 0.01
    upright = 1 - 2 * (body.orientation[0] ** 2 + body.orientation[1] ** 2)
    assert upright > 0.99


def test_a_bowl_holds_what_falls_into_it() -> None:
    world = World()
    world.add_plane()
    bowl = world.add_description(household_objects.bowl(), position=(0, 0, 0.001))
    apple = world.add_description(household_objects.fruit(), position=(0.01, 0, 0.2))
    world.step(720)
    assert np.linalg.norm(apple.position[:2] - bowl.position[:2]) < 0.03
    assert apple.position[2] < 0.06


# --------------------------------------------------------------------------- cabinets, doors and walls


def test_a_cabinet_has_one_joint_for_each_drawer_and_door() -> None:
    columns = [drawers(3), column("left"), column("right"), shelves(2), column("blank")]
    made = cabinet("unit", (2.0, 0.6, 0.9), columns, rgba=GREY)
    kinds = {joint.name: joint.type for joint in made.joints}
    assert kinds == {
        "drawer_0": "prismatic",
        "drawer_1": "prismatic",
        "drawer_2": "prismatic",
        "door_0": "revolute",
        "door_1": "revolute",
    }


def test_drawers_run_out_by_two_thirds_of_the_depth_and_stay_level() -> None:
    made = cabinet("unit", (0.6, 0.5, 0.8), [drawers(2)], rgba=GREY)
    world = World()
    world.add_plane()
    body = world.add_description(made, fixed_base=True, self_collision=False)
    before = body.link("drawer_0_box").pose[0]
    body.joint("drawer_0").disable_drive()
    for _ in range(480):
        body.link("drawer_0_box").apply_wrench(force=(0, -30.0, 0))
        world.step()
    after = body.link("drawer_0_box").pose[0]
    np.testing.assert_allclose(after - before, [0, -0.66 * 0.5, 0], atol=0.01)


@pytest.mark.parametrize(("side", "sign"), [("left", -1), ("right", 1)])
def test_cabinet_doors_swing_outwards_about_their_side(side: str, sign: int) -> None:
    made = cabinet("unit", (0.5, 0.4, 0.8), [column(side)], rgba=GREY)
    world = World()
    body = world.add_description(made, fixed_base=True, self_collision=False)
    body.joint("door_0").position = math.pi / 2
    low, high = world.bounds_of(np.array([body.link("door_0_leaf").mujoco_id]))
    middle = (low + high) / 2
    assert low[1] < -0.5  # the leaf sticks out towards -y
    assert middle[0] * sign > 0.2  # at the side of its hinge


@pytest.mark.parametrize("heights", [(1.0, 1.0), (1.0, 3.0)])
def test_cells_share_the_height_of_their_column(heights: tuple[float, float]) -> None:
    stack = Column(cells=tuple(Cell(kind="drawer", height=h) for h in heights))
    made = cabinet("unit", (0.5, 0.5, 1.0), [stack], rgba=GREY, plinth=0.0)
    fronts = [link.visuals[0].geometry.size[2] for link in made.links[1:]]
    assert (fronts[1] + 0.006) / (fronts[0] + 0.006) == pytest.approx(heights[1] / heights[0], rel=1e-6)


def test_a_door_closes_its_opening_and_opens_to_its_limit() -> None:
    world = World()
    body = world.add_description(
        door("door", 0.9, opening=math.radians(100)), fixed_base=True, self_collision=False
    )
    assert world.ray((0, -1, 1.2), (0, 1, 1.2)) is not None
    body.joint("hinge").disable_drive()
    for _ in range(960):
        body.link("leaf").apply_wrench(torque=(0, 0, 8.0))
        world.step()
    assert body.joint("hinge").position == pytest.approx(math.radians(100), abs=0.03)
    assert world.ray((0, -1, 1.2), (0, 1, 1.2)) is None


@pytest.mark.parametrize("along", ["x", "y"])
def test_walls_are_open_at_their_openings_and_closed_elsewhere(along: str) -> None:
    openings = [Opening(start=1.0, end=1.9), Opening(start=3.0, end=4.0, bottom=0.9, top=2.0)]
    world = World()
    pieces = wall(along, 0.5, 0.0, 5.0, openings)
    world.add_description(parts.object_of("wall", pieces), fixed_base=True)

    def is_blocked(at: float, height: float) -> bool:
        start, end = (np.array([at, 0.5 + s, height]) for s in (-1.0, 1.0))
        if along == "y":
            start, end = (np.array([v[1], v[0], v[2]]) for v in (start, end))
        return world.ray(start, end) is not None

    assert is_blocked(0.5, 1.0) and is_blocked(2.5, 1.0) and is_blocked(4.5, 1.0)
    assert not is_blocked(1.4, 1.0) and is_blocked(1.4, DOOR_HEIGHT + 0.1)
    assert is_blocked(3.2, 0.5) and is_blocked(3.2, 1.5) and is_blocked(3.2, 2.2)  # a pane fills the window
    assert not is_blocked(0.5, HEIGHT + 0.05)


def test_walls_are_as_thick_as_documented() -> None:
    world = World()
    world.add_description(parts.object_of("wall", wall("x", 0.0, 0.0, 2.0)), fixed_base=True)
    front, back = world.ray((1, -1, 1), (1, 1, 1)), world.ray((1, 1, 1), (1, -1, 1))
    assert back.position[1] - front.position[1] == pytest.approx(THICK)


SEATS: dict[str, Callable[[], RobotDescription]] = {
    "sofa": lambda: sofa("sofa", 2.0, GREY, GREY),
    "chair": lambda: chair("chair"),
    "stool": lambda: stool("stool", GREY),
    "bed": lambda: bed("bed", 1.4, GREY),
    "desk chair": lambda: desk_chair("desk_chair", GREY),
}


@pytest.mark.parametrize("name", SEATS)
def test_seats_stand_on_the_floor_at_a_height_to_sit_on(name: str) -> None:
    world = World()
    body = world.add_description(SEATS[name](), fixed_base=True)
    low, _ = body.bounds
    assert low[2] == pytest.approx(0.0, abs=0.02)
    hit = world.ray((0, 0, 3.0), (0, 0, 0.01))
    assert hit is not None and 0.3 < hit.position[2] < 0.75


# --------------------------------------------------------------------------------------------- terrain


def test_hills_stay_in_their_range_and_are_level_in_the_middle() -> None:
    cell, points = 0.12, 128
    ground = smooth_hills(points, cell, 1.5, 3)
    assert ground.shape == (points, points)
    assert ground.min() >= -1e-9 and ground.max() <= 1.5 + 1e-9
    at = (np.arange(points) - points // 2) * cell
    x, y = np.meshgrid(at, at, indexing="ij")
    flat = ground[np.hypot(x, y) < FLAT_RADIUS]
    assert np.ptp(flat) < 1e-9


def test_hills_have_no_steps() -> None:
    ground = smooth_hills(128, 0.12, 1.5, 3)
    assert max(np.abs(np.diff(ground, axis=k)).max() for k in (0, 1)) < 0.3


def test_skins_of_round_objects_are_closed_surfaces() -> None:
    for make in (household_objects.mug, household_objects.bowl, household_objects.bottle):
        data = [v.geometry.data for v in make().root.visuals if isinstance(v.geometry, Mesh)]
        for mesh in data:
            solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
            solid.merge_vertices()
            assert solid.is_watertight and solid.volume > 0
