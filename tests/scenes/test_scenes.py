"""Roboyard's own scenes: what stands, what moves, what it costs."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.scenes import SCENES, load_scene, tabletop, terrain
from roboyard.sim import World


@pytest.mark.parametrize("name", SCENES)
def test_default_view_shows_all_kinds_of_bodies(name: str) -> None:
    scene = load_scene(name)
    image = scene.world.render(scene.camera(width=160, height=120), shadow=False, backend="software")
    seen = set(image.segmentation[..., 0].ravel().tolist()) - {-1}
    assert len(seen) >= min(len(scene.bodies), 9)
    assert seen <= {body.id for body in scene.bodies.values()}


@pytest.mark.parametrize("name", SCENES)
def test_spawn_is_free_and_stands_on_the_ground(name: str) -> None:
    scene = load_scene(name)
    x, y, z = scene.spawn
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    around = [[x + 0.45 * np.cos(a), y + 0.45 * np.sin(a), z + 0.3] for a in angles]
    assert not scene.world.rays([[x, y, z + 0.3]], around).hit.any()
    below = scene.world.ray((x, y, z + 0.5), (x, y, z - 2.0))
    assert below is not None and 0 <= z - below.position[2] < 0.6


def test_objects_on_the_table_stay_and_fall_asleep() -> None:
    scene = tabletop()
    before = {name: body.position for name, body in scene.bodies.items() if not body.is_fixed}
    assert len(before) == 9
    scene.world.step(960)
    for name, was in before.items():
        assert np.linalg.norm(scene.bodies[name].position - was) < 0.03, name
    assert scene.world.data.ntree_awake == 0


def test_a_mug_is_hollow_and_contains_a_sphere() -> None:
    scene = tabletop()
    mug = scene.body("mug")
    ball = scene.world.add_sphere(0.02, np.add(mug.position, (0, 0, 0.12)), mass=0.02)
    scene.world.step(480)
    inside = ball.position - mug.position
    assert np.hypot(*inside[:2]) < 0.02
    assert 0.02 < inside[2] < 0.05


def test_a_sleeping_body_wakes_when_hit() -> None:
    scene = tabletop()
    scene.world.step(960)
    was = scene.body("can").position
    ball = scene.world.add_sphere(0.03, np.add(was, (-0.3, 0, 0.06)), mass=1.0)
    ball.set_velocity(linear=(2.0, 0, 0.5))
    scene.world.step(240)
    assert np.linalg.norm(scene.body("can").position - was) > 0.05


def test_terrain_steps_match_the_tutorial() -> None:
    """Height data as PyBullet's tutorial fills it: index along x runs fastest."""
    draw, rows = random.Random(10), 256
    data = [0.0] * rows * rows
    for j in range(rows // 2):
        for i in range(rows // 2):
            height = draw.uniform(0, 0.5)
            for a, b in ((0, 0), (1, 0), (0, 1), (1, 1)):
                data[2 * i + a + (2 * j + b) * rows] = height
    scene = terrain()
    (visual,) = scene.body("terrain").description.root.visuals
    assert visual.geometry.cell == (0.3, 0.3)
    assert np.array_equal(visual.geometry.heights, np.reshape(data, (rows, rows)).T)


def test_ground_height_matches_the_heightfield() -> None:
    scene = terrain(kind="smooth", height=2.0, seed=3)
    geometry = scene.body("terrain").description.root.visuals[0].geometry
    heights, (dx, dy) = geometry.heights, geometry.cell
    assert heights.max() - heights.min() > 1.0
    for i, k in ((20, 30), (128, 60), (200, 220)):
        x, y = (i - 127.5) * dx, (k - 127.5) * dy
        hit = scene.world.ray((x, y, 10), (x, y, -10))
        assert hit.position[2] == pytest.approx(heights[i, k], abs=1e-4)
    middle = heights[122:134, 122:134]
    assert np.ptp(middle) < 1e-9


def test_equal_seeds_give_equal_ground_and_others_not() -> None:
    grids = [
        terrain(kind="smooth", seed=s).body("terrain").description.root.visuals[0].geometry.heights
        for s in (1, 1, 2)
    ]
    assert np.array_equal(grids[0], grids[1])
    assert not np.allclose(grids[0], grids[2])


def test_invalid_terrain_arguments_raise() -> None:
    with pytest.raises(RoboyardError, match='kind must be "steps" or "smooth", got \'craters\''):
        terrain(kind="craters")  # type: ignore[arg-type]
    with pytest.raises(RoboyardError, match="height must be at least 0 m, got -1"):
        terrain(height=-1.0)


def test_a_scene_is_added_to_a_world_with_bodies() -> None:
    world = World()
    box = world.add_box((0.1, 0.1, 0.1), (0, 3, 0.05))
    scene = tabletop(world)
    assert scene.world is world
    world.step(10)
    assert box.position[2] == pytest.approx(0.05, abs=2e-3)


def test_unknown_bodies_list_the_nearest() -> None:
    with pytest.raises(RoboyardError, match=r"no body named 'mugg'; did you mean 'mug'\?"):
        tabletop().body("mugg")


def test_an_idle_table_steps_far_faster_than_real_time() -> None:
    scene = tabletop()
    scene.world.step(960)
    start = time.process_time()
    scene.world.step(1200)
    assert time.process_time() - start < 1.0
