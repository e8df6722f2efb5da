"""Rays, contacts, nearest points and boxes of bodies against analytic geometry."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.model import (
    Box,
    Collision,
    Heightfield,
    Inertial,
    Link,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.errors import RoboyardError
from roboyard.shapes import primitives
from roboyard.sim import World
from roboyard.sim.queries.proximity import between_bodies, geom_bounds, nearest
from roboyard.sim.terrain import set_heights
from roboyard.transforms import quaternion_from_axis_angle, rotate

TURN = quaternion_from_axis_angle(np.array([1.0, 2.0, -1.0]) / np.sqrt(6), 0.8)
PLACE = np.array([0.4, -0.3, 1.1])


def random_rays(count: int, seed: int, reach: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) starts on a sphere around PLACE and ends near it."""
    rng = np.random.default_rng(seed)
    starts = rng.normal(size=(count, 3))
    starts = PLACE + reach * starts / np.linalg.norm(starts, axis=1, keepdims=True)
    ends = PLACE + rng.uniform(-0.6, 0.6, (count, 3))
    return starts, PLACE + 2 * (ends - PLACE) - (starts - PLACE)


def first_root(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Smaller root of a t² + 2 b t + c = 0; NaN where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return (-b - np.sqrt(b * b - a * c)) / a


def local(starts: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and directions (not unit) in the frame at PLACE turned by TURN."""
    back = TURN * np.array([-1, -1, -1, 1])
    return rotate(back, starts - PLACE), rotate(back, ends - starts)


def sphere_fraction(start: np.ndarray, way: np.ndarray, radius: float) -> np.ndarray:
    a, b = np.sum(way * way, axis=1), np.sum(start * way, axis=1)
    return first_root(a, b, np.sum(start * start, axis=1) - radius**2)


def box_fraction(start: np.ndarray, way: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Slab method (Kay and Kajiya, 1986)."""
    near = np.minimum((-half - start) / way, (half - start) / way).max(axis=1)
    far = np.maximum((-half - start) / way, (half - start) / way).min(axis=1)
    return np.where(near <= far, near, np.nan)


def tube_fraction(start: np.ndarray, way: np.ndarray, radius: float, half: float) -> np.ndarray:
    """The round side of a cylinder along z."""
    a, b = np.sum(way[:, :2] ** 2, axis=1), np.sum(start[:, :2] * way[:, :2], axis=1)
    t = first_root(a, b, np.sum(start[:, :2] ** 2, axis=1) - radius**2)
    return np.where(np.abs(start[:, 2] + t * way[:, 2]) <= half, t, np.nan)


def cap_fraction(start: np.ndarray, way: np.ndarray, radius: float, half: float) -> np.ndarray:
    """The two flat ends of a cylinder along z."""
    found = []
    for z in (-half, half):
        t = (z - start[:, 2]) / way[:, 2]
        inside = np.linalg.norm((start + t[:, None] * way)[:, :2], axis=1) <= radius
        found.append(np.where(inside, t, np.nan))
    return np.fmin(*found)


def compare(world: World, expected: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> None:
    hits = world.rays(starts, ends)
    met = np.isfinite(expected) & (expected >= 0) & (expected <= 1)
    assert met.sum() > 30 and (~met).sum() > 10
    np.testing.assert_array_equal(hits.hit, met)
    np.testing.assert_allclose(hits.fraction[met], expected[met], atol=1e-6)
    np.testing.assert_allclose(
        hits.position[met], (starts + expected[:, None] * (ends - starts))[met], atol=1e-5
    )
    assert np.all(np.sum(hits.normal * (ends - starts), axis=1)[met] < 0)  # normals face the ray


def test_rays_meet_a_sphere_where_the_quadratic_has_its_first_root() -> None:
    world = World()
    world.add_sphere(0.4, PLACE, mass=0)
    starts, ends = random_rays(200, 1)
    start, way = local(starts, ends)
    compare(world, sphere_fraction(start, way, 0.4), starts, ends)


def test_rays_meet_a_turned_box_by_its_slabs() -> None:
    world = World()
    size = np.array([0.8, 0.5, 0.3])
    world.add_box(tuple(size), PLACE, TURN, mass=0)
    starts, ends = random_rays(200, 2)
    compare(world, box_fraction(*local(starts, ends), size / 2), starts, ends)


def test_rays_meet_a_turned_cylinder_on_its_side_and_its_ends() -> None:
    world = World()
    world.add_cylinder(0.3, 0.6, PLACE, TURN, mass=0)
    starts, ends = random_rays(200, 3)
    start, way = local(starts, ends)
    expected = np.fmin(tube_fraction(start, way, 0.3, 0.3), cap_fraction(start, way, 0.3, 0.3))
    compare(world, expected, starts, ends)


def test_rays_meet_a_turned_capsule_on_its_side_and_its_half_spheres() -> None:
    world = World()
    world.add_capsule(0.25, 0.6, PLACE, TURN, mass=0)
    starts, ends = random_rays(200, 4)
    start, way = local(starts, ends)
    found = [tube_fraction(start, way, 0.25, 0.3)]
    for z in (-0.3, 0.3):
        found.append(sphere_fraction(start - np.array([0, 0, z]), way, 0.25))
    compare(world, np.fmin(np.fmin(found[0], found[1]), found[2]), starts, ends)


def test_rays_meet_a_convex_mesh_like_the_box_that_it_is() -> None:
    world = World()
    half = np.array([0.4, 0.25, 0.15])
    world.add_mesh(primitives.box(*half), position=PLACE, orientation=TURN, mass=0)
    starts, ends = random_rays(200, 5)
    compare(world, box_fraction(*local(starts, ends), half), starts, ends)


def test_the_nearest_of_several_bodies_is_met() -> None:
    world = World()
    bodies = [world.add_sphere(0.2, (x, 0, 0), mass=0) for x in (1.0, 2.0, 3.0)]
    assert world.ray((0, 0, 0), (4, 0, 0)).body is bodies[0]
    assert world.ray((4, 0, 0), (0, 0, 0)).body is bodies[2]
    assert world.ray((1.5, 0, 0), (4, 0, 0)).body is bodies[1]
    world.remove(bodies[0])
    assert world.ray((0, 0, 0), (4, 0, 0)).body is bodies[1]


def test_rays_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(RoboyardError, match=r"\(1, 2\)"):
        World().rays([(0.0, 0.0)], [(1.0, 0.0, 0.0)])


# ---------------------------------------------------------------------------------------------------- terrain


def terrain_world(heights: np.ndarray) -> tuple[World, Heightfield]:
    rows, columns = heights.shape
    field = Heightfield(heights=heights, cell=(2.0 / (rows - 1), 3.0 / (columns - 1)))
    link = Link(name="ground", inertial=Inertial(mass=0.0), collisions=(Collision(geometry=field),))
    world = World()
    world.add_description(RobotDescription(name="ground", links=(link,), joints=()), fixed_base=True)
    return world, field


def test_terrain_is_met_at_the_height_of_its_points() -> None:
    rng = np.random.default_rng(6)
    heights = rng.uniform(0.1, 0.5, (5, 7))
    world, _ = terrain_world(heights)
    for i in range(1, 4):
        for j in range(1, 6):
            x, y = -1.0 + 2.0 * i / 4, -1.5 + 3.0 * j / 6
            hit = world.ray((x + 1e-6, y + 1e-6, 2.0), (x + 1e-6, y + 1e-6, -1.0))
            assert hit is not None and hit.position[2] == pytest.approx(heights[i, j], abs=1e-4)


def test_new_heights_move_the_surface() -> None:
    world, field = terrain_world(np.full((4, 4), 0.2))
    assert world.ray((0.1, 0.1, 2), (0.1, 0.1, -1)).position[2] == pytest.approx(0.2, abs=1e-6)
    set_heights(world, field, np.full((4, 4), 0.35))
    assert world.ray((0.1, 0.1, 2), (0.1, 0.1, -1)).position[2] == pytest.approx(0.35, abs=1e-6)


@pytest.mark.parametrize("wrong", [np.zeros((3, 4)), np.full((4, 4), np.nan)])
def test_heights_of_another_grid_or_not_finite_are_refused(wrong: np.ndarray) -> None:
    world, field = terrain_world(np.full((4, 4), 0.2))
    with pytest.raises(RoboyardError, match="heights must be finite"):
        set_heights(world, field, wrong)
    assert world.ray((0.1, 0.1, 2), (0.1, 0.1, -1)).position[2] == pytest.approx(0.2, abs=1e-6)


# --------------------------------------------------------------------------------------------------- contacts


def test_a_sphere_on_the_floor_touches_in_one_point_below_its_centre() -> None:
    world = World()
    floor = world.add_plane()
    ball = world.add_sphere(0.3, (0.7, -0.2, 0.3), mass=4.0)
    world.step(600)
    (contact,) = world.contacts(ball)
    assert contact.body_a is ball and contact.body_b is floor
    np.testing.assert_allclose(contact.position, [0.7, -0.2, 0.0], atol=2e-3)
    np.testing.assert_allclose(contact.normal, [0, 0, -1], atol=1e-6)  # from the ball to the floor
    assert contact.normal_force == pytest.approx(4.0 * 9.81, rel=1e-3)
    assert world.contacts(floor)[0].normal[2] == pytest.approx(1.0)


def test_friction_of_a_resting_block_balances_a_push() -> None:
    world = World()
    floor = world.add_plane()
    block = world.add_box((0.4, 0.4, 0.2), (0, 0, 0.1), mass=5.0)
    for body in (floor, block):
        body.links[0].friction = 0.8
    for _ in range(400):
        block.links[0].apply_wrench(force=(12.0, 0, 0))
        world.step()
    total = sum(c.friction_force for c in world.contacts(block))
    np.testing.assert_allclose(total[:2], [-12.0, 0.0], atol=0.5)
    assert np.linalg.norm(block.velocity[0]) < 0.01


def test_contact_arrays_hold_what_the_contacts_hold() -> None:
    world = World()
    world.add_plane()
    for k in range(3):
        world.add_box((0.2, 0.2, 0.2), (0.5 * k, 0, 0.1), mass=1.0)
    world.step(300)
    arrays, single = world.contact_arrays(), world.contacts()
    assert len(single) == len(arrays.distance) == 12
    np.testing.assert_allclose(arrays.distance, [c.distance for c in single])
    np.testing.assert_allclose(arrays.force[:, 0].sum(), 3 * 9.81, rtol=0.01)
    np.testing.assert_allclose(np.linalg.norm(arrays.frame, axis=2), 1.0, atol=1e-9)
    for frame in arrays.frame:
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)


def test_contacts_are_found_without_a_step_and_carry_no_force() -> None:
    world = World()
    a = world.add_sphere(0.2, (0, 0, 0), mass=1.0)
    b = world.add_sphere(0.2, (0.35, 0, 0), mass=1.0)
    world.detect_contacts()
    (contact,) = world.contacts(a, b)
    assert contact.distance == pytest.approx(-0.05, abs=1e-6)
    assert world.time == 0.0
    b.set_pose((0.5, 0, 0))
    world.detect_contacts()
    assert world.contacts(a, b) == []


# -------------------------------------------------------------------------------------------- nearest points


@pytest.mark.parametrize("gap", [0.5, 0.05, -0.04])
def test_nearest_points_of_two_spheres_are_on_the_line_of_centres(gap: float) -> None:
    world = World()
    way = np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5])
    a = world.add_sphere(0.2, PLACE, mass=0)
    b = world.add_sphere(0.3, PLACE + (0.5 + gap) * way, mass=0)
    found = nearest(world, a.links[0], b.links[0], 1.0)
    assert found is not None and found.distance == pytest.approx(gap, abs=1e-4)
    np.testing.assert_allclose(found.point_a, PLACE + 0.2 * way, atol=2e-3)
    np.testing.assert_allclose(found.point_b, PLACE + (0.2 + gap) * way, atol=2e-3)
    np.testing.assert_allclose(found.normal, -way, atol=2e-2)


