"""Concave meshes of fixed bodies: bodies touch the triangles near them, however many there are."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.sim import World
from roboyard.sim.build.triangle_windows import FEWEST
from roboyard.sim.physics_profile import BULLET, PLAIN

SIZE = 4.0


def _grid(count: int, height) -> TriangleMesh:
    """A square of 4 m by 4 m with 2 count² triangles at the heights of a function of x and y."""
    at = np.linspace(-SIZE / 2, SIZE / 2, count + 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    corner = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    beyond = corner + count + 1
    faces = np.concatenate(
        [np.stack([corner, beyond, beyond + 1], axis=1), np.stack([corner, beyond + 1, corner + 1], axis=1)]
    )
    return TriangleMesh(vertices=read_only(vertices, np.float64), faces=read_only(faces, np.int32))


def _bowl(x, y):
    return 0.1 * (x * x + y * y)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_bodies_rest_on_the_triangles_of_a_large_flat_mesh(profile) -> None:
    world = World(profile=profile)
    floor = world.add_mesh(_grid(60, lambda x, y: 0 * x), mass=0, concave=True)
    ball = world.add_sphere(0.05, (0.3, 0.1, 0.15))
    box = world.add_box((0.1, 0.1, 0.1), (-0.5, 0.2, 0.15))
    rod = world.add_cylinder(0.05, 0.1, (0.2, 0.9, 0.15))
    world.step(240)
    assert ball.position[2] == pytest.approx(0.05, abs=5e-4)
    for body in (box, rod):  # Bullet's margin around triangles in memory is 1 mm
        assert body.position[2] == pytest.approx(0.051 if profile is BULLET else 0.05, abs=2e-4)
    assert {contact.body_b for contact in world.contacts(ball)} == {floor}
    hit = world.ray((0.3, 1.0, 3), (0.3, 1.0, -3))
    assert hit is not None
    assert hit.body is floor
    assert hit.position[2] == pytest.approx(0.0, abs=1e-6)


def test_a_ball_rests_at_the_bottom_of_a_bowl_and_not_on_its_lid() -> None:
    world = World()
    world.add_mesh(_grid(80, _bowl), mass=0, concave=True, friction=1.0)
    ball = world.add_sphere(0.1, (0.4, 0.3, 0.2))
    world.surfaces.set_damping(ball.links[0], 2.0, 2.0)
    world.step(2000)
    x, y, z = ball.position
    assert np.hypot(x, y) < 0.06
    assert z == pytest.approx(0.1 + _bowl(x, y), abs=2e-3)


def test_a_box_slides_over_seams_as_over_a_plane() -> None:
    """Coulomb's friction takes mu g t from the speed, on a plane by Bullet's two directions of friction."""
    speeds = []
    for is_mesh in (False, True):
        world = World(profile=BULLET)
        if is_mesh:
            floor = world.add_mesh(_grid(40, lambda x, y: 0 * x), mass=0, concave=True)
        else:
            floor = world.add_plane()
        floor.links[0].friction = 1.0
        box = world.add_box((0.3, 0.2, 0.1), (-1, 0, 0.052), friction=0.1)
        world.step(30)
        box.set_velocity((2, 0.3, 0))
        world.step(120)
        speeds.append(box.velocity[0])
    start = np.array([2.0, 0.3, 0.0])
    expected = start * (1.0 - 0.1 * 9.81 * 0.5 / np.linalg.norm(start))
    np.testing.assert_allclose(speeds[1], expected, atol=2e-3)
    np.testing.assert_allclose(speeds[0], expected, atol=0.03)


def test_more_slots_are_made_where_a_body_covers_many_triangles() -> None:
    world = World()
    floor = world.add_mesh(_grid(60, lambda x, y: 0 * x), mass=0, concave=True)
    plate = world.add_box((1.0, 1.0, 0.1), (0, 0, 0.06), mass=10)
    world.step(60)
    (window,) = floor.built.links[0].windows
    assert len(window.slots) > 450 > FEWEST
    assert plate.position[2] == pytest.approx(0.05, abs=5e-4)


def test_a_mesh_that_is_moved_takes_its_triangles_along() -> None:
    world = World()
    floor = world.add_mesh(_grid(30, lambda x, y: 0 * x), mass=0, concave=True)
    ball = world.add_sphere(0.1, (5, 0, 1.2))
    floor.set_pose((5, 0, 1.0), (0, 0, np.sin(0.4), np.cos(0.4)))
    world.step(120)
    assert ball.position[2] == pytest.approx(1.1, abs=1e-3)


def test_bodies_fall_where_a_mesh_was_removed() -> None:
    world = World()
    floor = world.add_mesh(_grid(30, lambda x, y: 0 * x), mass=0, concave=True)
    ball = world.add_sphere(0.1, (0, 0, 0.11))
    world.step(60)
    world.remove(floor)
    world.step(60)
    assert ball.position[2] < -0.2


def test_a_mesh_with_a_mass_is_not_concave() -> None:
    with pytest.raises(RoboyardError, match="only fixed meshes can be concave"):
        World().add_mesh(_grid(2, lambda x, y: 0 * x), mass=1, concave=True)


def test_kernels_find_the_triangles_that_numpy_finds() -> None:
    from roboyard.shapes.triangle_tree import triangle_tree
    from roboyard.sim.stepping import triangle_kernels as kernels

    rng = np.random.default_rng(5)
    tree = triangle_tree(_grid(25, lambda x, y: np.sin(3 * x) * np.cos(2 * y)))
    aabb = np.concatenate([0.1 * rng.normal(size=(4, 3)), 0.05 + 0.3 * rng.random((4, 3))], axis=1)
    positions = 0.7 * rng.normal(size=(4, 3))
    turns = np.stack([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(5)])
    place, reach = rng.normal(size=3), 0.02
    collides = np.array([1, 1, 0, 1], dtype=np.int32)
    expected: set[int] = set()
    for g in (0, 1, 3):
        world_points = tree.corners @ turns[4].T + place
        local = (world_points - positions[g] - turns[g] @ aabb[g, :3]) @ turns[g]
        half = aabb[g, 3:] + reach
        overlaps = (local.min(axis=1) <= half).all(axis=1) & (local.max(axis=1) >= -half).all(axis=1)
        expected |= set(np.flatnonzero(overlaps).tolist())
    seen, found = np.zeros(len(tree), dtype=np.int64), np.zeros(len(tree), dtype=np.int32)
    count = kernels.near_triangles(
        np.arange(4), collides, collides, aabb, positions, turns[:4].reshape(4, 9), place, turns[4].ravel(),
        reach, tree.lower, tree.upper, tree.first, tree.corners, seen, 1, found,
        np.zeros(128, dtype=np.int64), np.zeros((3, 3)),
    )  # fmt: skip
    count = int(count)
    assert len(expected) > 10
    assert sorted(found[:count].tolist()) == sorted(expected)


@pytest.mark.parametrize("profile", [PLAIN, BULLET], ids=["plain", "bullet"])
def test_rays_meet_triangles_far_from_moving_bodies(profile) -> None:
    """Also those of one common start, for which MuJoCo looks at the box around a body's colliding shapes."""
    world = World(profile=profile)
    floor = world.add_mesh(_grid(60, _bowl), mass=0, concave=True)
    ball = world.add_sphere(0.05, (0.0, 0.0, 0.2))
    world.step(100)
    ends = np.array([(x, y, -1.0) for x in np.linspace(-1.9, 1.9, 8) for y in np.linspace(-1.9, 1.9, 8)])
    starts = ends + np.array([0, 0, 5])
    for _ in range(2):
        for seen in (world.rays(starts, ends), world.rays((0, 0, 4), ends)):
            assert (seen.owners[:, 0] == floor.id).all()
            places = seen.position
            assert places[:, 2] == pytest.approx(_bowl(places[:, 0], places[:, 1]), abs=3e-3)
        world.step(5)
    assert ball.position == pytest.approx((0, 0, 0.05), abs=5e-3)
    assert floor.bounds[1] == pytest.approx((2, 2, 0.8), abs=1e-3)