@pytest.mark.parametrize("height", [0.2, 0.6])
def test_nearest_point_of_a_turned_box_over_the_floor_is_its_lowest_corner(height: float) -> None:
    world = World()
    floor = world.add_plane()
    size = np.array([0.5, 0.3, 0.2])
    box = world.add_box(tuple(size), (0, 0, height + 0.5), TURN, mass=0)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = np.array([0, 0, height + 0.5]) + rotate(TURN, 0.5 * size * signs)
    lowest = corners[np.argmin(corners[:, 2])]
    found = nearest(world, box.links[0], floor.links[0], 2.0)
    assert found is not None and found.distance == pytest.approx(lowest[2], abs=1e-4)
    np.testing.assert_allclose(found.point_a, lowest, atol=1e-3)


def test_nothing_is_near_beyond_the_largest_distance() -> None:
    world = World()
    a, b = world.add_sphere(0.1, (0, 0, 0), mass=0), world.add_sphere(0.1, (1, 0, 0), mass=0)
    assert nearest(world, a.links[0], b.links[0], 0.79) is None
    assert len(between_bodies(world, a, b, 0.81)) == 1


def test_boxes_around_geoms_hold_them_and_are_tight() -> None:
    world = World()
    ball, floor = world.add_sphere(0.25, PLACE, mass=0), world.add_plane()
    world.ensure_compiled()
    boxes = geom_bounds(world, [*ball.links[0].geom_ids, *floor.links[0].geom_ids])
    np.testing.assert_allclose(boxes[0], [PLACE - 0.25, PLACE + 0.25], atol=1e-6)
    assert np.isneginf(boxes[1, 0]).all() and np.isposinf(boxes[1, 1]).all()


def test_rays_see_what_is_larger_than_the_colliding_shapes() -> None:
    """Also alone, for which MuJoCo looks at the box around a body's colliding shapes."""
    world = World()
    link = Link(
        name="base",
        visuals=(Visual(geometry=Box(size=(4, 4, 0.2))),),
        collisions=(Collision(geometry=Sphere(radius=0.1)),),
    )
    body = world.add_urdf(RobotDescription(name="table", links=(link,)), fixed_base=True)
    for ends in ([(1.5, 1.5, -3.0)], [(1.5, 1.5, -3.0), (1.5, -1.5, -3.0)]):
        seen = world.rays((1.5, 0.5, 3.0), ends, visual=True)
        assert (seen.owners[:, 0] == body.id).all()
        assert seen.position[:, 2] == pytest.approx(0.1)
        assert not world.rays((1.5, 0.5, 3.0), ends).hit.any()