def test_triangles_that_only_rays_meet_are_compiled_for_the_first_ray() -> None:
    """Steps do not need them, and contacts are the same with them."""
    worlds = [World(), World()]
    for world in worlds:
        world.add_mesh(_grid(40, _bowl), mass=0, concave=True, friction=1.0)
        world.add_sphere(0.1, (0.4, 0.3, 0.2))
    worlds[1].show_triangles()
    for world in worlds:
        world.step(300)
    assert worlds[1].live_model.nmeshface - worlds[0].live_model.nmeshface == 2 * 40 * 40
    np.testing.assert_allclose(worlds[0].live_data.qpos, worlds[1].live_data.qpos, atol=1e-12)
    before = worlds[0].live_data.qpos.copy()
    assert worlds[0].ray((1.5, 1.5, 3), (1.5, 1.5, -1)) is not None
    np.testing.assert_array_equal(worlds[0].live_data.qpos, before)
    assert worlds[0].live_model.nmeshface == worlds[1].live_model.nmeshface
    late = worlds[0].add_mesh(_grid(10, _bowl), mass=0, concave=True)  # later ones get them at once
    late.set_pose((0, 0, 2), (0, 0, 0, 1))
    hit = worlds[0].ray((1.5, 1.5, 5), (1.5, 1.5, -1))
    assert hit is not None
    assert hit.body is late
